"""Accelerations and multipliers under the conditions of the loops; the formulas are those of `erls.equations.loops`."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops import layout as at
from erls.maths.dense import backward, cholesky, dot, forward
from erls.maths.jit import part

SINGULAR = 1e-13  # of a condition's flexibility, once those before it hold: nothing is left of sixteen digits


@part
def spread_rows(integers: IntArray, scratch: Array, n: int) -> int:
    """Of MASS its FACTOR U, SPREAD = (U⁻ᵀ Φ_yᵀ)ᵀ and the factor of what the conditions give way; status.

    0; k > 0 when coordinate k - 1 has no mass, -1 when the loops lock.
    """
    r = at.place(integers, at.KEPT)
    mass = scratch[at.span(integers, at.MASS, n * n)].reshape(n, n)
    factor = scratch[at.span(integers, at.FACTOR, n * n)].reshape(n, n)
    spread = scratch[at.span(integers, at.SPREAD, r * n)].reshape(r, n)
    flexible = scratch[at.span(integers, at.FLEXIBLE, r * r)].reshape(r, r)
    gradient = scratch[at.span(integers, at.GRADIENT, r * n)].reshape(r, n)
    for i in range(n):
        for j in range(n):
            factor[i, j] = mass[i, j]
    status = cholesky(factor, 0.0)
    if status != 0:
        return status
    for i in range(r):
        for j in range(n):
            spread[i, j] = gradient[i, j]
        forward(factor, spread[i])
        for j in range(i + 1):
            flexible[j, i] = dot(spread[i], spread[j])
    return 0 if cholesky(flexible, SINGULAR) == 0 else -1


@part
def multipliers_of(reals: Array, integers: IntArray, scratch: Array, reduced: Array, out: Array) -> None:
    """λ of the conditions in use, from z = U⁻ᵀ f."""
    n = len(reduced)
    r, m = at.place(integers, at.KEPT), at.place(integers, at.CONDITIONS)
    spread = scratch[at.span(integers, at.SPREAD, r * n)].reshape(r, n)
    flexible = scratch[at.span(integers, at.FLEXIBLE, r * r)].reshape(r, r)
    decay = reals[at.place(integers, at.NUMBERS) + at.DECAY]
    place = at.place(integers, at.VIOLATION)
    for condition in range(m):
        k = at.place_of(integers, condition)
        if k >= 0:
            wanted = scratch[place + 2 * m + condition] + 2 * decay * scratch[place + m + condition]
            wanted += decay * decay * scratch[place + condition]
            out[k] = dot(spread[k], reduced) + wanted
    forward(flexible, out)
    backward(flexible, out)


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
