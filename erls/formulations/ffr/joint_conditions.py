"""A joint as constraint equations: the relative pose of its two frames, and the rows that it keeps at zero.

With D = (p, R) the pose of the joint frame on the outer link in that on the inner one, and d its twist, a row is a
component of p or a small turn, a sum of entries of R. Where the motion is prescribed the inner frame is moved along,
and all six rows stand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.formulations.ffr.interface_motion import InterfaceMotion
from erls.formulations.ffr.recursion import bracket
from erls.lie.se3 import inverse, joint_pose, twist_transform
from erls.lie.so3 import Array, cross, skew
from erls.mechanism.joints import Joint

_Turn = tuple[tuple[float, int, int], ...]  # factor, row and column of entries of R
_AXES = "xyz"
_AXIS_TURNS: dict[int, _Turn] = {0: ((-1.0, 1, 2),), 1: ((1.0, 0, 2),)}  # of the joint's axis, at any angle about it
_TURNS: dict[int, _Turn] = {
    k: ((0.5, (k + 2) % 3, (k + 1) % 3), (-0.5, (k + 1) % 3, (k + 2) % 3)) for k in range(3)
}


@dataclass(frozen=True)
class FrameMotion:
    """A joint frame carried by a link: pose in the world; twist in its axes, its rows over the link's velocities
    (6 + n), and the derivative of the twist at zero accelerations.
    """

    pose: Array
    rows: Array
    twist: Array
    bias: Array


def carried_frame(
    world: Array, twist: Array, node: InterfaceMotion, offset: Array, eta: Array, rate: Array
) -> FrameMotion:
    """The frame at ``offset`` (4, 4) from an interface node of a link with its floating frame at ``world``."""
    moved = node.at(eta, rate)
    local = moved.pose @ offset
    shift, carry = twist_transform(offset), twist_transform(local)
    rows = np.hstack([carry, shift @ moved.jacobian])
    relative, carried = rows[:, 6:] @ rate, carry @ twist
    return FrameMotion(world @ local, rows, carried + relative, shift @ moved.bias + bracket(carried, relative))


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
    return JointMotion(pose, transform, twist, outer.bias - transform @ inner.bias + bracket(twist, carried))


def less_motion(joint: Joint, found: JointMotion, reference: tuple[float, float, float]) -> tuple[JointMotion, Array]:
    """What is left beside a prescribed motion, and the part (6,) of its twist that time alone gives."""
    value, rate, acceleration = reference
    pose = inverse(joint_pose(joint.type.revolute, value)) @ found.pose
    screw = twist_transform(pose) @ joint.type.screw
    twist = found.twist - screw * rate
    bias = found.bias - screw * acceleration + bracket(twist, screw * rate)
    return JointMotion(pose, found.transform, twist, bias), -screw * rate


class JointConditions:
    """The rows of one joint.

    Attributes
    ----------
    names : tuple of str
        Direction of each row, in the axes of the inner joint frame.
    """

    def __init__(self, joint: Joint) -> None:
        every: dict[tuple[str, int], _Turn | None] = {("translation along", k): None for k in range(3)}
        every.update({("rotation about", k): _TURNS[k] for k in range(3)})
        if not joint.drive.prescribed:
            del every[("rotation about" if joint.type.revolute else "translation along", 2)]
            if joint.type.revolute:
                every.update({("rotation about", k): _AXIS_TURNS[k] for k in range(2)})
        self.names = tuple(f"{kind} {_AXES[k]}" for kind, k in every)
        self._rows = [(k, turns) for (_, k), turns in every.items()]

    def violation(self, pose: Array) -> Array:
        """(m,) Φ."""
        return np.array(
            [pose[k, 3] if turns is None else sum(c * pose[i, j] for c, i, j in turns) for k, turns in self._rows]
        )

    def gradient(self, pose: Array) -> Array:
        """(m, 6) Φ̇ = gradient · d."""
        result = np.zeros((len(self._rows), 6))
        for row, (k, turns) in zip(result, self._rows, strict=True):
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
            [sliding[k] if turns is None else sum(c * turned[i, j] for c, i, j in turns) for k, turns in self._rows]
        )
