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


def numbers_of(q: Nodes) -> Array:
    """(c,) a configuration in flat memory, as a `erls.equations.nodal.contract.State` lies there."""
    return np.concatenate([part.ravel() for part in (rows_of(q.poses), q.bent, q.turned, q.wound)])


def of_numbers(numbers: Array, like: Nodes) -> Nodes:
    """The other way, for a configuration of the same system."""
    rows = (len(like.poses), 12)
    shapes = rows, like.bent.shape, like.turned.shape, like.wound.shape
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    parts = [x.reshape(shape).copy() for x, shape in zip(np.split(numbers, ends[:-1]), shapes, strict=True)]
    return Nodes(poses_of(parts[0]), *parts[1:])


def twists_of(turn: Array, rate: Array) -> Array:
    """(..., 6) twists in the axes of nodes with rotations (..., 3, 3) from what is stored of their rates (..., 12)."""
    back = np.swapaxes(turn, -1, -2)
    spin = back @ rate[..., 3:].reshape(turn.shape)
    twist = np.empty((*rate.shape[:-1], 6))
    twist[..., :3] = (back @ rate[..., :3, None])[..., 0]
    twist[..., 3:] = (spin - np.swapaxes(spin, -1, -2))[..., [2, 0, 1], [1, 2, 0]] / 2
    return twist
