"""How nearly a design is optimal: multipliers of what holds it, and what of the objective's slope they leave (KKT)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.optimization.approximation import Approximation
from erls.optimization.evaluation import Evaluation, Rules


@dataclass(frozen=True)
class Active:
    """What holds a design.

    Attributes
    ----------
    name : str
        Of a constraint, or of a variable at a bound.
    row : int
        Of the constraint; -1 at the lower, -2 at the upper bound.
    share : float
        Value over its limit.
    multiplier : float
        By how much the objective falls per share by which the limit is relaxed; at a bound per unit of the variable.
    """

    name: str
    row: int
    share: float
    multiplier: float


@dataclass(frozen=True)
class Optimality:
    """Of a design; ``residual`` is what multipliers leave of the objective's slope, over that."""

    active: tuple[Active, ...]
    residual: float


def optimality(rules: Rules, names: tuple[str, ...], found: Evaluation) -> Optimality:
    """Of a differentiated design; ``names`` are those of the variables."""
    held, residual = Approximation(rules, found).held(np.ones(len(found.x)))
    active = [Active(rules.names[h.number] if h.row >= 0 else names[h.number], *h[1:]) for h in held]
    return Optimality(tuple(active), residual)
