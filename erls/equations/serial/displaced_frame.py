"""Motion of a node of a link whose modal coordinates are small displacements: moved by u, turned by φ.

The turn is Cayley's, R = 1 + (φ̃ + φ̃²/2)/(1 + φ²/4), which agrees with exp φ̃ to second order; its angular velocity
in its own axes is (φ̇ - φ × φ̇/2)/(1 + φ²/4).
"""

from __future__ import annotations

import numpy as np

from erls.equations.serial.joint_frames import FrameMotion
from erls.maths.se3 import pose
from erls.maths.so3 import Array, cross, skew


def displaced_frame(
    position: Array,
    translation: Array,
    rotation: Array,
    q: Array,
    qd: Array,
    bias: Array,
    moves: Array,
    second_order: Array | None = None,
) -> FrameMotion:
    """A node relative to its link's frame.

    Parameters
    ----------
    position : (3,) array
        Undeformed, in the link's frame.
    translation, rotation : (3, m) arrays
        u and φ per modal coordinate.
    q, qd, bias : (m,) arrays
        Modal coordinates, their rates, and their accelerations when those of the mechanism's coordinates are zero.
    moves : (m, n) array
        Modal rates per rates of the mechanism's coordinates.
    second_order : (6, m, m) array, optional
        Ψ of u and φ, which gain ½ qᵀ Ψ q.
    """
    u, phi, curved = translation @ q, rotation @ q, np.zeros(6)
    if second_order is not None:
        slope = second_order @ q
        u, phi = u + slope[:3] @ q / 2, phi + slope[3:] @ q / 2
        translation, rotation = translation + slope[:3], rotation + slope[3:]
        curved = (second_order @ qd) @ qd
    phi_rate = rotation @ qd
    size = 1 + float(phi @ phi) / 4
    tilde = skew(phi)
    turn = np.eye(3) + (tilde + tilde @ tilde / 2) / size
    jacobian = np.vstack([turn.T @ translation, (rotation - tilde @ rotation / 2) / size])
    twist = jacobian @ qd
    rate = jacobian @ bias
    rate[:3] += cross(twist[:3], twist[3:])
    rate[3:] -= twist[3:] * (float(phi @ phi_rate) / (2 * size))
    rate[:3] += turn.T @ curved[:3]
    rate[3:] += (curved[3:] - tilde @ curved[3:] / 2) / size
    return FrameMotion(pose(turn, position + u), jacobian @ moves, twist, rate)
