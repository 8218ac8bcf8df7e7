"""Rigid motions as 4x4 matrices and twists [v; ω].

A pose T_AB = [[R, p], [0, 1]] takes coordinates in frame B to coordinates in frame A. A twist holds the velocity of
a frame's origin and its angular velocity, in that frame's axes; small displacements (u, φ) transform like twists.
"""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array, skew


def pose(rotation: Array | None = None, position: Array | None = None) -> Array:
    """(4, 4) pose from a rotation and a position; identity and zero unless given."""
    t = np.eye(4)
    if rotation is not None:
        t[:3, :3] = rotation
    if position is not None:
        t[:3, 3] = position
    return t


def inverse(t: Array) -> Array:
    """(4, 4) inverse of a pose."""
    result = np.eye(4)
    result[:3, :3] = t[:3, :3].T
    result[:3, 3] = -t[:3, :3].T @ t[:3, 3]
    return result


def twist_transform(t: Array) -> Array:
    """(6, 6) twist of frame A to the twist of a frame B that moves with it, T_AB = ``t``.

    ω_B = Rᵀ ω_A, v_B = Rᵀ (v_A + ω_A × p): the adjoint of the inverse pose.
    """
    x = np.zeros((6, 6))
    turn = t[:3, :3].T
    x[:3, :3] = turn
    x[3:, 3:] = turn
    x[:3, 3:] = -turn @ skew(t[:3, 3])
    return x


def twist_cross(twist: Array) -> Array:
    """(6, 6) ad of a twist [v; ω]: the Lie bracket."""
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = skew(twist[3:])
    result[:3, 3:] = skew(twist[:3])
    return result
