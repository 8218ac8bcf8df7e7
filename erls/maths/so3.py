"""Rotations in space.

Only what one rotation needs; `erls.maths.rotation_maps` has exponential, logarithm and tangents for many at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def skew(a: Array) -> Array:
    """(3, 3) matrix of the cross product: skew(a) b = a × b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def cross(a: Array, b: Array) -> Array:
    """a × b of two (3,) vectors, without the overhead of the general one."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def cross_all(a: Array, b: Array) -> Array:
    """a × b of (..., 3) arrays that fit beside each other."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    p, q, r = b[..., 0], b[..., 1], b[..., 2]
    first = y * r - z * q
    result = np.empty((*first.shape, 3), dtype=first.dtype)
    result[..., 0], result[..., 1], result[..., 2] = first, z * p - x * r, x * q - y * p
    return result


def rotation_z(angle: float) -> Array:
    """(3, 3) rotation about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_x(angle: float) -> Array:
    """(3, 3) rotation about x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> Array:
    """(3, 3) rotation about y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def fixed_axes(x: float, y: float, z: float) -> Array:
    """(3, 3) rotation by x, then y, then z [rad], each about a fixed axis (roll, pitch, yaw)."""
    return rotation_z(z) @ rotation_y(y) @ rotation_x(x)
