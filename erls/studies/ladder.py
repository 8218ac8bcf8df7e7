"""Runs of one setting with finer and finer steps or tolerances: what each took and how far it was off."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from erls.errors import Cause, SimulationError
from erls.run import Run
from erls.scene import load_scene
from erls.simulation import simulate
from erls.studies.reference import Reference, sampled
from fe_import.errors import ReportedError

Norm = Literal["max", "rms"]


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
class Ladder:
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


def climb(task: Ladder) -> list[CostPoint]:
    """The rungs of a ladder, until one is as good as the reference, gains nothing, or is too slow."""
    found: list[CostPoint] = []
    for setting in task.rungs:
        left = task.until - time.monotonic()
        if left <= 0:
            found.append(failed(setting, _over_budget("not run: the budget of the study was used up")))
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


def _measured(task: Ladder, setting: Setting, longest: float) -> CostPoint:
    """Runs of one setting: one, and two more where they are short."""
    begun: float | None = None

    def watch(t: float, duration: float) -> None:
        nonlocal begun
        begun = begun or time.perf_counter()  # what is compiled and decided before the first step does not count
        if time.perf_counter() - begun > longest:
            raise _TooSlow

    walls: list[float] = []
    run: Run | None = None
    try:
        scene = load_scene(task.path, (*task.overrides, *overrides_of(setting, task.fields)))
        while not walls or (len(walls) < 3 and walls[0] < 1.0):
            begun = None
            run = simulate(scene, progress=watch)
            walls.append(run.wall_s)
    except _TooSlow:
        why = "too slow for this study" if longest >= task.slowest else "the budget of the study was used up"
        return failed(setting, _over_budget(f"stopped after {longest:.1f} s: {why}"))
    except ReportedError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return failed(setting, problem)
    assert run is not None
    distance = np.linalg.norm(
        sampled(run, task.points, task.reference.times) - task.reference.positions, axis=2
    )
    error = float(distance.max() if task.norm == "max" else np.sqrt((distance**2).mean(axis=0)).max())
    work = run.solution.work
    wall = float(np.median(walls))
    return CostPoint(setting, wall, error, work.steps, work.rhs_calls, work.factorizations, len(walls))


def _over_budget(message: str) -> SimulationError:
    remedy = "raise the budget (--budget), or leave such settings out"
    return SimulationError(Cause.BUDGET, message, remedy=remedy)


def failed(setting: Setting, problem: ReportedError) -> CostPoint:
    """Point of a setting that gave no motion, with its cause."""
    return CostPoint(setting, np.nan, np.nan, 0, 0, 0, 0, problem)
