"""Small dense systems of equations in place, on square matrices row after row."""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array, IntArray
from erls.maths.jit import part, reordered


@part
def cholesky(a: Array, limit: float) -> int:
    """Replace the upper half of ``a`` by U, a = UᵀU; 0, or 1 + the unknown of which elimination of those before it
    leaves no more than ``limit`` times its diagonal.
    """
    n = a.shape[0]
    for k in range(n):
        row = a[k]
        whole = row[k]
        for i in range(k):
            whole += a[i, k] * a[i, k]
        if not row[k] > limit * whole:  # NaN too
            return k + 1
        inverse = 1.0 / math.sqrt(row[k])
        for j in range(k, n):
            row[j] *= inverse
        for i in range(k + 1, n):
            other, weight = a[i], row[i]
            for j in range(i, n):
                other[j] -= weight * row[j]
    return 0


@part
def forward(u: Array, b: Array) -> None:
    """Replace ``b`` by U⁻ᵀ b."""
    n = u.shape[0]
    for k in range(n):
        row = u[k]
        b[k] /= row[k]
        weight = b[k]
        for j in range(k + 1, n):
            b[j] -= weight * row[j]


@part
def backward(u: Array, b: Array) -> None:
    """Replace ``b`` by U⁻¹ b."""
    n = u.shape[0]
    for k in range(n - 1, -1, -1):
        row = u[k]
        b[k] = (b[k] - dot(row[k + 1 :], b[k + 1 :])) / row[k]


@reordered
def dot(x: Array, y: Array) -> float:
    """Product of two vectors."""
    total = 0.0
    for i in range(len(x)):
        total += x[i] * y[i]
    return total


@part
def eliminate(a: Array, pivots: IntArray) -> int:
    """Replace ``a`` by LU factors with row exchanges; 0, or 1 + the first unknown without a pivot."""
    n = a.shape[0]
    status = 0
    for k in range(n):
        row, largest = k, abs(a[k, k])
        for i in range(k + 1, n):
            if abs(a[i, k]) > largest:
                row, largest = i, abs(a[i, k])
        pivots[k] = row
        if largest == 0.0:  # what is not finite shows in the solution
            if status == 0:
                status = k + 1
            continue
        here, there = a[k], a[row]
        if row != k:
            for j in range(n):
                here[j], there[j] = there[j], here[j]
        inverse = 1.0 / here[k]
        for i in range(k + 1, n):
            other = a[i]
            weight = other[k] * inverse
            other[k] = weight
            if weight != 0.0:
                for j in range(k + 1, n):
                    other[j] -= weight * here[j]
    return status


@part
def substitute(a: Array, pivots: IntArray, b: Array) -> None:
    """Replace ``b`` by the solution, with the factors of `eliminate`."""
    n = a.shape[0]
    for k in range(n):
        row = pivots[k]
        b[k], b[row] = b[row], b[k]
    for k in range(1, n):
        b[k] -= dot(a[k, :k], b[:k])
    for k in range(n - 1, -1, -1):
        row = a[k]
        b[k] = (b[k] - dot(row[k + 1 :], b[k + 1 :])) / row[k]
