"""Scene in, run out: the one door to a simulation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from erls.run.record import Run
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.simulation.asked import Asked
from erls.simulation.chains import run_chain

Progress = Callable[[float, float], None]  # (time, duration)

RUNS: dict[type[Scene], Callable[[Scene, Asked], Run]] = {Scene: run_chain}
"""What runs a kind of scene: one line each."""


def simulate(
    scene: Scene | Path | str,
    *,
    progress: Progress | None = None,
    tell: Message = lambda text: None,
    checkpoint: Path | None = None,
    strict: bool = False,
    like: Run | None = None,
) -> Run:
    """Simulate a scene.

    Parameters
    ----------
    scene : Scene, Path or str
    progress : callable, optional
        Called with (time, duration) after each step.
    tell : callable, optional
        Told about each preparation that takes time, and every warning as soon as it is known.
    checkpoint : Path, optional
        Run file to which a long run saves what it has, every 20 s of work.
    strict : bool
        With ``effects = "auto"``: whether to repeat the run where what was left out passes the tolerance, and to fail
        where its own estimate still does.
    like : Run, optional
        A run of a scene with the same links, whose modal models serve again instead of being read. Where links are
        split, it is of the nodal formulation if the scene is.

    Returns
    -------
    Run

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy.
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
    """
    if not isinstance(scene, Scene):
        scene = load_chain(scene)
    return RUNS[type(scene)](scene, Asked(progress, tell, checkpoint, strict, like))
