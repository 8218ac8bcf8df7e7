"""What accuracy costs in time: one scene in many settings, error against time, and the cheapest that is good enough.

A *ladder* is a formulation with a number of modes, a set of effects and an integrator, run with finer and finer steps
or tolerances until it is as good as the reference, or too slow. What the reference is, `erls.studies.reference` says.
A setting is recommended when its error, with that of the reference, is within the tolerance, and its run does not warn
of a larger one itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.studies.grid import Grid, checked, ladders
from erls.studies.ladder import CostPoint, Ladder, Norm, climb, failed, overrides_of
from erls.studies.mode_overrides import available_modes, count_field
from erls.studies.pool import Finished, run_all
from erls.studies.reference import Reference, default_reference, knows_second_order, make_reference
from fe_import.errors import ReportedError
from fe_import.files.toml import choose

_AS_CHEAP = 1.2  # times the shortest: what noise makes of equal times


@dataclass(frozen=True)
class CostStudy:
    """The result of `study_cost`.

    Attributes
    ----------
    scene : str
    points : tuple of str
        Named points that the error is taken over.
    norm : str
    tolerance : float
        What the user asked for [m].
    reference : Reference
    runs : tuple of CostPoint
        Ladder by ladder, from coarse to fine.
    front : tuple of CostPoint
        Runs that no other one beats in both error and time, from cheap to accurate.
    chosen : CostPoint or None
        The cheapest that meets the tolerance; of those within a fifth of its time the plainest.
    chosen_overrides : tuple of str
        Its ``KEY=VALUE``.
    complete : bool
        False after an interrupt.
    """

    scene: str
    points: tuple[str, ...]
    norm: Norm
    tolerance: float
    reference: Reference
    runs: tuple[CostPoint, ...]
    front: tuple[CostPoint, ...]
    chosen: CostPoint | None
    chosen_overrides: tuple[str, ...]
    complete: bool


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
    truth = _reference(loaded, reference, chosen, tolerance, budget)
    progress(1, total)
    fields = tuple(count_field(loaded, name) for name in modes)
    until = begun + budget + truth.prepared_s
    tasks = [
        Ladder(str(path), tuple(overrides), fields, ladder, chosen, norm, truth, tolerance, budget / 10, until)
        for ladder in rungs
    ]
    advance = partial(_advanced, progress, total)
    finished, complete = run_all(climb, tasks, advance, workers, longest_last=False)
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


def _advanced(progress: Callable[[float, float], None], total: int, done: float, _: float) -> None:
    progress(1 + done, total)


def _check(value: float, name: str) -> None:
    if not 0 < value < np.inf:
        message, remedy = f"the {name} must be a positive number", "give metres" if name == "tolerance" else "seconds"
        raise SceneError(Cause.BAD_FIELD, message, where=name, value=value, remedy=remedy)


def _runs(one: Finished, task: Ladder) -> list[CostPoint]:
    return one.result if one.error is None else [failed(task.rungs[0], one.error)]


def pareto_front(runs: Sequence[CostPoint]) -> tuple[CostPoint, ...]:
    """Runs that no other one beats in both error and time, from cheap to accurate."""
    front: list[CostPoint] = []
    for run in sorted((r for r in runs if r.failure is None), key=lambda r: (r.wall_s, r.error)):
        if not front or run.error < front[-1].error:
            front.append(run)
    return tuple(front)


def cheapest(runs: Sequence[CostPoint], largest: float, tolerance: float) -> CostPoint | None:
    """The run to recommend: of those off by ``largest`` at most that do not warn of more than the tolerance the
    cheapest, or, of those as cheap within the noise, the plainest: effects that are named, and few of them.
    """
    met = [run for run in runs if run.failure is None and run.error <= largest and run.foretold <= tolerance]
    shortest = min((run.wall_s for run in met), default=0.0)
    equal = [run for run in met if run.wall_s <= _AS_CHEAP * shortest]
    return min(equal, key=_plainness, default=None)


def _plainness(run: CostPoint) -> tuple[bool, int, float]:
    effects = run.setting.effects
    return effects == "auto", effects.count("+") + effects.count("-"), run.wall_s


def recommendation(study: CostStudy) -> str:
    """One sentence: the cheapest setting that meets the tolerance, or that none does."""
    where = f"{study.tolerance:.3g} m ({study.norm} over time, at {', '.join(study.points)})"
    if study.chosen is None:
        best = min((r for r in study.runs if r.failure is None), key=lambda r: r.error, default=None)
        if study.reference.error >= study.tolerance:
            unsure = f"the reference itself is known to {study.reference.error:.2g} m only"
            return f"no setting can be judged within {where}: {unsure}; raise the budget (--budget)"
        if best is None:
            return f"no setting ran; none can be recommended for {where}"
        found = f"the best was {best.setting.name}, {best.setting.knob} = {best.setting.value:.3g}"
        warned = f", and its run warns of {best.foretold:.2g} m" if best.foretold > study.tolerance else ""
        return f"no setting meets {where}: {found}, off by {best.error:.2g} m{warned}"
    s = study.chosen.setting
    return (
        f"the cheapest setting within {where} is {s.name}, {s.knob} = {s.value:.3g}: "
        f"off by {study.chosen.error:.2g} m in {study.chosen.wall_s:.3g} s"
    )


def cost_summary(study: CostStudy) -> dict[str, Any]:
    """The JSON of ``erls study cost``."""
    front = set(map(id, study.front))
    return {
        "study": "cost",
        "scene": study.scene,
        "points": list(study.points),
        "norm": study.norm,
        "tolerance": study.tolerance,
        "reference": {
            "made_by": study.reference.made_by,
            "error": study.reference.error,
            "linear_links": study.reference.linear,
            "warnings": list(study.reference.warnings),
        },
        "complete": study.complete,
        "recommendation": recommendation(study),
        "chosen": None if study.chosen is None else _point_summary(study.chosen, True),
        "runs": [_point_summary(run, id(run) in front) for run in study.runs],
    }


def _point_summary(run: CostPoint, on_front: bool) -> dict[str, Any]:
    s = run.setting
    return {
        "formulation": s.formulation,
        "integrator": s.integrator,
        "effects": s.effects,
        "elastic_modes": s.modes,
        s.knob: s.value,
        "wall_s": run.wall_s,
        "error": run.error,
        "steps": run.steps,
        "rhs_calls": run.rhs_calls,
        "factorizations": run.factorizations,
        "runs": run.runs,
        "warned_error": run.foretold,
        "on_front": on_front,
        "failure": None if run.failure is None else run.failure.as_dict(),
    }
