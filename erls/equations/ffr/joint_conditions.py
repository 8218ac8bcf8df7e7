"""A joint of a chain as constraint equations. Where the motion is prescribed the inner frame is moved along, and all
six rows stand.
"""

from __future__ import annotations

import numpy as np

from erls.equations.ffr.interface_motion import InterfaceMotion, bracket
from erls.equations.serial.joint_frames import (
    AXIS_TURNS,
    TURNS,
    Conditions,
    FrameMotion,
    JointMotion,
    Turn,
    joint_motion,
    less_motion,
)
from erls.maths.se3 import twist_transform
from erls.maths.so3 import Array
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


class JointConditions(Conditions):
    """The rows of one joint."""

    def __init__(self, joint: Joint) -> None:
        every: dict[tuple[str, int], Turn | None] = {("translation along", k): None for k in range(3)}
        every.update({("rotation about", k): TURNS[k] for k in range(3)})
        if not joint.drive.prescribed:
            del every[("rotation about" if joint.type.revolute else "translation along", 2)]
            if joint.type.revolute:
                every.update({("rotation about", k): AXIS_TURNS[k] for k in range(2)})
        super().__init__(every)


__all__ = ["FrameMotion", "JointConditions", "JointMotion", "carried_frame", "joint_motion", "less_motion"]
