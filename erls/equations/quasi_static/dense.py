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


@part
def solve(a: Array, n: int, b: Array) -> int:
    """Replace b (n,) by the solution of a (n, n), row after row, which is lost; 1 + the number of a pivot that is 0."""
    for k in range(n):
        row, largest = k, abs(a[k * n + k])
        for i in range(k + 1, n):
            if abs(a[i * n + k]) > largest:
                row, largest = i, abs(a[i * n + k])
        if not largest > 0.0:
            return k + 1
        if row != k:
            for j in range(k, n):
                a[k * n + j], a[row * n + j] = a[row * n + j], a[k * n + j]
            b[k], b[row] = b[row], b[k]
        for i in range(k + 1, n):
            factor = a[i * n + k] / a[k * n + k]
            for j in range(k + 1, n):
                a[i * n + j] -= factor * a[k * n + j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k * n + j] * b[j]
        b[k] /= a[k * n + k]
    return 0
