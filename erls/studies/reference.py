"""The reference of a study: positions that are better than what they judge, with an error of their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from erls.errors import Cause, SimulationError
from erls.lie.so3 import Array
from erls.run import Run
from erls.scene import Scene, load_scene
from erls.simulation import simulate
from erls.studies.pool import run_all

_SAMPLES = 400


@dataclass(frozen=True)
class Reference:
    """Positions (k, points, 3) at ``times`` (k,), how they were made, and their own error [m]."""

    times: Array
    positions: Array
    made_by: str
    error: float


def default_reference(scene: Scene) -> str:
    """The nodal formulation is the judge wherever it can run."""
    from fe_import.link import load_link

    beams = all(
        link.rigid is not None
        or (link.model and load_link(scene.folder / link.model).description.frame is not None)
        for link in scene.record.links
    )
    return "nodal" if beams and not scene.record.loops else "tight"


REFERENCES: dict[str, tuple[str, tuple[tuple[str, ...], ...]]] = {
    "nodal": (
        "nodal formulation, 32 and 16 elements per member with steps in the same ratio, extrapolated",
        (
            ("simulation.formulation=nodal", "simulation.elements_per_member=32", "simulation.step=2.5e-4"),
            ("simulation.formulation=nodal", "simulation.elements_per_member=16", "simulation.step=5e-4"),
        ),
    ),
    "tight": (
        "all modes and effects, lobatto at a tolerance of 1e-8 m beside 1e-7 m",
        (
            ("simulation.integrator=lobatto", "simulation.tolerance=1e-8"),
            ("simulation.integrator=lobatto", "simulation.tolerance=1e-7"),
        ),
    ),
}


def make_reference(
    path: Path,
    scene: Scene,
    overrides: tuple[str, ...],
    kind: str,
    points: tuple[str, ...],
    workers: int | None,
    progress: Callable[[float, float], None],
) -> Reference:
    """Positions of points over the run that settings are judged against, with the error they have themselves.

    Parameters
    ----------
    path, scene, overrides : Path, Scene, tuple of str
        A scene file, as loaded, and changes of it ("table.key=value").
    kind : str
        One of `REFERENCES`.
    points : tuple of str
        Names of points.
    workers : int or None
        Processes (`erls.studies.pool.run_all`).
    progress : callable
        ``progress(done, total)`` in runs.

    Raises
    ------
    SimulationError
        A run of the reference failed (its cause, with the remedy), or was interrupted.
    """
    made_by, variants = REFERENCES[kind]
    times = np.linspace(0.0, scene.record.simulation.duration, _SAMPLES + 1)
    tasks = [(str(path), (*overrides, "simulation.effects=all", *variant), points, times) for variant in variants]
    finished, complete = run_all(_positions, tasks, progress, workers)
    if not complete:
        raise SimulationError(Cause.INTERRUPTED, "the reference was interrupted", remedy="nothing was kept")
    for one in finished:
        if one.error is not None:
            one.error.remedy = f"this was the reference ({made_by}); choose another one, or: {one.error.remedy}"
            raise one.error
    fine, coarse = (one.result for one in finished)
    change = fine - coarse
    error = float(np.linalg.norm(change, axis=2).max())
    if kind == "nodal":  # second order in mesh and step, both halved
        return Reference(times, fine + change / 3, made_by, error / 3)
    return Reference(times, fine, made_by, error)


def _positions(task: tuple[str, tuple[str, ...], tuple[str, ...], Array]) -> Array:
    path, overrides, points, times = task
    return sampled(simulate(load_scene(path, overrides)), points, times)


def sampled(run: Run, points: Sequence[str], times: Array) -> Array:
    """Positions (k, points, 3) [m] of named points at k times [s]."""
    return np.stack([run.position(name, times) for name in points], axis=1)
