"""Small dense factorizations in place and without allocation: LU with row exchanges, and Cholesky.

Matrices are (n, n) in C order. A status of 0 means done; k > 0 that elimination broke down at unknown k - 1.
"""

from __future__ import annotations

from erls.kernels.contract import Array, IntArray
from erls.kernels.jit import helper


@helper
def lu_factor(a: Array, pivots: IntArray) -> int:
    """Replace ``a`` by its factors L (unit diagonal) and U; ``pivots`` (n,) holds the row exchanged with each row."""
    n = a.shape[0]
    for k in range(n):
        row, largest = k, abs(a[k, k])
        for i in range(k + 1, n):
            if abs(a[i, k]) > largest:
                row, largest = i, abs(a[i, k])
        pivots[k] = row
        if not largest > 0.0:  # NaN too
            return k + 1
        if row != k:
            for j in range(n):
                a[k, j], a[row, j] = a[row, j], a[k, j]
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            a[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
    return 0


@helper
def lu_solve(a: Array, pivots: IntArray, b: Array) -> None:
    """Replace ``b`` (n,) by the solution, with the factors of `lu_factor`."""
    n = a.shape[0]
    for k in range(n):
        row = pivots[k]
        if row != k:
            b[k], b[row] = b[row], b[k]
    for i in range(n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i, j] * b[j]
        b[i] = total / a[i, i]


@helper
def cholesky_factor(a: Array) -> int:
    """Replace the lower triangle of a symmetric ``a`` by its Cholesky factor; the upper one is neither read nor set."""
    n = a.shape[0]
    for j in range(n):
        for i in range(j, n):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i > j:
                a[i, j] = total / a[j, j]
            elif total > 0.0:
                a[j, j] = total**0.5
            else:
                return j + 1
    return 0


@helper
def cholesky_solve(a: Array, b: Array) -> None:
    """Replace ``b`` (n,) by the solution, with the factor of `cholesky_factor`."""
    lower_solve(a, b)
    upper_solve(a, b)


@helper
def lower_solve(a: Array, b: Array) -> None:
    """Replace ``b`` by L⁻¹ b."""
    for i in range(a.shape[0]):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total / a[i, i]


@helper
def upper_solve(a: Array, b: Array) -> None:
    """Replace ``b`` by L⁻ᵀ b; rows of L are read along, not down."""
    for i in range(a.shape[0] - 1, -1, -1):
        value = b[i] / a[i, i]
        b[i] = value
        for j in range(i):
            b[j] -= a[i, j] * value
