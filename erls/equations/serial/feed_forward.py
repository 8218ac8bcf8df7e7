"""Forces that the rigid mechanism needs for the wanted motion of all joints: recursive Newton-Euler."""

from __future__ import annotations

from erls.equations.serial.joints import step_pose
from erls.equations.serial.records import (
    FEED,
    JOINT,
    JOINT_STATE,
    RIGID_LINK,
    RIGID_STATE,
    read_joint,
    read_joint_state,
    read_rigid_link,
    read_rigid_state,
    read_serial,
)
from erls.equations.serial.time_curves import curve
from erls.maths.jit import kernel
from erls.maths.products import add_rows, clear
from erls.maths.so3 import Array
from erls.maths.spatial import add_force_cross, add_motion_cross, dot6, transform_force_back, transform_motion
from fe_import.model import IntArray


@kernel(FEED, counted=False)
def feed_forward(at: int, reals: Array, integers: IntArray, scratch: Array, t: float) -> None:
    """Into ``feed`` of every joint's state; the weight enters as an acceleration of the ground.

    ``at`` is the place of the `Serial`.
    """
    serial = read_serial(reals, integers, at)
    for k in range(serial.links):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        link = read_rigid_link(reals, integers, serial.rigid_links + k * RIGID_LINK)
        state = read_rigid_state(scratch, integers, serial.rigid_states + k * RIGID_STATE)
        twist, rate = state.twist, state.twist_rate
        coordinate, speed, acceleration = joint.held, 0.0 * joint.held, 0.0 * joint.held
        if joint.motion >= 0:
            coordinate, speed, acceleration = curve(reals, integers, joint.motion, t)
        step_pose(link.step, coordinate, state.pose)
        if link.parent < 0:
            clear(twist)
            clear(rate)
            for i in range(3):
                rate[i] = -serial.gravity[i]
            transform_motion(state.pose, rate, rate)
        else:
            before = read_rigid_state(scratch, integers, serial.rigid_states + link.parent * RIGID_STATE)
            transform_motion(state.pose, before.twist, twist)
            transform_motion(state.pose, before.twist_rate, rate)
        for i in range(6):
            twist[i] += link.screw[i] * speed
            rate[i] += link.screw[i] * acceleration
        add_motion_cross(link.screw, twist, -speed, rate)
        clear(state.momentum)
        clear(state.wrench)
        add_rows(link.mass, twist, 1.0, state.momentum)
        add_rows(link.mass, rate, 1.0, state.wrench)
        add_force_cross(twist, state.momentum, state.wrench)
        read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).feed[0] = joint.rotor * acceleration
    for k in range(serial.links - 1, -1, -1):
        link = read_rigid_link(reals, integers, serial.rigid_links + k * RIGID_LINK)
        state = read_rigid_state(scratch, integers, serial.rigid_states + k * RIGID_STATE)
        feed = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).feed
        feed[0] += dot6(link.screw, state.wrench)
        if link.parent >= 0:
            before = read_rigid_state(scratch, integers, serial.rigid_states + link.parent * RIGID_STATE)
            transform_force_back(state.pose, state.wrench, state.momentum)
            for i in range(6):
                before.wrench[i] += state.momentum[i]
