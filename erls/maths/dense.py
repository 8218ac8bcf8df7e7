"""Small dense systems of equations in place and without allocation, real or complex, in loops that processors take
several numbers at once of.

A general matrix is stored transposed, row j of an array holding column j, so that factors and solutions walk along
rows. Of a symmetric one only the upper half is read and written. Pivots are chosen by the size of both parts, and
judged by the real part where the matrix is positive definite; transposes are plain, so that a complex matrix may carry
a derivative as well as a frequency. (G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., sec. 3.4, 4.2.)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.maths.jit import part, reordered
from erls.maths.so3 import Array


@part
def factor(a: Array, pivots: Any) -> int:
    """LU factors, with row exchanges, of the matrix whose columns are the rows of ``a``.

    Parameters
    ----------
    a : (n, n) array
        Becomes L (unit diagonal) and U, with the reciprocals of U's diagonal.
    pivots : (n,) array
        Gets the row that each row was exchanged with; numbers of any kind.

    Returns
    -------
    int
        0, or 1 + the first unknown without a pivot; what is not finite shows in the solution.
    """
    n = a.shape[0]
    status = 0
    for k in range(n):
        column = a[k]
        row, largest = k, abs(column[k].real) + abs(column[k].imag)
        for i in range(k + 1, n):
            size = abs(column[i].real) + abs(column[i].imag)
            if size > largest:
                row, largest = i, size
        pivots[k] = row
        if largest == 0.0:
            if status == 0:
                status = k + 1
            continue
        if row != k:
            for j in range(n):
                other = a[j]
                other[k], other[row] = other[row], other[k]
        inverse = 1.0 / column[k]
        column[k] = inverse
        for i in range(k + 1, n):
            column[i] *= inverse
        for j in range(k + 1, n):
            other = a[j]
            weight = other[k]
            for i in range(k + 1, n):
                other[i] -= weight * column[i]
    return status


@part
def solve(a: Array, pivots: Any, b: Array) -> None:
    """Replace ``b`` (n,) by the solution, with what `factor` left."""
    n = a.shape[0]
    for k in range(n):
        row = int(pivots[k].real)
        b[k], b[row] = b[row], b[k]
    for k in range(n):
        column, weight = a[k], b[k]
        for i in range(k + 1, n):
            b[i] -= weight * column[i]
    for k in range(n - 1, -1, -1):
        column = a[k]
        weight = b[k] * column[k]
        b[k] = weight
        for i in range(k):
            b[i] -= weight * column[i]


@part
def cholesky(a: Array, limit: float) -> int:
    """Replace the upper half of a symmetric ``a`` by U, a = Uᵀ U.

    Returns
    -------
    int
        0, or 1 + the first unknown of which elimination of those before it leaves no more than ``limit`` times its
        diagonal, or nothing finite.
    """
    n = a.shape[0]
    for k in range(n):
        row = a[k]
        whole = row[k]
        for i in range(k):
            whole += a[i, k] * a[i, k]
        if not limit * whole.real < row[k].real < np.inf:
            return k + 1
        inverse = 1.0 / np.sqrt(row[k])
        for j in range(k, n):
            row[j] *= inverse
        for i in range(k + 1, n):
            other, weight = a[i], row[i]
            for j in range(i, n):
                other[j] -= weight * row[j]
    return 0


@part
def forward(u: Array, b: Array) -> None:
    """Replace ``b`` (n,) by U⁻ᵀ b, with the factor of `cholesky`."""
    n = u.shape[0]
    for k in range(n):
        row = u[k]
        b[k] /= row[k]
        weight = b[k]
        for j in range(k + 1, n):
            b[j] -= weight * row[j]


@part
def backward(u: Array, b: Array) -> None:
    """Replace ``b`` (n,) by U⁻¹ b; after `forward` it is the solution."""
    n = u.shape[0]
    for k in range(n - 1, -1, -1):
        row = u[k]
        b[k] = (b[k] - dot(row[k + 1 :], b[k + 1 :])) / row[k]


@reordered
def dot(x: Array, y: Array) -> Any:
    """Product of two vectors, without conjugates."""
    total = x.dtype.type(0)
    for i in range(len(x)):
        total += x[i] * y[i]
    return total


@part
def add_product(a: Array, x: Array, out: Array) -> None:
    """Add A x to ``out`` (n,); rows of ``a`` are columns of A."""
    for j in range(a.shape[0]):
        column, weight = a[j], x[j]
        if weight != 0.0:
            for i in range(len(out)):
                out[i] += weight * column[i]
