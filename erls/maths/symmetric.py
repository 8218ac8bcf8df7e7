"""L D Lᵀ of symmetric matrices without pivoting, real or complex: for mass and iteration matrices."""

from __future__ import annotations

from erls.maths.jit import part
from erls.maths.so3 import Array

SINGULAR = 1e-14  # a pivot against the diagonal before elimination


@part
def factor_symmetric(a: Array, diagonal: Array, definite: bool) -> int:
    """Replace the upper part of ``a`` by D (on the diagonal) and D Lᵀ; ``diagonal`` (n,) is room.

    Returns 0, or 1 + the number of the first coordinate whose pivot is nothing against what it was before the
    elimination of those before it; or, where the matrix should be positive ``definite``, not positive.
    """
    n = len(a)
    for k in range(n):
        diagonal[k] = a[k, k]
    for k in range(n):
        row = a[k]
        pivot = row[k]
        if not (SINGULAR * abs(diagonal[k]) < abs(pivot) < 1e300 and (pivot.real > 0.0 or not definite)):
            return k + 1
        inverse = 1.0 / pivot
        for i in range(k + 1, n):
            weight, other = row[i] * inverse, a[i]
            for j in range(i, n):
                other[j] -= weight * row[j]
    return 0


@part
def solve_symmetric(a: Array, b: Array) -> None:
    """Replace ``b`` (n,) by the solution, with what `factor_symmetric` left."""
    n = len(b)
    for k in range(n):
        row, weight = a[k], b[k] / a[k, k]
        for j in range(k + 1, n):
            b[j] -= weight * row[j]
    for k in range(n - 1, -1, -1):
        row, total = a[k], b[k]
        for j in range(k + 1, n):
            total -= row[j] * b[j]
        b[k] = total / row[k]
