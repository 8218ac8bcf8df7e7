"""A joint of a chain as constraint equations. Where the motion is prescribed the inner frame is moved along, and all
six rows stand.
"""

from __future__ import annotations

import numpy as np

from erls.equations.ffr.interface_motion import InterfaceMotion, bracket
from erls.equations.serial.joint_frames import (
    Conditions,
    FrameMotion,
    JointMotion,
    joint_motion,
    less_motion,
)
from erls.maths.se3 import twist_transform
from erls.maths.so3 import Array
from erls.mechanism.joint_types import JOINT_TYPES, single
from erls.mechanism.joints import Joint


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


def joint_conditions(joint: Joint) -> Conditions:
    """The rows of a joint."""
    return Conditions(JOINT_TYPES["fixed"] if joint.drive.prescribed else single(joint.freedom))


__all__ = ["FrameMotion", "JointMotion", "carried_frame", "joint_conditions", "joint_motion", "less_motion"]
