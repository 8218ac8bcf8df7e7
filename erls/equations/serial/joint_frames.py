"""Relative motion of two joint frames that are carried along, and rows that keep parts of it at zero.

With D = (p, R) the pose of the outer joint frame in the inner one, and d its twist, a row is a component of p or a
small turn, a sum of entries of R.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import inverse, joint_pose, twist_cross, twist_transform
from erls.maths.so3 import Array, cross, skew
from erls.mechanism.joints import JointType

Turn = tuple[tuple[float, int, int], ...]  # factor, row and column of entries of R
_AXES = "xyz"
AXIS_TURNS: dict[int, Turn] = {0: ((-1.0, 1, 2),), 1: ((1.0, 0, 2),)}  # of the z axis, at any angle about it
TURNS: dict[int, Turn] = {
    k: ((0.5, (k + 2) % 3, (k + 1) % 3), (-0.5, (k + 1) % 3, (k + 2) % 3)) for k in range(3)
}


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
    kind: JointType, found: JointMotion, reference: tuple[float, float, float]
) -> tuple[JointMotion, Array]:
    """What is left beside a prescribed coordinate, rate and acceleration; and the twist (6,) that time alone gives."""
    value, rate, acceleration = reference
    pose = inverse(joint_pose(kind.revolute, value)) @ found.pose
    screw = twist_transform(pose) @ kind.screw
    twist = found.twist - screw * rate
    bias = found.bias - screw * acceleration + twist_cross(twist) @ (screw * rate)
    return JointMotion(pose, found.transform, twist, bias), -screw * rate


class Conditions:
    """Rows that keep parts of a relative motion at zero.

    Parameters
    ----------
    rows : mapping
        (kind, axis) of a row to the turn that it measures; None for a translation.

    Attributes
    ----------
    names : tuple of str
        Direction of each row, in the axes of the inner joint frame.
    entries : list of (int, Turn or None)
        Axis and turn of each row.
    lines, turns : (m, 3), (m, 3, 3) arrays
        c and C: the rows are c · p + ⟨C, R⟩.
    """

    def __init__(self, rows: Mapping[tuple[str, int], Turn | None]) -> None:
        self.names = tuple(f"{kind} {_AXES[k]}" for kind, k in rows)
        self.entries = [(k, turns) for (_, k), turns in rows.items()]
        self.lines, self.turns = np.zeros((len(rows), 3)), np.zeros((len(rows), 3, 3))
        for number, (axis, turn) in enumerate(self.entries):
            if turn is None:
                self.lines[number, axis] = 1.0
            for factor, i, j in turn or ():
                self.turns[number, i, j] = factor

    def violation(self, pose: Array) -> Array:
        """(m,) Φ."""
        return np.array(
            [pose[k, 3] if turns is None else sum(c * pose[i, j] for c, i, j in turns) for k, turns in self.entries]
        )

    def gradient(self, pose: Array) -> Array:
        """(m, 6) Φ̇ = gradient · d."""
        result = np.zeros((len(self.entries), 6))
        for row, (k, turns) in zip(result, self.entries, strict=True):
            if turns is None:
                row[:3] = pose[k, :3]
            else:
                row[3:] = -sum(c * (pose[i, :3] @ skew(np.eye(3)[j])) for c, i, j in turns)
        return result

    def curvature(self, pose: Array, twist: Array) -> Array:
        """(m,) Φ̈ at ḋ = 0."""
        turning, sliding = skew(twist[3:]), pose[:3, :3] @ cross(twist[3:], twist[:3])
        turned = pose[:3, :3] @ turning @ turning
        return np.array(
            [sliding[k] if turns is None else sum(c * turned[i, j] for c, i, j in turns) for k, turns in self.entries]
        )


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
