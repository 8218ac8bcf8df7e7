"""Sequential convex programming: approximate about a design, solve, look at what comes out, go on or come back.

A step that makes the merit worse is taken back, and the next goes less far; after others the next may go farther, but
for variables that go to and fro, whose steps get shorter. Near the limits the merit is f + λ · violation, what the
objective would be on them, λ being the multipliers of the convex problem; beyond a band about them violations are
penalized, so that no step is lost to the curvature of constraints. (C. Fleury, Int. J. Numer. Methods Eng. 28 (1989)
409–428; K. Svanberg, ibid. 24 (1987) 359–373, approximate in reciprocal variables; here the powers say in which.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.optimization.approximation import Approximation
from erls.optimization.evaluation import Evaluation, Evaluator
from erls.optimization.records import Settings

_PENALTY = 10.0  # of a violation beyond the band, in objectives of the start
_BAND = 10.0  # of the tolerance of violations
_SHORTER, _LONGER, _SMALLEST = 0.35, 1.5, 1e-6
_TURNED = 0.5  # of a variable's last step, once it has turned back twice in a row
_IDLE = 1e-2  # of the tolerance of designs: smaller steps come to nothing
_NO_FARTHER = 1e-3  # of the variables: a run that fails so near to one that does not
_SAME = 1e-8  # of the objective of the start


@dataclass(frozen=True)
class Found:
    """What an optimizer ends with.

    Attributes
    ----------
    best : Evaluation
        Differentiated, where it converged.
    next : (v,) array
        The design to go to: not evaluated where the change is below the tolerance.
    status : str
        ``converged``, ``infeasible``, ``stalled`` or ``budget``.
    change : float
        Largest relative change of a variable in the last step.
    evaluations : int
    """

    best: Evaluation
    next: Array
    status: str
    change: float
    evaluations: int


def relative_change(x: Array, other: Array, span: Array) -> float:
    """Largest change of a variable over its size, or over the distance of its bounds where it is nearly zero."""
    return float((np.abs(other - x) / np.maximum(np.abs(x), 1e-3 * span)).max())


def sequential_convex(
    evaluator: Evaluator,
    x: Array,
    settings: Settings,
    most: int,
    told: Callable[[Evaluation, float], None] = lambda found, change: None,
) -> Found:
    """Minimize.

    Parameters
    ----------
    evaluator : Evaluator
    x : (v,) array
        Where to start.
    settings : Settings
    most : int
        Evaluations.
    told : callable
        Told every evaluation, and how far it went.
    """
    rules = evaluator.rules
    span = rules.upper - rules.lower
    current = evaluator.evaluate(x)
    told(current, np.inf)
    scale, count = max(abs(current.objective), 1e-300), 1

    band = _BAND * settings.violation_tolerance

    def merit(found: Evaluation, pressure: float) -> float:
        passed = pressure / scale * max(found.violation, -band) + _PENALTY * max(0.0, found.violation - band)
        return found.objective / scale + passed

    moves = np.full(len(x), settings.move_limit)
    earlier = before = np.zeros(len(x))
    near: Approximation | None = None
    while True:
        current = evaluator.differentiate(current) if current.quadratic is None else current
        near = Approximation(rules, current) if near is None else near.next(current)
        while True:
            reach = moves * np.maximum(np.abs(current.x), 1e-3 * span)
            step = near.solved(np.maximum(rules.lower, current.x - reach), np.minimum(rules.upper, current.x + reach))
            change = relative_change(current.x, step.x, span)
            held = current.violation <= settings.violation_tolerance
            if change <= settings.design_tolerance and (held or step.slack):
                free = bool((np.abs(step.x - current.x) < 0.99 * reach).all())  # not held back
                idle = free and (change <= _IDLE * settings.design_tolerance or bool(step.slack))
                if idle or near.held(np.ones(len(x)))[1] <= settings.optimality_tolerance:
                    return Found(current, step.x, "converged" if held else "infeasible", change, count)
            if count >= most:
                return Found(current, step.x, "budget", change, count)
            count += 1
            try:
                trial = evaluator.evaluate(step.x)
            except SimulationError as failure:
                if failure.cause is Cause.INTERRUPTED or moves.max() < _NO_FARTHER:
                    raise
                moves = _SHORTER * np.minimum(moves, change)  # designs that cannot move are none
                told(Evaluation(step.x, np.nan, (), np.inf), change)
                continue
            told(trial, change)
            if merit(trial, step.pressure) <= merit(current, step.pressure) + _SAME:
                break
            moves = _SHORTER * np.minimum(moves, change)
            if moves.max() < _SMALLEST:
                return Found(current, current.x, "stalled", change, count)
        size = np.maximum(np.abs(current.x), 1e-3 * span)
        gone = (trial.x - current.x) / size
        turned = (gone * before < 0) & (before * earlier < 0)
        moves = np.where(turned, np.maximum(_TURNED * np.abs(gone), settings.design_tolerance), moves * _LONGER)
        moves, earlier, before = np.minimum(moves, settings.move_limit), before, gone
        current = trial
