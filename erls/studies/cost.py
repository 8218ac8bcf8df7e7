"""What accuracy costs in time: one scene in many settings, error against time, and the cheapest that is good enough.

A *ladder* is a formulation with a number of modes, a set of effects and an integrator, run with finer and finer steps
or tolerances until it is as good as the reference, or too slow. The reference is the nodal formulation on two meshes
with two steps, or, where links are no beams, a tight run of all modes and effects beside a looser one; the distance of
the two says how far the reference itself can be trusted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.integrators import INTEGRATORS
from erls.lie.so3 import Array
from erls.run import Run
from erls.scene import Scene, load_scene
from erls.simulation import simulate
from erls.studies.mode_overrides import available_modes, count_field
from erls.studies.pool import Finished, run_all
from fe_import.errors import ReportedError
from fe_import.toml_file import choose

Norm = Literal["max", "rms"]
_SAMPLES = 400
_SCIPY = ("rk45", "dop853", "radau", "bdf", "lsoda")
_RELATIVE = tuple(10.0**-k for k in range(3, 11))
_STEP_SHARES = tuple(2.0**-k for k in range(-3, 6))  # of the scene's own step
_TOLERANCE_SHARES = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03)  # of the tolerance asked for


@dataclass(frozen=True)
class Setting:
    """One way to run the scene.

    Attributes
    ----------
    formulation, integrator, effects : str
    modes : int or None
        Elastic modes of every link; all of the model when None.
    knob : str
        The field that sets the accuracy: ``step``, ``rtol`` or ``tolerance``.
    value : float
    """

    formulation: str
    integrator: str
    effects: str
    modes: int | None
    knob: str
    value: float

    @property
    def name(self) -> str:
        """In words, without its accuracy."""
        modes = "all modes" if self.modes is None else f"{self.modes} modes"
        return f"{self.formulation}, {modes}, {self.integrator}, effects {self.effects}"


@dataclass(frozen=True)
class CostPoint:
    """One run: what it took and how far it was off.

    Attributes
    ----------
    setting : Setting
    wall_s : float
        Median over ``runs`` of the integration alone; nan when it failed.
    error : float
        In the norm of the study [m]; nan when it failed.
    steps, rhs_calls, factorizations : int
    runs : int
    failure : ReportedError or None
        Failed runs stay in the report with their cause.
    """

    setting: Setting
    wall_s: float
    error: float
    steps: int
    rhs_calls: int
    factorizations: int
    runs: int
    failure: ReportedError | None = None


@dataclass(frozen=True)
class Reference:
    """Positions (k, points, 3) at ``times`` (k,), how they were made, and their own error [m]."""

    times: Array
    positions: Array
    made_by: str
    error: float


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
        The cheapest that meets the tolerance.
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


@dataclass(frozen=True)
class Grid:
    """What the study varies; empty means a choice that suits the scene.

    Attributes
    ----------
    formulations, integrators, effects : tuple of str
    modes : tuple of int
        Elastic modes of every link; all there are, half and a quarter of them unless given.
    """

    formulations: tuple[str, ...] = ()
    integrators: tuple[str, ...] = ()
    effects: tuple[str, ...] = ()
    modes: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Ladder:
    """Task of one worker process."""

    path: str
    overrides: tuple[str, ...]
    fields: tuple[str, ...]
    rungs: tuple[Setting, ...]
    points: tuple[str, ...]
    norm: Norm
    reference: Reference
    tolerance: float
    slowest: float
    until: float


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
        ``nodal`` or ``tight``; nodal where every link is made of beams and nothing closes the chain unless given.
    overrides : sequence of str
        ``KEY=VALUE`` applied to the scene, for all runs.
    budget : float
        Wall time after which no further run starts [s]; what did not run is reported as such.
    progress : callable
        Called with (finished reference runs and ladders, all).
    workers : int, optional
        Processes; as many as cores unless given.

    Raises
    ------
    SceneError, FEImportError
        Bad input.
    SimulationError
        The reference failed.
    """
    path = scene.path if isinstance(scene, Scene) else Path(scene)
    loaded = load_scene(path, overrides)
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
    modes = available_modes(loaded)
    begun = time.monotonic()
    kind = reference or _default_reference(loaded)
    choose(kind, ("nodal", "tight"), "reference", SceneError)
    rungs = _ladders(loaded, grid or Grid(), tolerance, min(modes.values(), default=0))
    total = len(_REFERENCES[kind][1]) + len(rungs)
    truth = _reference(path, loaded, tuple(overrides), kind, chosen, workers, lambda done, _: progress(done, total))
    fields = tuple(count_field(loaded, name) for name in modes)
    tasks = [
        _Ladder(
            str(path), tuple(overrides), fields, ladder, chosen, norm, truth, tolerance, budget / 10, begun + budget
        )
        for ladder in rungs
    ]
    before = total - len(rungs)
    advance = partial(_advanced, progress, before, total)
    # what is compiled comes first: the budget may not last for the others
    finished, complete = run_all(_climb, tasks, advance, workers, longest_last=False)
    runs = tuple(run for one in finished for run in _runs(one, tasks[one.number]))
    front = pareto_front(runs)
    met = [run for run in runs if run.failure is None and run.error + truth.error <= tolerance]
    best = min(met, key=lambda run: run.wall_s, default=None)
    how = () if best is None else overrides_of(best.setting, fields)
    return CostStudy(loaded.name, chosen, norm, tolerance, truth, runs, front, best, how, complete)


def _advanced(progress: Callable[[float, float], None], before: int, total: int, done: float, _: float) -> None:
    progress(before + done, total)


def _check(value: float, name: str) -> None:
    if not 0 < value < np.inf:
        message, remedy = f"the {name} must be a positive number", "give metres" if name == "tolerance" else "seconds"
        raise SceneError(Cause.BAD_FIELD, message, where=name, value=value, remedy=remedy)


def _default_reference(scene: Scene) -> str:
    """The nodal formulation is the judge wherever it can run."""
    from fe_import.link import load_link

    beams = all(
        link.rigid is not None
        or (link.model and load_link(scene.folder / link.model).description.frame is not None)
        for link in scene.record.links
    )
    return "nodal" if beams and not scene.record.loops else "tight"


_REFERENCES: dict[str, tuple[str, tuple[tuple[str, ...], ...]]] = {
    "nodal": (
        "nodal formulation, 16 and 8 elements per member with steps in the same ratio, extrapolated",
        (
            ("simulation.formulation=nodal", "simulation.elements_per_member=16", "simulation.step=5e-4"),
            ("simulation.formulation=nodal", "simulation.elements_per_member=8", "simulation.step=1e-3"),
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


def _reference(
    path: Path,
    scene: Scene,
    overrides: tuple[str, ...],
    kind: str,
    points: tuple[str, ...],
    workers: int | None,
    progress: Callable[[float, float], None],
) -> Reference:
    made_by, variants = _REFERENCES[kind]
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
    return _sampled(simulate(load_scene(path, overrides)), points, times)


def _sampled(run: Run, points: Sequence[str], times: Array) -> Array:
    """(k, points, 3)"""
    return np.stack([run.position(name, times) for name in points], axis=1)


def _ladders(scene: Scene, grid: Grid, tolerance: float, most: int) -> list[tuple[Setting, ...]]:
    """All combinations of the grid, each from coarse to fine."""
    for integrator in grid.integrators:
        choose(integrator, INTEGRATORS, "integrators", SceneError)
    for formulation in grid.formulations:
        choose(formulation, ("erls", "ffr"), "formulations", SceneError)
    for count in grid.modes:
        if not 0 <= count <= most:
            message, remedy = "the modal models do not have this number of elastic modes", "give counts up to the limit"
            raise SceneError(Cause.BAD_FIELD, message, where="modes", value=count, limit=most, remedy=remedy)
    counts: tuple[int | None, ...] = grid.modes or tuple(dict.fromkeys((None, most // 2, most // 4)))
    if not most:
        counts = (None,)
    return [
        tuple(Setting(formulation, integrator, effects, count, *rung) for rung in _rungs(scene, integrator, tolerance))
        for formulation in grid.formulations or ("erls", "ffr")
        for effects in grid.effects or ("all", "auto")
        for count in counts
        for integrator in grid.integrators or _default_integrators(scene)
    ]


def _default_integrators(scene: Scene) -> tuple[str, ...]:
    own = [name for name in INTEGRATORS if name not in (*_SCIPY, "auto")]
    return (*own, "dop853")


def _rungs(scene: Scene, integrator: str, tolerance: float) -> list[tuple[str, float]]:
    settings = scene.record.simulation
    if integrator in _SCIPY:
        return [("rtol", value) for value in _RELATIVE]
    if integrator == "generalized_alpha":
        step = settings.step or min(settings.duration / 1000, 1e-3)
        return [("step", share * step) for share in _STEP_SHARES]
    return [("tolerance", share * tolerance) for share in _TOLERANCE_SHARES]


def overrides_of(setting: Setting, fields: Sequence[str]) -> tuple[str, ...]:
    """``KEY=VALUE`` of a setting; ``fields`` take the number of modes."""
    result = [
        f"simulation.formulation={setting.formulation}",
        f"simulation.integrator={setting.integrator}",
        f"simulation.effects={setting.effects}",
        f"simulation.{setting.knob}={setting.value:.6g}",
    ]
    if setting.knob == "rtol":
        result.append(f"simulation.atol={1e-2 * setting.value:.6g}")
    if setting.modes is not None:
        result += [f"{field}={setting.modes}" for field in fields]
    return tuple(result)


class _TooSlow(Exception):
    """Ends a run beyond its share of the budget."""


def _climb(task: _Ladder) -> list[CostPoint]:
    """The rungs of a ladder, until one is as good as the reference, gains nothing, or is too slow."""
    found: list[CostPoint] = []
    for setting in task.rungs:
        left = task.until - time.monotonic()
        if left <= 0:
            found.append(_failed(setting, _over_budget("not run: the budget of the study was used up")))
            break
        point = _measured(task, setting, min(task.slowest, left))
        found.append(point)
        good = point.failure is None and point.error <= max(task.reference.error, 0.03 * task.tolerance)
        slow = point.failure is not None and point.failure.cause == Cause.BUDGET
        if good or slow or _stalled(found):
            break
    return found


def _stalled(found: list[CostPoint]) -> bool:
    """Whether the last two refinements changed the error by less than a tenth: the model is the limit then."""
    errors = [point.error for point in found[-3:] if point.failure is None]
    return len(errors) == 3 and max(errors) - min(errors) < 0.1 * errors[-1]


def _measured(task: _Ladder, setting: Setting, longest: float) -> CostPoint:
    """Runs of one setting: one, and two more where they are short."""
    begun = time.perf_counter()

    def watch(t: float, duration: float) -> None:
        if time.perf_counter() - begun > longest:
            raise _TooSlow

    walls: list[float] = []
    run: Run | None = None
    try:
        scene = load_scene(task.path, (*task.overrides, *overrides_of(setting, task.fields)))
        while not walls or (len(walls) < 3 and walls[0] < 1.0):
            begun = time.perf_counter()
            run = simulate(scene, progress=watch)
            walls.append(run.wall_s)
    except _TooSlow:
        return _failed(setting, _over_budget(f"stopped after {longest:.0f} s: too slow for this study"))
    except ReportedError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return _failed(setting, problem)
    assert run is not None
    distance = np.linalg.norm(
        _sampled(run, task.points, task.reference.times) - task.reference.positions, axis=2
    )
    error = float(distance.max() if task.norm == "max" else np.sqrt((distance**2).mean(axis=0)).max())
    work = run.solution.work
    wall = float(np.median(walls))
    return CostPoint(setting, wall, error, work.steps, work.rhs_calls, work.factorizations, len(walls))


def _over_budget(message: str) -> SimulationError:
    remedy = "raise the budget (--budget), or leave such settings out"
    return SimulationError(Cause.BUDGET, message, remedy=remedy)


def _failed(setting: Setting, problem: ReportedError) -> CostPoint:
    return CostPoint(setting, np.nan, np.nan, 0, 0, 0, 0, problem)


def _runs(one: Finished, task: _Ladder) -> list[CostPoint]:
    return one.result if one.error is None else [_failed(task.rungs[0], one.error)]


def pareto_front(runs: Sequence[CostPoint]) -> tuple[CostPoint, ...]:
    """Runs that no other one beats in both error and time, from cheap to accurate."""
    front: list[CostPoint] = []
    for run in sorted((r for r in runs if r.failure is None), key=lambda r: (r.wall_s, r.error)):
        if not front or run.error < front[-1].error:
            front.append(run)
    return tuple(front)


def recommendation(study: CostStudy) -> str:
    """One sentence: the cheapest setting that meets the tolerance, or that none does."""
    where = f"{study.tolerance:.3g} m ({study.norm} over time, at {', '.join(study.points)})"
    if study.chosen is None:
        best = min((r for r in study.runs if r.failure is None), key=lambda r: r.error, default=None)
        if best is None:
            return f"no setting ran; none can be recommended for {where}"
        found = f"the best was {best.setting.name}, {best.setting.knob} = {best.setting.value:.3g}"
        return f"no setting meets {where}: {found}, off by {best.error:.2g} m"
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
        "reference": {"made_by": study.reference.made_by, "error": study.reference.error},
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
        "on_front": on_front,
        "failure": None if run.failure is None else run.failure.as_dict(),
    }
