"""How nearly a design is optimal: multipliers of what holds it, and what of the objective's slope they leave (KKT)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from erls.maths.so3 import Array
from erls.optimize.approximation import Approximation
from erls.optimize.evaluation import Evaluation, Rules
from fe_import.model import IntArray

_ACTIVE = 2e-3  # of the limit: rows that hold a design; more, and neighbours in time share one's multiplier
_BOUND = 1e-6  # of the distance of the bounds
_LEAST = 1e-9  # of the objective: multipliers that are rounding


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
    near, ones = Approximation(rules, found), np.ones(len(found.x))
    _, slope = near.objective(ones)
    rate = near.powers.rate(ones)
    columns: list[Array] = []
    held: list[tuple[str, int, float, float]] = []
    for k, shares in enumerate(rules.shares(found.components)):
        if not len(shares):
            continue
        rows: IntArray = np.flatnonzero(shares >= 1 - _ACTIVE)
        if rules.aggregated[k]:
            rows = np.arange(len(shares))
        values, slopes = near.rows(ones, k, rows) if len(rows) else (np.zeros(0), np.zeros((0, len(ones))))
        for n, (share, column) in enumerate(zip(values.tolist(), slopes, strict=True)):
            if share >= 1 - _ACTIVE:
                columns.append(column)
                held.append((rules.names[k], int(shares.argmax()) if rules.aggregated[k] else int(rows[n]), share, 1.0))
    span = rules.upper - rules.lower
    for v in range(len(ones)):
        for sign, row, bound in ((-1.0, -1, rules.lower[v]), (1.0, -2, rules.upper[v])):
            if abs(found.x[v] - bound) <= _BOUND * span[v]:
                columns.append(sign * rate * np.eye(len(ones))[v])
                held.append((names[v], row, 1.0, 1.0))
    size = float(np.linalg.norm(slope)) or 1.0
    if not columns:
        return Optimality((), float(np.linalg.norm(slope)) / size)
    scales = np.array([float(np.linalg.norm(c)) or 1.0 for c in columns])
    multipliers, left = nnls(np.stack(columns, axis=1) / scales, -slope)
    multipliers = multipliers / scales
    active = tuple(
        Active(name, row, share, float(m))
        for (name, row, share, _), m, scale in zip(held, multipliers, scales, strict=True)
        if m * scale > _LEAST * size
    )
    return Optimality(active, float(left) / size)
