"""Rows of matrices times vectors, and places of vectors in the memory of a link."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.ffr import layout as at
from erls.maths.jit import part, reordered


@part
def vector(memory: int, e: int, number: int) -> int:
    """Where a vector (e,) of a link's memory starts, by its number in `layout`."""
    return memory + at.VECTORS + number * e


@reordered
def add_rows(matrix: Array, start: int, x: Array, factor: float, out: Array) -> None:
    """Add to ``out`` the factor times a matrix, row after row from ``start``, times x."""
    n = len(x)
    for i in range(len(out)):
        row = matrix[start + i * n : start + (i + 1) * n]
        total = 0.0
        for j in range(n):
            total += row[j] * x[j]
        out[i] += factor * total


@part
def cross3(a0: float, a1: float, a2: float, b0: float, b1: float, b2: float) -> tuple[float, float, float]:
    """a × b."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
