"""Small dense systems of equations in place and without allocation, in loops that processors do on several numbers at
once.

A matrix is stored transposed: row j of an array holds column j. No rows are exchanged: the matrices are mass plus
multiples of damping and stiffness whose real part is positive definite, so elimination does not let them grow (N. J.
Higham, Factorizing complex symmetric matrices with positive definite real and imaginary parts, 1998).
"""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array
from erls.maths.jit import part


@part
def factor_real(a: Array) -> int:
    """Replace ``a`` by L (unit diagonal) and U; 0, or 1 + the unknown at which elimination broke down."""
    n = a.shape[0]
    for k in range(n):
        column = a[k]
        if not (abs(column[k]) > 0.0 and math.isfinite(column[k])):
            return k + 1
        inverse = 1.0 / column[k]
        for i in range(k + 1, n):
            column[i] *= inverse
        for j in range(k + 1, n):
            other = a[j]
            weight = other[k]
            for i in range(k + 1, n):
                other[i] -= weight * column[i]
    return 0


@part
def solve_real(a: Array, b: Array) -> None:
    """Replace ``b`` (n,) by the solution, with the factors of `factor_real`."""
    n = a.shape[0]
    for k in range(n):
        column, weight = a[k], b[k]
        for i in range(k + 1, n):
            b[i] -= weight * column[i]
    for k in range(n - 1, -1, -1):
        column = a[k]
        weight = b[k] / column[k]
        b[k] = weight
        for i in range(k):
            b[i] -= weight * column[i]


@part
def factor_complex(re: Array, im: Array) -> int:
    """`factor_real` of re + i im."""
    n = re.shape[0]
    for k in range(n):
        x, y = re[k], im[k]
        size = x[k] * x[k] + y[k] * y[k]
        if not (size > 0.0 and math.isfinite(size)):
            return k + 1
        p, q = x[k] / size, -y[k] / size
        for i in range(k + 1, n):
            u = x[i]
            x[i] = u * p - y[i] * q
            y[i] = u * q + y[i] * p
        for j in range(k + 1, n):
            u_row, v_row = re[j], im[j]
            p, q = u_row[k], v_row[k]
            for i in range(k + 1, n):
                u_row[i] -= p * x[i] - q * y[i]
                v_row[i] -= p * y[i] + q * x[i]
    return 0


@part
def solve_complex(re: Array, im: Array, b: Array, c: Array) -> None:
    """Replace b + i c by the solution, with the factors of `factor_complex`."""
    n = re.shape[0]
    for k in range(n):
        x, y, p, q = re[k], im[k], b[k], c[k]
        for i in range(k + 1, n):
            b[i] -= p * x[i] - q * y[i]
            c[i] -= p * y[i] + q * x[i]
    for k in range(n - 1, -1, -1):
        x, y = re[k], im[k]
        size = x[k] * x[k] + y[k] * y[k]
        p = (b[k] * x[k] + c[k] * y[k]) / size
        q = (c[k] * x[k] - b[k] * y[k]) / size
        b[k], c[k] = p, q
        for i in range(k):
            b[i] -= p * x[i] - q * y[i]
            c[i] -= p * y[i] + q * x[i]


@part
def add_product(a: Array, x: Array, out: Array) -> None:
    """Add A x to ``out`` (n,)."""
    for j in range(a.shape[0]):
        column, weight = a[j], x[j]
        if weight != 0.0:
            for i in range(len(out)):
                out[i] += weight * column[i]
