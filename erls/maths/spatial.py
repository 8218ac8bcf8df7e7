"""Motions and forces of rigid frames on arrays: six numbers, the linear three first, the angular three after them.

A pose is twelve numbers: the rotation of a frame against the one before it, row after row, then its place there. Where
``out`` is the argument itself, the result takes its place. After R. Featherstone, Rigid Body Dynamics Algorithms,
ch. 2, with the linear part first. For any scalar.
"""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part
from erls.maths.so3 import Array


@part
def transform_motion(pose: Array, x: Array, out: Array) -> None:
    """Ad⁻¹ x: a motion seen from the frame before, seen from the frame at this pose."""
    x0, x1, x2, w0, w1, w2 = x[0], x[1], x[2], x[3], x[4], x[5]
    p0, p1, p2 = pose[9], pose[10], pose[11]
    v0, v1, v2 = x0 + w1 * p2 - w2 * p1, x1 + w2 * p0 - w0 * p2, x2 + w0 * p1 - w1 * p0
    for i in range(3):
        out[i] = pose[i] * v0 + pose[3 + i] * v1 + pose[6 + i] * v2
        out[3 + i] = pose[i] * w0 + pose[3 + i] * w1 + pose[6 + i] * w2


@part
def transform_force_back(pose: Array, f: Array, out: Array) -> None:
    """Ad⁻ᵀ f: a force and moment on the frame at this pose, as those on the frame before."""
    f0, f1, f2, m0, m1, m2 = f[0], f[1], f[2], f[3], f[4], f[5]
    a0 = pose[0] * f0 + pose[1] * f1 + pose[2] * f2
    a1 = pose[3] * f0 + pose[4] * f1 + pose[5] * f2
    a2 = pose[6] * f0 + pose[7] * f1 + pose[8] * f2
    p0, p1, p2 = pose[9], pose[10], pose[11]
    out[0], out[1], out[2] = a0, a1, a2
    out[3] = pose[0] * m0 + pose[1] * m1 + pose[2] * m2 + p1 * a2 - p2 * a1
    out[4] = pose[3] * m0 + pose[4] * m1 + pose[5] * m2 + p2 * a0 - p0 * a2
    out[5] = pose[6] * m0 + pose[7] * m1 + pose[8] * m2 + p0 * a1 - p1 * a0


@part
def rotate_back(pose: Array, x: Array, out: Array) -> None:
    """Rᵀ x of a vector (3,)."""
    x0, x1, x2 = x[0], x[1], x[2]
    for i in range(3):
        out[i] = pose[i] * x0 + pose[3 + i] * x1 + pose[6 + i] * x2


@part
def rotate(pose: Array, x: Array, out: Array) -> None:
    """R x of a vector (3,)."""
    x0, x1, x2 = x[0], x[1], x[2]
    for i in range(3):
        out[i] = pose[3 * i] * x0 + pose[3 * i + 1] * x1 + pose[3 * i + 2] * x2


@part
def invert_pose(pose: Array, out: Array) -> None:
    """The inverse pose, into another array."""
    p0, p1, p2 = pose[9], pose[10], pose[11]
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = pose[3 * j + i]
        out[9 + i] = -(pose[i] * p0 + pose[3 + i] * p1 + pose[6 + i] * p2)


@part
def step_back(step: Array, pose: Array, spare: Array) -> None:
    """A pose (12,) in one frame becomes that in the frame before, in which the former stands at ``step``."""
    for i in range(12):
        spare[i] = pose[i]
    compose_poses(step, spare, pose)


@part
def set_identity(pose: Array) -> None:
    """The pose of a frame in itself."""
    for i in range(12):
        pose[i] = 1.0 if i in (0, 4, 8) else 0.0


@part
def compose_poses(first: Array, second: Array, out: Array) -> None:
    """The second pose seen from where the first one is seen from; into another array."""
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = (
                first[3 * i] * second[j] + first[3 * i + 1] * second[3 + j] + first[3 * i + 2] * second[6 + j]
            )
        out[9 + i] = (
            first[9 + i] + first[3 * i] * second[9] + first[3 * i + 1] * second[10] + first[3 * i + 2] * second[11]
        )


@part
def add_motion_cross(x: Array, y: Array, factor: Any, out: Array) -> None:
    """Add ``factor`` times ad(x) y, the Lie bracket of two motions."""
    v0, v1, v2, a0, a1, a2 = x[0], x[1], x[2], x[3], x[4], x[5]
    y0, y1, y2, b0, b1, b2 = y[0], y[1], y[2], y[3], y[4], y[5]
    out[0] += factor * (a1 * y2 - a2 * y1 + v1 * b2 - v2 * b1)
    out[1] += factor * (a2 * y0 - a0 * y2 + v2 * b0 - v0 * b2)
    out[2] += factor * (a0 * y1 - a1 * y0 + v0 * b1 - v1 * b0)
    out[3] += factor * (a1 * b2 - a2 * b1)
    out[4] += factor * (a2 * b0 - a0 * b2)
    out[5] += factor * (a0 * b1 - a1 * b0)


@part
def add_force_cross(x: Array, p: Array, out: Array) -> None:
    """Add -ad(x)ᵀ p: what a momentum p in a frame that moves with x adds to its rate."""
    v0, v1, v2, a0, a1, a2 = x[0], x[1], x[2], x[3], x[4], x[5]
    p0, p1, p2, m0, m1, m2 = p[0], p[1], p[2], p[3], p[4], p[5]
    out[0] += a1 * p2 - a2 * p1
    out[1] += a2 * p0 - a0 * p2
    out[2] += a0 * p1 - a1 * p0
    out[3] += a1 * m2 - a2 * m1 + v1 * p2 - v2 * p1
    out[4] += a2 * m0 - a0 * m2 + v2 * p0 - v0 * p2
    out[5] += a0 * m1 - a1 * m0 + v0 * p1 - v1 * p0


@part
def add_cross(x: Array, y: Array, factor: Any, out: Array) -> None:
    """Add ``factor`` times the cross product of two vectors (3,)."""
    x0, x1, x2, y0, y1, y2 = x[0], x[1], x[2], y[0], y[1], y[2]
    out[0] += factor * (x1 * y2 - x2 * y1)
    out[1] += factor * (x2 * y0 - x0 * y2)
    out[2] += factor * (x0 * y1 - x1 * y0)


@part
def dot3(x: Array, y: Array) -> Any:
    """Product of three numbers each."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@part
def dot6(x: Array, y: Array) -> Any:
    """Product of six numbers each: the power of a force on a motion."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3] + x[4] * y[4] + x[5] * y[5]
