"""Vectors as three numbers and rotation matrices as nine, rows first: without memory of their own in compiled code.

The numbers may be real or complex, or arrays of either where the functions run plain (`erls.maths.jit.plain`).
"""

from __future__ import annotations

from typing import TypeAlias

from erls.maths.jit import part
from erls.maths.so3 import Array

Vector: TypeAlias = tuple[float, float, float]
Twist: TypeAlias = tuple[Vector, Vector]
Rotation: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]


@part
def plus(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part
def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@part
def scaled(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@part
def dot(a: Vector, b: Vector) -> float:
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def unit(k: int) -> Vector:
    """Axis k; zero for any other number."""
    return 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0


@part
def times(r: Rotation, a: Vector) -> Vector:
    """R a."""
    return (
        r[0] * a[0] + r[1] * a[1] + r[2] * a[2],
        r[3] * a[0] + r[4] * a[1] + r[5] * a[2],
        r[6] * a[0] + r[7] * a[1] + r[8] * a[2],
    )


@part
def turned(r: Rotation, a: Vector) -> Vector:
    """Rᵀ a."""
    return (
        r[0] * a[0] + r[3] * a[1] + r[6] * a[2],
        r[1] * a[0] + r[4] * a[1] + r[7] * a[2],
        r[2] * a[0] + r[5] * a[1] + r[8] * a[2],
    )


@part
def product(a: Rotation, b: Rotation) -> Rotation:
    """A B."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@part
def back_product(a: Rotation, b: Rotation) -> Rotation:
    """Aᵀ B."""
    return (
        a[0] * b[0] + a[3] * b[3] + a[6] * b[6],
        a[0] * b[1] + a[3] * b[4] + a[6] * b[7],
        a[0] * b[2] + a[3] * b[5] + a[6] * b[8],
        a[1] * b[0] + a[4] * b[3] + a[7] * b[6],
        a[1] * b[1] + a[4] * b[4] + a[7] * b[7],
        a[1] * b[2] + a[4] * b[5] + a[7] * b[8],
        a[2] * b[0] + a[5] * b[3] + a[8] * b[6],
        a[2] * b[1] + a[5] * b[4] + a[8] * b[7],
        a[2] * b[2] + a[5] * b[5] + a[8] * b[8],
    )


@part
def axial(n: Rotation) -> Vector:
    """z with z · ω = ⟨N, ω̃⟩."""
    return n[7] - n[5], n[2] - n[6], n[3] - n[1]


@part
def vector(table: Array, row: int, at: int) -> Vector:
    """Three numbers of a row of a table."""
    return table[row, at], table[row, at + 1], table[row, at + 2]


@part
def nine(table: Array, row: int, at: int) -> Rotation:
    """Nine numbers of a row of a table."""
    return (
        table[row, at],
        table[row, at + 1],
        table[row, at + 2],
        table[row, at + 3],
        table[row, at + 4],
        table[row, at + 5],
        table[row, at + 6],
        table[row, at + 7],
        table[row, at + 8],
    )


@part
def put(out: Array, at: int, a: Vector) -> None:
    """out[at : at + 3] = a."""
    out[at], out[at + 1], out[at + 2] = a


@part
def add(out: Array, at: int, a: Vector) -> None:
    """out[at : at + 3] += a."""
    out[at] += a[0]
    out[at + 1] += a[1]
    out[at + 2] += a[2]


@part
def three(values: Array, at: int) -> Vector:
    """values[at : at + 3]."""
    return values[at], values[at + 1], values[at + 2]


@part
def of_matrix(matrices: Array, e: int, v: Vector, w: Vector) -> Twist:
    """Pair of vectors M [v; w] of matrix e of a pile (e, 6, 6)."""
    return (
        _row(matrices, e, 0, v, w),
        _row(matrices, e, 1, v, w),
        _row(matrices, e, 2, v, w),
    ), (_row(matrices, e, 3, v, w), _row(matrices, e, 4, v, w), _row(matrices, e, 5, v, w))


@part
def _row(matrices: Array, e: int, i: int, v: Vector, w: Vector) -> float:
    linear: float = matrices[e, i, 0] * v[0] + matrices[e, i, 1] * v[1] + matrices[e, i, 2] * v[2]
    angular: float = matrices[e, i, 3] * w[0] + matrices[e, i, 4] * w[1] + matrices[e, i, 5] * w[2]
    return linear + angular
