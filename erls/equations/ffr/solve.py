"""Accelerations, by Cholesky factors of the mass matrix."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.balance import residual
from erls.equations.ffr.composite import mass_matrix
from erls.equations.serial.linear import dot
from erls.maths.jit import kernel, part

_SINGULAR = 1e-14  # inertia of a coordinate against what it was before the elimination of those before it


@part
def factor(a: Array, diagonal: Array) -> int:
    """Replace the upper part of a symmetric matrix by D (on the diagonal) and D Lᵀ of L D Lᵀ, and set ``diagonal``.

    Returns 0, or 1 + the number of the first coordinate without inertia of its own.
    """
    n = len(a)
    for k in range(n):
        diagonal[k] = a[k, k]
    for k in range(n):
        row = a[k]
        if not (row[k] > _SINGULAR * diagonal[k] and row[k] < 1e300):
            return k + 1
        inverse = 1.0 / row[k]
        for i in range(k + 1, n):
            weight, other = row[i] * inverse, a[i]
            for j in range(i, n):
                other[j] -= weight * row[j]
    return 0


@part
def back_solve(a: Array, b: Array) -> None:
    """Replace ``b`` (n,) by the solution, with what `factor` left."""
    n = len(b)
    for k in range(n):
        row, weight = a[k], b[k] / a[k, k]
        for j in range(k + 1, n):
            b[j] -= weight * row[j]
    for k in range(n - 1, -1, -1):
        b[k] = (b[k] - dot(a[k], b, k + 1, n)) / a[k, k]


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    n, start = len(out), integers[at.MATRIX]
    matrix = scratch[start : start + n * n].reshape(n, n)
    mass_matrix(reals, integers, scratch, t, y, matrix)
    residual(reals, integers, scratch, t, y, v, y[0:0], out)
    status = factor(matrix, scratch[start + n * n : start + n * n + n])
    if status == 0:
        for i in range(n):
            out[i] = -out[i]
        back_solve(matrix, out)
    return status
