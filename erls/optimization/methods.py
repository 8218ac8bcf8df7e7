"""The methods: derivatives of the motion, and equivalent static loads of the mechanism or of its links."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.maths.so3 import Array
from erls.optimization import equivalent_loads
from erls.optimization.aggregates import Aggregates
from erls.optimization.convex import Found, relative_change, sequential_convex
from erls.optimization.dynamics import Dynamics
from erls.optimization.equivalent_loads import FrozenLoads
from erls.optimization.evaluation import Evaluation, Rules
from erls.optimization.optimality import Optimality, optimality
from erls.optimization.result import BUDGET, CONVERGED, INFEASIBLE, INTERRUPTED, STALLED, Analysis, Outcome
from erls.optimization.scipy_methods import scipy_method

Optimizer = Callable[..., Found]
OPTIMIZERS: dict[str, Optimizer] = {
    "scp": sequential_convex,
    "slsqp": scipy_method("slsqp"),
    "trust-constr": scipy_method("trust-constr"),
}
_INNER = 200  # static analyses of one set of loads
_FAR, _LOADED = 2.0, 8  # of a limit: starts beyond go on by loads first; so many runs at most
_WORSE, _DAMPED = 0.9, 0.5  # designs that go to and fro: less than this nearer, and what is left of a step then

Told = Callable[[str, int, Analysis], None]


@dataclass
class Way:
    """What a method has done so far.

    Attributes
    ----------
    history : list of Analysis
    inner : int
    status : str
    last : Evaluation or None
        Differentiated, where a method ended.
    x : (v,) array or None
        Where it ended, unless at the last analysis.
    rules : Rules or None
        Of what it evaluated, unless those of the runs.
    excess : tuple of float
        Of each constraint, by how much a smooth value was above the largest row, in shares of the limit.
    """

    history: list[Analysis]
    inner: int = 0
    status: str = INTERRUPTED
    last: Evaluation | None = None
    x: Array | None = None
    rules: Rules | None = None
    excess: tuple[float, ...] = ()


def _nearer(dynamics: Dynamics, x: Array, way: Way, told: Callable[[Analysis], None]) -> Array:
    """A start that is far beyond its limits, brought nearer by equivalent static loads where these apply.

    Soft designs vibrate so much that derivatives of their motion tell little of designs further on. What comes of it is
    the analysed design that is beyond its limits the least: a proposal that cannot run ends the search, not the method.
    """
    try:
        equivalent_loads.refuse(dynamics, "esl-system")
    except SceneError:
        return x
    settings, span, change = dynamics.problem.record.settings, dynamics.rules.upper - dynamics.rules.lower, np.inf
    best, least = x, np.inf
    for _ in range(min(_LOADED, settings.most_analyses - 1)):
        try:
            found, motion = dynamics.analysed(x)
        except SimulationError as problem:
            if problem.cause == Cause.INTERRUPTED or least == np.inf:
                raise
            break
        if found.violation < least:
            best, least = x, found.violation
        if found.violation <= _FAR:
            break
        way.history.append(Analysis(x, found.objective, found.violation, change))
        told(way.history[-1])
        loads = FrozenLoads(dynamics, x, motion, True)
        inner = OPTIMIZERS[settings.optimizer](loads, x, settings, _INNER)
        way.inner += loads.evaluations
        way.history[-1] = replace(way.history[-1], inner=loads.evaluations)
        change, x = relative_change(x, inner.next, span), inner.next
    return best


def integrated(dynamics: Dynamics, x: Array, way: Way, told: Callable[[Analysis], None]) -> None:
    """The optimizer sees runs and their derivatives."""
    settings = dynamics.problem.record.settings

    def tell(found: Evaluation, change: float) -> None:
        way.history.append(Analysis(found.x, found.objective, found.violation, change))
        told(way.history[-1])

    seen = Aggregates(dynamics) if settings.derivatives == "aggregates" else dynamics
    x = _nearer(dynamics, x, way, told)
    found = OPTIMIZERS[settings.optimizer](seen, x, settings, settings.most_analyses - len(way.history), tell)
    way.status, way.last, way.x, way.rules = found.status, found.best, found.best.x, seen.rules
    if isinstance(seen, Aggregates):
        way.excess = tuple(seen.excess(found.best.x))


def equivalent(
    whole: bool,
) -> Callable[[Dynamics, Array, Way, Callable[[Analysis], None]], None]:
    """Runs give loads, under which the optimizer finds the next design."""

    def method(dynamics: Dynamics, x: Array, way: Way, told: Callable[[Analysis], None]) -> None:
        equivalent_loads.refuse(dynamics, "esl-system" if whole else "esl-component")
        settings, span = dynamics.problem.record.settings, dynamics.rules.upper - dynamics.rules.lower
        before = change = np.inf
        while True:
            found, motion = dynamics.analysed(x)
            way.history.append(Analysis(x, found.objective, found.violation, change))
            told(way.history[-1])
            loads = FrozenLoads(dynamics, x, motion, whole)
            inner = OPTIMIZERS[settings.optimizer](loads, x, settings, _INNER)
            way.inner += loads.evaluations
            way.history[-1] = replace(way.history[-1], inner=loads.evaluations)
            before, change = change, relative_change(x, inner.next, span)
            way.last, way.x = inner.best, inner.next
            held = found.violation <= settings.violation_tolerance
            if change <= settings.design_tolerance and (held or inner.status != CONVERGED):
                way.status = CONVERGED if held and inner.status == CONVERGED else inner.status
                return
            if len(way.history) >= settings.most_analyses:
                way.status, way.x = BUDGET, None
                return
            damped = len(way.history) > 3 and change > _WORSE * before
            x = x + (_DAMPED if damped else 1.0) * (inner.next - x)

    return method


METHODS = {
    "integrated": integrated,
    "esl-system": equivalent(True),
    "esl-component": equivalent(False),
}


def outcome(method: str, dynamics: Dynamics, x: Array, told: Told) -> Outcome:
    """What a method finds from a design on; interrupted, the best so far.

    Raises
    ------
    SceneError, SimulationError
        The method cannot treat the problem; a run failed.
    """
    dynamics.fresh()
    begun, way = time.perf_counter(), Way([])
    try:
        METHODS[method](dynamics, x, way, lambda analysis: told(method, len(way.history), analysis))
    except KeyboardInterrupt:
        way.status, way.x = INTERRUPTED, None
    finally:
        dynamics.keep()
    return _outcome(method, dynamics, x, way, time.perf_counter() - begun)


def _outcome(method: str, dynamics: Dynamics, start: Array, way: Way, wall_s: float) -> Outcome:
    rules, names = way.rules or dynamics.rules, dynamics.problem.names
    tolerance = dynamics.problem.record.settings.violation_tolerance
    best = min(way.history, key=lambda a: (max(0.0, a.violation - tolerance), a.objective), default=None)
    x = start if best is None else best.x
    if way.x is not None and way.status in (CONVERGED, INFEASIBLE, STALLED):
        x = way.x
    known = Optimality((), float("nan"))
    if way.last is not None and way.last.quadratic is not None and way.status != INTERRUPTED:
        known = optimality(rules, names, way.last)
    shares = [] if way.last is None else rules.shares(way.last.components)
    worst = max(range(len(shares)), key=lambda k: shares[k].max(initial=0.0), default=-1)
    weighed = rules.objective.weighed(x)
    last = next((a for a in way.history if np.array_equal(a.x, x)), None)
    objective = weighed if last is None else last.objective
    if last is None and way.last is not None:
        objective = weighed + rules.objective.timed(way.last.components, rules.measures)[0]
    violation = last.violation if last is not None else way.history[-1].violation if way.history else float("nan")
    return Outcome(
        method,
        way.status,
        x,
        objective,
        rules.objective.mass(x),
        violation,
        tuple(way.history),
        way.inner,
        known.active,
        known.residual,
        dynamics.gradient if method == "integrated" else "static",
        wall_s,
        dynamics.run_s,
        dynamics.gradient_s,
        worst=rules.names[worst] if worst >= 0 else "",
        excess=dict(zip(rules.names, way.excess, strict=False)),
        peaks={name: float(own.max()) for name, own in zip(rules.names, shares, strict=False) if len(own)},
    )
