"""Configurations of nodal systems."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array


@dataclass(frozen=True)
class Nodes:
    """A configuration: poses of the nodes, and what they do not tell; never changed in place.

    Attributes
    ----------
    poses : (k, 4, 4) array
    bent : (e, 6) array
        Twist d of each beam.
    turned : (a,) array
        Joint coordinates of actuators, whole turns counted.
    wound : (w, 3) array
        Rotation vectors of torsion springs.
    """

    poses: Array
    bent: Array
    turned: Array
    wound: Array


def rows_of(poses: Array) -> Array:
    """(..., 12) position and rotation, rows first, of poses (..., 4, 4)."""
    flat = poses[..., :3, :3].reshape(*poses.shape[:-2], 9)
    return np.ascontiguousarray(np.concatenate([poses[..., :3, 3], flat], axis=-1))


def poses_of(rows: Array) -> Array:
    """(..., 4, 4) the other way."""
    result = np.zeros((*rows.shape[:-1], 4, 4))
    result[..., :3, 3], result[..., :3, :3] = rows[..., :3], rows[..., 3:].reshape(*rows.shape[:-1], 3, 3)
    result[..., 3, 3] = 1.0
    return result
