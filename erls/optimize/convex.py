"""Sequential convex programming: approximate about a design, solve, look at what comes out, go on or come back.

A step that makes the merit, objective and violation together, worse is taken back, and the next goes less far; one that
is as good as predicted lets the next go farther. (C. Fleury, Int. J. Numer. Methods Eng. 28 (1989) 409–428; K. Svanberg,
ibid. 24 (1987) 359–373, approximate in reciprocal variables; here the powers say in which.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array
from erls.optimize.approximation import Approximation
from erls.optimize.evaluation import Evaluation, Evaluator
from erls.optimize.records import Settings

_PENALTY = 10.0  # of a violation, in objectives of the start
_SHORTER, _LONGER, _SMALLEST = 0.35, 1.5, 1e-6
_PASSED = 1e-9


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
    scale, count, move, change = max(abs(current.objective), 1e-300), 1, settings.move_limit, np.inf

    def merit(found: Evaluation) -> float:
        return found.objective / scale + _PENALTY * max(0.0, found.violation)

    while True:
        current = evaluator.differentiate(current) if current.quadratic is None else current
        near = Approximation(rules, current)
        while True:
            reach = move * np.maximum(np.abs(current.x), 1e-3 * span)
            step = near.solved(np.maximum(rules.lower, current.x - reach), np.minimum(rules.upper, current.x + reach))
            change = relative_change(current.x, step.x, span)
            free = bool((np.abs(step.x - current.x) < 0.99 * reach).all())  # not held back by the move limit
            held = current.violation <= settings.violation_tolerance
            if free and change <= settings.design_tolerance and (held or step.slack):
                status = "converged" if held else "infeasible"
                return Found(current, step.x, status, change, count)
            if count >= most:
                return Found(current, step.x, "budget", change, count)
            trial = evaluator.evaluate(step.x)
            count += 1
            told(trial, change)
            if merit(trial) <= merit(current) + _PASSED:
                move = min(settings.move_limit, move * _LONGER)
                break
            move = _SHORTER * min(move, change)
            if move < _SMALLEST:
                return Found(current, current.x, "stalled", change, count)
        current = trial
