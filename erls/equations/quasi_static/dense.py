"""Linear algebra of the reduction, on pieces of flat arrays."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.maths.jit import part


@part
def combine(matrix: Array, at: int, n: int, x: Array, out: Array) -> None:
    """out (n,) = a matrix (n, x), column after column from ``at``, times x."""
    out[:] = 0.0
    add_combined(matrix, at, n, x, out)


@part
def add_combined(matrix: Array, at: int, n: int, x: Array, out: Array) -> None:
    """Add the same to out."""
    for j in range(len(x)):
        column, weight = matrix[at + j * n : at + (j + 1) * n], x[j]
        for i in range(n):
            out[i] += weight * column[i]


@part
def project(matrix: Array, at: int, n: int, x: Array, out: Array) -> None:
    """out = the transpose of a matrix (n, out), column after column from ``at``, times x (n,)."""
    for j in range(len(out)):
        column, total = matrix[at + j * n : at + (j + 1) * n], 0.0
        for i in range(n):
            total += column[i] * x[i]
        out[j] = total
