"""What an optimization gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from erls.maths.so3 import Array
from erls.optimization.optimality import Active
from erls.optimization.pictures import Drawn
from erls.optimization.problem import Problem

CONVERGED, INFEASIBLE, STALLED, BUDGET, INTERRUPTED = "converged", "infeasible", "stalled", "budget", "interrupted"
REASONS = {
    CONVERGED: "designs and constraints stay within their tolerances",
    INFEASIBLE: "no design within the bounds holds all constraints",
    STALLED: "steps no longer make the design better, and it is not optimal",
    BUDGET: "all analyses were used up",
    INTERRUPTED: "interrupted",
}
"""Statuses, and what they say."""

_NEAR = 0.99  # of a limit: below, a constraint holds nothing


@dataclass(frozen=True)
class Analysis:
    """A run of the motion on the way.

    Attributes
    ----------
    x : (v,) array
    objective, violation : float
    change : float
        Largest relative change of a variable since the one before; infinite at the start.
    inner : int
        Static analyses after it.
    """

    x: Array
    objective: float
    violation: float
    change: float
    inner: int = 0


@dataclass(frozen=True)
class Confirmed:
    """A design simulated again: the largest value of every constraint over all steps of a run, and where.

    Attributes
    ----------
    formulation : str
        With what else is not that of the scene: fine elements, some of the steps.
    values : dict of str to float
        By constraint.
    times : dict of str to float
        [s]
    violation : float
        Largest share by which a limit is passed.
    failure : str
        Why there is nothing.
    instants : (k,) array
    curves : dict of str to (k,) array
        Largest value of each constraint at these times.
    shapes : tuple of Drawn
        What the links look like at some of these times; nothing where that was not asked for.
    """

    formulation: str
    values: dict[str, float] = field(default_factory=dict)
    times: dict[str, float] = field(default_factory=dict)
    violation: float = float("nan")
    failure: str = ""
    instants: Array = field(default_factory=lambda: np.zeros(0))
    curves: dict[str, Array] = field(default_factory=dict)
    shapes: tuple[Drawn, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """Of one method.

    Attributes
    ----------
    method, status : str
    x : (v,) array
        The best design.
    objective, mass : float
        Mass of all links [kg].
    violation : float
        At the samples of the constraints.
    history : tuple of Analysis
    inner_iterations : int
        Static analyses in all.
    active : tuple of Active
        What holds the design.
    residual : float
        Of the optimality conditions.
    gradient : str
        How derivatives were found.
    wall_s, run_s, gradient_s : float
        In all; for runs, and for derivatives.
    confirmed : tuple of Confirmed
        First as the scene says, then by others.
    further : tuple of (float, float, int, str)
        Objective, violation, analyses and status of further starts.
    worst : str
        The constraint that is passed farthest.
    peaks : dict of str to float
        Largest value of every constraint over its limit, at the samples of the last analysis.
    excess : dict of str to float
        Where smooth values were held in place of the largest: by how much they are above these, in shares of the limit.
    """

    method: str
    status: str
    x: Array
    objective: float
    mass: float
    violation: float
    history: tuple[Analysis, ...]
    inner_iterations: int
    active: tuple[Active, ...]
    residual: float
    gradient: str
    wall_s: float
    run_s: float
    gradient_s: float
    confirmed: tuple[Confirmed, ...] = ()
    further: tuple[tuple[float, float, int, str], ...] = ()
    worst: str = ""
    peaks: dict[str, float] = field(default_factory=dict)
    excess: dict[str, float] = field(default_factory=dict)

    @property
    def idle(self) -> list[str]:
        """Constraints that are nowhere near their limit."""
        return [name for name, share in self.peaks.items() if share < _NEAR]

    @property
    def analyses(self) -> int:
        """Runs of the motion, the confirmation excepted."""
        return len(self.history)


@dataclass(frozen=True)
class Tried:
    """A combination of options, by the names of the choices, and the best that came of it."""

    options: dict[str, str]
    best: Outcome


@dataclass(frozen=True)
class Optimization:
    """Of all methods.

    Attributes
    ----------
    problem : Problem
    start : Analysis
    outcomes : tuple of Outcome
    wall_s : float
    begun : Confirmed or None
        The start, simulated in full.
    tried : tuple of Tried
        Where there are choices, every combination.
    chosen : dict of str to str
        The best of these, whose outcomes these are.
    """

    problem: Problem
    start: Analysis
    outcomes: tuple[Outcome, ...]
    wall_s: float
    begun: Confirmed | None = None
    tried: tuple[Tried, ...] = ()
    chosen: dict[str, str] = field(default_factory=dict)

    @property
    def best(self) -> Outcome:
        """The lightest that holds all constraints, else the one that passes them least."""
        return min(self.outcomes, key=self._merit)

    @property
    def merit(self) -> tuple[float, float]:
        """By which the best of several is the least: what passes limits beyond tolerances, and the objective."""
        return self._merit(self.best)

    def _merit(self, outcome: Outcome) -> tuple[float, float]:
        tolerance = self.problem.record.settings.violation_tolerance
        return max(0.0, outcome.violation - tolerance), outcome.objective


def summary(found: Optimization) -> dict[str, Any]:
    """The JSON of ``erls optimize``."""
    record = found.problem.record
    return {
        "problem": found.problem.name,
        "scene": found.problem.scene.name,
        "start": {
            "objective": found.start.objective,
            "variables": _named(found.problem, found.start.x),
            "violation": found.start.violation,
        },
        "methods": {outcome.method: _outcome(found.problem, outcome) for outcome in found.outcomes},
        "published": {
            name: {
                "objective": p.objective,
                "variables": p.variables,
                "analyses": p.analyses,
                "inner_iterations": p.inner_iterations,
            }
            for name, p in record.published.items()
        },
        "choices": [
            {"options": one.options, "method": one.best.method, **_outcome(found.problem, one.best)}
            for one in found.tried
        ],
        "chosen": found.chosen,
        "wall_s": found.wall_s,
    }


def _named(problem: Problem, x: Array) -> dict[str, float]:
    return dict(zip(problem.names, x.tolist(), strict=True))


def _outcome(problem: Problem, o: Outcome) -> dict[str, Any]:
    return {
        "objective": o.objective,
        "mass": o.mass,
        "variables": _named(problem, o.x),
        "violation": o.violation,
        "violation_at_samples": max(o.peaks.values(), default=0.0) - 1,
        "analyses": o.analyses,
        "outer_iterations": o.analyses,
        "inner_iterations": o.inner_iterations,
        "wall_s": o.wall_s,
        "run_s": o.run_s,
        "gradient_s": o.gradient_s,
        "gradient": o.gradient,
        "status": o.status,
        "reason": REASONS[o.status],
        "kkt_residual": o.residual,
        "idle_constraints": o.idle,
        "aggregates_above_largest": o.excess,
        "active": [
            {"name": a.name, "row": a.row, "share": a.share, "multiplier": a.multiplier} for a in o.active
        ],
        "confirmed": [
            {
                "formulation": c.formulation,
                "largest": c.values,
                "times": c.times,
                "violation": c.violation,
                "failure": c.failure or None,
            }
            for c in o.confirmed
        ],
        "starts": [
            {"objective": f, "violation": v, "analyses": n, "status": s} for f, v, n, s in o.further
        ],
        "history": [
            {
                "variables": _named(problem, a.x),
                "objective": a.objective,
                "violation": a.violation,
                "change": a.change,
                "inner_iterations": a.inner,
            }
            for a in o.history
        ],
    }
