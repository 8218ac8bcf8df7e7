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
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.integrators import INTEGRATORS
from erls.scene import Scene, load_scene
from erls.studies.ladder import CostPoint, Ladder, Norm, Setting, climb, failed, overrides_of
from erls.studies.mode_overrides import available_modes, count_field
from erls.studies.pool import Finished, run_all
from erls.studies.reference import REFERENCES, Reference, default_reference, make_reference
from fe_import.toml_file import choose

_SCIPY = ("rk45", "dop853", "radau", "bdf", "lsoda")
_RELATIVE = tuple(10.0**-k for k in range(3, 11))
_STEP_SHARES = tuple(2.0**-k for k in range(-3, 6))  # of the scene's own step
_TOLERANCE_SHARES = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03)  # of the tolerance asked for
STIFFENED = "all,geometric_stiffening,foreshortening"


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
    kind = reference or default_reference(loaded)
    choose(kind, ("nodal", "tight"), "reference", SceneError)
    beams = default_reference(loaded) == "nodal"
    rungs = ladders(loaded, grid or Grid(), tolerance, min(modes.values(), default=0), beams)
    total = len(REFERENCES[kind][1]) + len(rungs)
    truth = make_reference(path, loaded, tuple(overrides), kind, chosen, workers, lambda done, _: progress(done, total))
    fields = tuple(count_field(loaded, name) for name in modes)
    tasks = [
        Ladder(
            str(path), tuple(overrides), fields, ladder, chosen, norm, truth, tolerance, budget / 10, begun + budget
        )
        for ladder in rungs
    ]
    before = total - len(rungs)
    advance = partial(_advanced, progress, before, total)
    # what is compiled comes first: the budget may not last for the others
    finished, complete = run_all(climb, tasks, advance, workers, longest_last=False)
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


def ladders(scene: Scene, grid: Grid, tolerance: float, most: int, beams: bool) -> list[tuple[Setting, ...]]:
    """All combinations of the grid, each from coarse to fine; for beams second-order displacements with all modes."""
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
    models = [(effects, count) for effects in grid.effects or ("all", "auto") for count in counts]
    if beams and most and not grid.effects:
        models.append((STIFFENED, counts[0]))
    return [
        tuple(Setting(formulation, integrator, effects, count, *rung) for rung in _rungs(scene, integrator, tolerance))
        for formulation in grid.formulations or ("erls", "ffr")
        for effects, count in models
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


def _runs(one: Finished, task: Ladder) -> list[CostPoint]:
    return one.result if one.error is None else [failed(task.rungs[0], one.error)]


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
