"""What accuracy costs in time: one scene in many settings, error against time, and the cheapest that is good enough.

A *ladder* is a formulation with a number of modes, a set of effects and an integrator, run with finer and finer steps
or tolerances until it is as good as the reference, or too slow. What the reference is, `erls.studies.reference` says.
A setting is recommended when its error, with that of the reference, is within the tolerance, and its run does not warn
of a larger one itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.studies.cost_result import CostStudy, cheapest, pareto_front
from erls.studies.grid import Grid, checked, ladders
from erls.studies.kept import KeptRuns, State, keeping
from erls.studies.ladder import CostPoint, Ladder, Norm, climb, failed, overrides_of
from erls.studies.mode_overrides import available_modes, count_field
from erls.studies.pool import Finished, run_all
from erls.studies.reference import Reference, default_reference, knows_second_order, make_reference
from fe_import.errors import ReportedError
from fe_import.files.toml import choose


def study_cost(
    scene: Scene | Path | str,
    tolerance: float = 1e-4,
    *,
    grid: Grid | None = None,
    points: Sequence[str] = (),
    norm: Norm = "max",
    reference: str = "",
    overrides: Sequence[str] = (),
    budget: float = 240.0,
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
    state: State | None = None,
) -> CostStudy:
    """Run a scene in many settings and weigh error against time.

    Parameters
    ----------
    scene : Scene, Path or str
    tolerance : float
        Distance of named points that does not matter [m].
    grid : Grid, optional
    points : sequence of str
        Named points to look at; all of the scene unless given.
    norm : str
        ``max`` or ``rms`` over time; the worst point counts.
    reference : str
        ``nodal`` or ``tight``; nodal wherever it can run unless given.
    overrides : sequence of str
        ``KEY=VALUE`` applied to the scene, for all runs.
    budget : float
        Wall time after which no further run starts [s], without what the reference compiles; what did not run is
        reported as such.
    progress : callable
        Called with (reference and finished ladders, all).
    workers : int, optional
        Processes; as many as cores unless given.
    state : State, optional
        File that keeps the reference, and settings with all their runs, as they are finished; what the budget cut short
        is not kept.

    Raises
    ------
    SceneError, FEImportError
        Bad input.
    SceneError
        BUDGET: it would not last for a reference.
    SimulationError
        The reference failed.
    """
    path = scene.path if isinstance(scene, Scene) else Path(scene)
    loaded = load_chain(path, overrides)
    _check(tolerance, "tolerance")
    _check(budget, "budget")
    choose(norm, ("max", "rms"), "norm", SceneError)
    named = [point.name for point in loaded.record.points]
    if not named:
        remedy = "add [[points]] to the scene"
        raise SceneError(Cause.BAD_FIELD, "there is no named point to compare", where=str(path), remedy=remedy)
    for point in points:
        choose(point, named, "points", SceneError)
    chosen = tuple(points) or tuple(named)
    choose(reference or "nodal", ("nodal", "tight"), "reference", SceneError)
    grid = checked(grid or Grid())
    begun = time.monotonic()
    modes = available_modes(loaded)
    rungs = ladders(loaded, grid, tolerance, min(modes.values(), default=0), knows_second_order(loaded) is True)
    total = 1 + len(rungs)
    progress(0, total)
    with keeping(state, path, overrides) as kept:
        asked = "reference", tuple(overrides), reference, chosen, tolerance, budget
        truth = kept.once(asked, Reference, lambda: _reference(loaded, reference, chosen, tolerance, budget))
        progress(1, total)
        fields = tuple(count_field(loaded, name) for name in modes)
        until = begun + budget + truth.prepared_s
        tasks = [
            Ladder(
                path=str(path),
                overrides=tuple(overrides),
                fields=fields,
                rungs=ladder,
                points=chosen,
                norm=norm,
                reference=truth,
                tolerance=tolerance,
                slowest=budget / 10,
                until=until,
                named=bool(grid.integrators),
            )
            for ladder in rungs
        ]
        known = KeptRuns(kept, [replace(task, path="", until=0.0) for task in tasks], list[CostPoint], _whole)
        finished, complete = run_all(climb, tasks, partial(_advanced, progress, total), workers, False, known)
    runs = tuple(run for one in finished for run in _runs(one, tasks[one.number]))
    best = cheapest(runs, tolerance - truth.error, tolerance)
    how = () if best is None else overrides_of(best.setting, fields)
    return CostStudy(loaded.name, chosen, norm, tolerance, truth, runs, pareto_front(runs), best, how, complete)


def _reference(scene: Scene, kind: str, points: tuple[str, ...], tolerance: float, budget: float) -> Reference:
    """The one asked for, or a tight one where beams turn out to be nothing for the nodal formulation."""
    first = kind or default_reference(scene)
    try:
        return make_reference(scene, "nodal" if first == "nodal" else "tight", points, tolerance, budget)
    except ReportedError as problem:
        if kind or first == "tight" or isinstance(problem, SimulationError) or problem.cause == Cause.BUDGET:
            raise
        return make_reference(scene, "tight", points, tolerance, budget)


def _whole(found: list[CostPoint]) -> bool:
    """Whether the budget of the study left a ladder alone."""
    return all(point.failure is None or point.failure.cause != Cause.BUDGET for point in found)


def _advanced(progress: Callable[[float, float], None], total: int, done: float, _: float) -> None:
    progress(1 + done, total)


def _check(value: float, name: str) -> None:
    if not 0 < value < np.inf:
        message, remedy = f"the {name} must be a positive number", "give metres" if name == "tolerance" else "seconds"
        raise SceneError(Cause.BAD_FIELD, message, where=name, value=value, remedy=remedy)


def _runs(one: Finished, task: Ladder) -> list[CostPoint]:
    return one.result if one.error is None else [failed(task.rungs[0], one.error)]
