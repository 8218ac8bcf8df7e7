"""Relative motion of two joint frames that are carried along, and rows that keep parts of it at zero.

With D = (Q, p) the pose of the outer joint frame in the inner one, and d its twist, a row is linear in the entries of p
and Q (`erls.mechanism.joint_types`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import inverse, twist_cross, twist_transform
from erls.maths.so3 import Array, cross, skew
from erls.mechanism.joint_types import Freedom, JointType


@dataclass(frozen=True)
class FrameMotion:
    """A frame carried by a link: its pose; its twist in its own axes, with the rows of that over velocities, and the
    derivative of the twist at zero accelerations.
    """

    pose: Array
    rows: Array
    twist: Array
    bias: Array


@dataclass(frozen=True)
class JointMotion:
    """Relative motion of a joint's frames.

    Attributes
    ----------
    pose : (4, 4) array
        D.
    transform : (6, 6) array
        Twist of the inner frame to the axes of the outer one.
    twist, bias : (6,) arrays
        d in the axes of the outer frame, and its derivative at zero accelerations.
    """

    pose: Array
    transform: Array
    twist: Array
    bias: Array


def joint_motion(inner: FrameMotion, outer: FrameMotion) -> JointMotion:
    """Pose and twist of the outer frame relative to the inner one."""
    pose = inverse(inner.pose) @ outer.pose
    transform = twist_transform(pose)
    carried = transform @ inner.twist
    twist = outer.twist - carried
    return JointMotion(pose, transform, twist, outer.bias - transform @ inner.bias + twist_cross(twist) @ carried)


def less_motion(
    freedom: Freedom, found: JointMotion, reference: tuple[float, float, float]
) -> tuple[JointMotion, Array]:
    """What is left beside a prescribed coordinate, rate and acceleration; and the twist (6,) that time alone gives."""
    value, rate, acceleration = reference
    pose = inverse(freedom.pose(value)) @ found.pose
    screw = twist_transform(pose) @ freedom.screw
    twist = found.twist - screw * rate
    bias = found.bias - screw * acceleration + twist_cross(twist) @ (screw * rate)
    return JointMotion(pose, found.transform, twist, bias), -screw * rate


class Conditions:
    """What a joint keeps at zero.

    Parameters
    ----------
    kind : JointType

    Attributes
    ----------
    names : tuple of str
    lines, entries : (m, 3), (m, 3, 3) arrays
        c and C of c · p + ⟨C, Q⟩.
    """

    def __init__(self, kind: JointType) -> None:
        self.names = tuple(condition.name for condition in kind.conditions)
        self.lines = np.array([condition.line for condition in kind.conditions])
        self.entries = np.array([condition.entries for condition in kind.conditions])

    def violation(self, pose: Array) -> Array:
        """(m,) Φ."""
        return np.asarray(self.lines @ pose[:3, 3] + np.einsum("mij,ij->m", self.entries, pose[:3, :3]))

    def gradient(self, pose: Array) -> Array:
        """(m, 6) Φ̇ = gradient · d."""
        pulled = np.einsum("ji,mjk->mik", pose[:3, :3], self.entries)
        return np.hstack([self.lines @ pose[:3, :3], pulled[:, (2, 0, 1), (1, 2, 0)] - pulled[:, (1, 2, 0), (2, 0, 1)]])

    def curvature(self, pose: Array, twist: Array) -> Array:
        """(m,) Φ̈ at ḋ = 0."""
        turning, sliding = skew(twist[3:]), pose[:3, :3] @ cross(twist[3:], twist[:3])
        turned = pose[:3, :3] @ turning @ turning
        return np.asarray(self.lines @ sliding + np.einsum("mij,ij->m", self.entries, turned))


def carried(link: FrameMotion, local: FrameMotion) -> FrameMotion:
    """A frame that moves by ``local`` inside a frame that moves by ``link``; rows of both over the same velocities."""
    carry = twist_transform(local.pose)
    along = carry @ link.twist
    return FrameMotion(
        link.pose @ local.pose,
        carry @ link.rows + local.rows,
        along + local.twist,
        carry @ link.bias + local.bias + twist_cross(along) @ local.twist,
    )


def attached(frame: FrameMotion, offset: Array) -> FrameMotion:
    """A frame fixed at ``offset`` (4, 4) to a moving one."""
    shift = twist_transform(offset)
    return FrameMotion(frame.pose @ offset, shift @ frame.rows, shift @ frame.twist, shift @ frame.bias)
