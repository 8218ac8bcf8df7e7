"""Power of what acts along joints, and of what damps modes, at many times; see `erls.equations.compiled_system`."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.serial.joints import effort, elastic_effort, set_coordinate
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    call_feed_forward,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.STATES, counted=False)
def joint_powers(reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array) -> None:
    """Rows of ``out`` (k, 2) [W]: of drives, dampers, friction and stops in joints, motors of prescribed motions and
    what is elastic left out; of the damping of modes. θ is the angle that these act along.
    """
    serial = read_serial(reals, integers, integers[0])
    for row in range(len(t)):
        if serial.feeds >= 0:
            call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t[row])
        joints = damped = 0.0
        for k in range(serial.links):
            joint = read_joint(reals, integers, serial.joints + k * JOINT)
            modes = read_modes(reals, integers, serial.modes + k * MODES)
            if joint.acts:
                motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
                set_coordinate(joint, motion, reals, integers, t[row], y[row], v[row], y[row, 0:0])
                angle, rate = motion.coordinate[0], motion.coordinate[1]
                force = effort(joint, reals, integers, t[row], angle, rate, motion.feed[0])
                joints += (force - elastic_effort(joint, angle)) * rate
            for i in range(len(modes.damping)):
                damped -= modes.damping[i] * v[row, modes.first + i] ** 2
        out[row, 0], out[row, 1] = joints, damped
