"""Runs of one setting with finer and finer steps or tolerances: what each took and how far it was off."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from erls.errors import Cause, SimulationError
from erls.scene.read import load_chain
from erls.simulation.simulate import simulate
from erls.studies.doubts import foretold_error
from erls.studies.effect_sets import as_field
from erls.studies.explicit import is_explicit, too_stiff
from erls.studies.reference import Reference, sampled
from fe_import.errors import ReportedError

Norm = Literal["max", "rms"]
_UNNAMED = 1 / 40  # of what others may take


@dataclass(frozen=True)
class Setting:
    """One way to run the scene.

    Attributes
    ----------
    formulation, integrator : str
    effects : str
        As `erls.studies.effect_sets` writes them.
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
        Median over ``runs`` of the integration, with what choosing effects and certifying takes; nan when it failed.
    error : float
        In the norm of the study [m]; nan when it failed.
    steps, rhs_calls, factorizations : int
    runs : int
    failure : ReportedError or None
        Failed runs stay in the report with their cause.
    foretold : float
        Error that the run warns of itself [m]: see `erls.studies.doubts`.
    """

    setting: Setting
    wall_s: float
    error: float
    steps: int
    rhs_calls: int
    factorizations: int
    runs: int
    failure: ReportedError | None = None
    foretold: float = 0.0


@dataclass(frozen=True)
class Ladder:
    """Task of one worker process.

    Explicit methods that nobody has asked for by name (``named``) may take less than others, and are not tried where
    stability limits their steps by much.
    """

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
    named: bool = False


def overrides_of(setting: Setting, fields: Sequence[str]) -> tuple[str, ...]:
    """``KEY=VALUE`` of a setting; ``fields`` take the number of modes."""
    result = [
        f"simulation.formulation={setting.formulation}",
        f"simulation.integrator={setting.integrator}",
        f"simulation.effects={as_field(setting.effects)}",
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
        point = _measured(task, setting, min(task.slowest, left), not found)
        found.append(point)
        good = point.failure is None and point.error <= max(task.reference.error, 0.03 * task.tolerance)
        refused = point.failure is not None and point.failure.exit_code == 2  # too slow, or not possible at all
        if good or refused or _stalled(found) or _ran_away(found):
            break
    return found


def _stalled(found: list[CostPoint]) -> bool:
    """Whether the last two refinements changed the error by less than a tenth: the model is the limit then."""
    errors = [point.error for point in found[-3:] if point.failure is None]
    return len(errors) == 3 and max(errors) - min(errors) < 0.1 * errors[-1]


def _ran_away(found: list[CostPoint]) -> bool:
    """Whether two in a row deflected beyond any meaning: the model is the cause then, not the step."""
    failures = [point.failure for point in found[-2:]]
    return len(failures) == 2 and all(one is not None and one.cause == Cause.RUNAWAY for one in failures)


def _measured(task: Ladder, setting: Setting, longest: float, first: bool) -> CostPoint:
    """Runs of one setting: one, and two more where they are short; one before that does not count where it may load or
    compile something on its way, the first of a ladder or one that chooses its effects, unless it takes long.
    """
    warms = first or setting.effects == "auto"
    begun: float | None = None

    def watch(t: float, duration: float) -> None:
        nonlocal begun
        begun = begun or time.perf_counter()  # what is compiled and decided before the first step does not count
        if time.perf_counter() - begun > longest:
            raise _TooSlow

    walls: list[float] = []
    try:
        scene = load_chain(task.path, (*task.overrides, *overrides_of(setting, task.fields)))
        if first and not task.named and (stiff := too_stiff(scene)) is not None:
            return failed(setting, stiff)
        if is_explicit(setting.integrator) and not task.named:
            longest = min(longest, _UNNAMED * task.slowest)
        wanted = 1
        while len(walls) < wanted and (not walls or time.monotonic() < task.until):
            begun = None
            run = simulate(scene, progress=watch, verdict=False)
            walls.append(run.wall_s + (0.0 if run.certificate is None else run.certificate.wall_s))
            wanted = warms + 3 if run.wall_s < 1.0 else warms + 1 if run.wall_s < longest / 4 else 1
    except _TooSlow:
        if (stiff := too_stiff(scene)) is not None:
            return failed(setting, stiff)
        spent = task.until <= time.monotonic()
        why = "the budget of the study was used up" if spent else "too slow for this study"
        return failed(setting, _over_budget(f"stopped after {longest:.1f} s: {why}"))
    except ReportedError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return failed(setting, problem)
    distance = np.linalg.norm(
        sampled(run, task.points, task.reference.times) - task.reference.positions, axis=2
    )
    error = float(distance.max() if task.norm == "max" else np.sqrt((distance**2).mean(axis=0)).max())
    work = run.solution.work
    counted = walls[1:] if warms and len(walls) > 1 else walls
    foretold = foretold_error(run, task.reference.linear)
    counts = (work.steps, work.rhs_calls, work.factorizations, len(counted))
    return CostPoint(setting, float(np.median(counted)), error, *counts, foretold=foretold)


def _over_budget(message: str) -> SimulationError:
    remedy = "raise the budget (--budget), or leave such settings out"
    return SimulationError(Cause.BUDGET, message, remedy=remedy)


def failed(setting: Setting, problem: ReportedError) -> CostPoint:
    """Point of a setting that gave no motion, with its cause."""
    return CostPoint(setting, np.nan, np.nan, 0, 0, 0, 0, problem)
