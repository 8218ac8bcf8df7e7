"""Scene in, run out: the one door to a simulation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, overload

from erls.run.chain.run import ChainRun
from erls.run.checkpoints import Checkpoints
from erls.run.record import Run
from erls.scene.bodies.schema import BodyScene
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.read import AnyScene, load_scene
from erls.scene.records import SceneFile
from erls.simulation.asked import Asked
from erls.simulation.chains import run_chain
from fe_import.files.log import log

Progress = Callable[[float, float], None]  # (time, duration)


def _run_bodies(scene: BodyScene, asked: Asked) -> Run:
    from erls.simulation.bodies import run_bodies  # here: it imports nodal elements, which chains do not need

    return run_bodies(scene, asked)


RUNS: dict[type[SceneFile], Callable[[Any, Asked], Run]] = {Scene: run_chain, BodyScene: _run_bodies}
"""What runs a kind of scene: one line each."""


def run_as_asked(scene: AnyScene, asked: Asked) -> Run:
    """The run of a scene of any kind; see `simulate`."""
    return RUNS[type(scene)](scene, asked)


@overload
def simulate(
    scene: Scene,
    *,
    progress: Progress | None = ...,
    tell: Message = ...,
    checkpoint: Path | Checkpoints | None = ...,
    strict: bool = ...,
    like: ChainRun | None = ...,
    verdict: bool = ...,
    until: float | None = ...,
) -> ChainRun: ...


@overload
def simulate(
    scene: AnyScene | Path | str,
    *,
    progress: Progress | None = ...,
    tell: Message = ...,
    checkpoint: Path | Checkpoints | None = ...,
    strict: bool = ...,
    like: ChainRun | None = ...,
    verdict: bool = ...,
    until: float | None = ...,
) -> Run: ...


def simulate(
    scene: AnyScene | Path | str,
    *,
    progress: Progress | None = None,
    tell: Message = log,
    checkpoint: Path | Checkpoints | None = None,
    strict: bool = False,
    like: ChainRun | None = None,
    verdict: bool = True,
    until: float | None = None,
) -> Run:
    """Simulate a scene.

    Parameters
    ----------
    scene : Scene, BodyScene, Path or str
    progress : callable, optional
        Called with (time, duration) after each step.
    tell : callable, optional
        Told about each preparation that takes time, and every warning as soon as it is known.
    checkpoint : Path or Checkpoints, optional
        Run file to which a motion saves what it has from its first second of work on; with what was saved,
        ``Checkpoints(path, saved=read_checkpoint(path))`` of `erls.run.checkpoints`, it goes on from there, and equals
        the run that was not interrupted bit for bit on the same machine.
    strict : bool
        Whether to repeat a run whose stated error passes its tolerance with what keeps it, and to fail where nothing
        does.
    like : ChainRun, optional
        A run of a scene with the same links, whose modal models serve again instead of being read. Where links are
        split, it is of the nodal formulation if the scene is.
    verdict : bool
        Whether the run states its error, ``accuracy``, and whether it can be relied on, ``trust``; nothing is computed
        for it otherwise.
    until : float, optional
        Go on up to this time [s] once the run has come to its end, with what was settled for it
        (`erls.simulation.extension`).

    Returns
    -------
    Run
        Of a chain `erls.run.chain.run.ChainRun`; of bodies and beams `erls.run.bodies.motion.BodyMotion`, or
        `erls.run.bodies.rest.BodyRest` where equilibria, buckling loads or frequencies are asked for.

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy; CHANGED: the checkpoint is of something else.
    SimulationError
        The integration failed or was interrupted: says when, why and what to try. What was computed is in its
        attribute ``run``.

    Examples
    --------
    >>> import erls
    >>> scene = erls.load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.01"])
    >>> run = erls.simulate(scene)
    >>> bool(run.position("tip", 0.01)[2] < 0)
    True
    >>> bool(abs(erls.simulate("data/statics/roll_up.toml").position("tip", 1.0)).max() < 1e-10)  # back at the root
    True
    """
    loaded = load_scene(scene) if isinstance(scene, (Path, str)) else scene
    saving = Checkpoints(checkpoint) if isinstance(checkpoint, Path) else checkpoint
    return run_as_asked(loaded, Asked(progress, tell, saving, strict, like, verdict, until))
