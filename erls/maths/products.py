"""Products of matrices with vectors, on arrays that are given: the inner loops of all compiled equations.

Sums may be taken in any order, so that processors take several terms at once. For any scalar.
"""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part, reordered
from erls.maths.so3 import Array


@part
def clear(x: Array) -> None:
    """Zeros."""
    for i in range(len(x)):
        x[i] = 0.0


@part
def copy(x: Array, out: Array) -> None:
    """``out`` = x, of vectors."""
    for i in range(len(x)):
        out[i] = x[i]


@part
def subtract(x: Array, out: Array) -> None:
    """Subtract x from ``out``, of vectors."""
    for i in range(len(x)):
        out[i] -= x[i]


@part
def copy_matrix(a: Array, out: Array) -> None:
    """``out`` = A."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]


@reordered
def dot(x: Array, y: Array) -> Any:
    """xᵀ y, plain also for complex numbers."""
    total = 0.0
    for i in range(len(x)):
        total += x[i] * y[i]
    return total


@reordered
def add_columns(columns: Array, x: Array, factor: Any, out: Array) -> None:
    """Add to ``out`` (m,) the factor times Σ_j x_j columns_j, of columns (n, m) that lie one after the other."""
    j, n, m = 0, len(x), len(out)
    while j + 4 <= n:  # four at once: out is read and written once
        a, b, c, d = factor * x[j], factor * x[j + 1], factor * x[j + 2], factor * x[j + 3]
        p, q, r, s = columns[j], columns[j + 1], columns[j + 2], columns[j + 3]
        for i in range(m):
            out[i] += (a * p[i] + b * q[i]) + (c * r[i] + d * s[i])
        j += 4
    while j < n:
        a, p = factor * x[j], columns[j]
        for i in range(m):
            out[i] += a * p[i]
        j += 1


@reordered
def add_rows(matrix: Array, x: Array, factor: Any, out: Array) -> None:
    """Add to ``out`` (m,) the factor times a matrix (m, n) times x (n,)."""
    for i in range(len(out)):
        row = matrix[i]
        total = 0.0
        for j in range(len(x)):
            total += row[j] * x[j]
        out[i] += factor * total


@reordered
def add_symmetric(matrix: Array, x: Array, start: int, out: Array) -> None:
    """Add to ``out`` (n,) a symmetric matrix (n, n) times x, whose entries before ``start`` are zero.

    Of the matrix half is read.
    """
    n = len(x)
    for j in range(start):
        column = matrix[j]
        total = 0.0
        for i in range(start, n):
            total += column[i] * x[i]
        out[j] += total
    for j in range(start, n):
        below, rest, result = matrix[j, j + 1 :], x[j + 1 :], out[j + 1 :]
        weight = x[j]
        total = weight * matrix[j, j]
        for i in range(len(below)):  # from 0: otherwise it is not done on several numbers at once
            total += below[i] * rest[i]
            result[i] += weight * below[i]
        out[j] += total


@reordered
def pass_columns(
    columns: Array, start: int, x: Array, y: Array, out_x: Array, out_y: Array, s: Array, back: Array
) -> None:
    """Add X x to out_x, X y to out_y and -Xᵀ s to back, reading the columns of X once, from number ``start`` on."""
    n = len(x)
    for j in range(start, n):
        column = columns[j]
        p, q, total = x[j], y[j], 0.0
        for i in range(n):
            total += column[i] * s[i]
            out_x[i] += p * column[i]
            out_y[i] += q * column[i]
        back[j] -= total


@reordered
def add_product(a: Array, b: Array, out: Array) -> None:
    """Add A B to ``out``, of matrices (m, k), (k, n)."""
    for i in range(a.shape[0]):
        row = out[i]
        for k in range(a.shape[1]):
            weight, other = a[i, k], b[k]
            for j in range(len(row)):
                row[j] += weight * other[j]


@reordered
def add_transposed_product(a: Array, b: Array, out: Array) -> None:
    """Add Aᵀ B to ``out``, of matrices (k, m), (k, n)."""
    for k in range(a.shape[0]):
        other = b[k]
        for i in range(a.shape[1]):
            weight, row = a[k, i], out[i]
            for j in range(len(row)):
                row[j] += weight * other[j]


@reordered
def add_scaled_product(factor: Any, a: Array, b: Array, out: Array) -> None:
    """Add to ``out`` the factor times A B, of matrices (m, k), (k, n)."""
    for i in range(a.shape[0]):
        row = out[i]
        for k in range(a.shape[1]):
            weight, other = factor * a[i, k], b[k]
            for j in range(len(row)):
                row[j] += weight * other[j]


@reordered
def add_inner_products(factor: Any, a: Array, b: Array, out: Array) -> None:
    """Add to ``out`` [i, j] the factor times the product of row i of ``a`` (m, k) and row j of ``b`` (n, k).

    Three rows by three at once: each number that is read serves three products.
    """
    m, n = a.shape[0], b.shape[0]
    for i in range(0, m - 2, 3):
        p, q, r = a[i], a[i + 1], a[i + 2]
        for j in range(0, n - 2, 3):
            u, v, w = b[j], b[j + 1], b[j + 2]
            pu = pv = pw = qu = qv = qw = ru = rv = rw = 0.0
            for k in range(len(p)):
                pu += p[k] * u[k]
                pv += p[k] * v[k]
                pw += p[k] * w[k]
                qu += q[k] * u[k]
                qv += q[k] * v[k]
                qw += q[k] * w[k]
                ru += r[k] * u[k]
                rv += r[k] * v[k]
                rw += r[k] * w[k]
            out[i, j] += factor * pu
            out[i, j + 1] += factor * pv
            out[i, j + 2] += factor * pw
            out[i + 1, j] += factor * qu
            out[i + 1, j + 1] += factor * qv
            out[i + 1, j + 2] += factor * qw
            out[i + 2, j] += factor * ru
            out[i + 2, j + 1] += factor * rv
            out[i + 2, j + 2] += factor * rw
    for i in range(m):
        for j in range(n - n % 3 if i < m - m % 3 else 0, n):
            out[i, j] += factor * dot(a[i], b[j])


@part
def clear_matrix(a: Array) -> None:
    """Zeros."""
    for i in range(a.shape[0]):
        clear(a[i])
