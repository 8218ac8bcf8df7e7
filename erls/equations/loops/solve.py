"""Accelerations and multipliers under the conditions of the loops; the formulas are those of `erls.equations.loops`."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.loops.records import LoopRoom, Loops
from erls.maths.dense import backward, cholesky, dot, forward
from erls.maths.jit import part
from erls.maths.products import copy_matrix

SINGULAR = 1e-13  # of a condition's flexibility, once those before it hold: nothing is left of sixteen digits


@part
def spread_rows(mass: Array, factor: Array, gradient: Array, spread: Array, flexible: Array) -> int:
    """Of M its factor U, Zᵀ = (U⁻ᵀ Φ_yᵀ)ᵀ and the factor of what the conditions give way; status.

    0; k > 0 when coordinate k - 1 has no mass, -1 when the loops lock.
    """
    copy_matrix(mass, factor)
    status = cholesky(factor, 0.0)
    if status != 0:
        return int(status)
    copy_matrix(gradient, spread)
    for i in range(len(spread)):
        forward(factor, spread[i])
        for j in range(i + 1):
            flexible[j, i] = dot(spread[i], spread[j])
    return 0 if cholesky(flexible, SINGULAR) == 0 else -1


@part
def multipliers_of(loops: Loops, room: LoopRoom, reduced: Array, out: Array) -> None:
    """λ of the conditions in use, from z = U⁻ᵀ f."""
    for condition in range(loops.conditions):
        k = loops.used[condition]
        if k >= 0:
            wanted = room.bias[condition] + 2 * loops.decay * room.rate[condition]
            wanted += loops.decay * loops.decay * room.violation[condition]
            out[k] = dot(room.spread[k], reduced) + wanted
    forward(room.flexible, out)
    backward(room.flexible, out)


@part
def let_along(moves: Array, loads: Array, gradient: Array, decay: float, out: Array, carried: Array) -> None:
    """out - loadsᵀ (moves · out) + decay · gradientᵀ · loads; ``carried`` (r, n) is memory."""
    r, n = carried.shape
    for i in range(r):
        line = carried[i]
        for j in range(n):
            line[j] = 0.0
        for k in range(n):
            weight, row = moves[i, k], out[k]
            for j in range(n):
                line[j] += weight * row[j]
    for i in range(r):
        line = carried[i]
        for k in range(n):
            weight, pull, row = loads[i, k], decay * gradient[i, k], out[k]
            for j in range(n):
                row[j] += pull * loads[i, j] - weight * line[j]
