"""Stiffness and damping of links on joints: modes, springs, dampers, friction, controllers, on diagonals; contacts."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.serial.joints import gains
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    call_contact_gains,
    call_feed_forward,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """See `erls.equations.compiled_system`."""
    serial = read_serial(reals, integers, integers[0])
    k[:, :] = 0.0
    c[:, :] = 0.0
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    for number in range(serial.links):
        modes = read_modes(reals, integers, serial.modes + number * MODES)
        for i in range(len(modes.stiffness)):
            at = modes.first + i
            k[at, at], c[at, at] = modes.stiffness[i], modes.damping[i]
        joint = read_joint(reals, integers, serial.joints + number * JOINT)
        at = joint.place
        if at >= 0 and joint.acts:
            feed = read_joint_state(scratch, integers, serial.joint_states + number * JOINT_STATE).feed[0]
            k[at, at], c[at, at] = gains(joint, reals, integers, t, y[at], v[at], feed)
    if serial.contact_gains >= 0:
        call_contact_gains(serial.contact_gains, reals, integers, scratch, t, y, v, k, c)
