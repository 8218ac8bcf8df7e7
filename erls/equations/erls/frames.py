"""Outward: poses, twists and displacements of all link frames.

Rigid motions pass through joints as twists do, so compatibility reads

    u_k = T_k(θ_k) (u_p + C_p q_d,p),   ν_k = T_k(θ_k) ν_p + S_k θ̇_k,

with p the parent of link k, T the change of frame and C constant: what the parent's interface moves, seen as a motion
of its frame. A joint turns the displacement along: T' = -ad(S) T.
"""

from __future__ import annotations

from erls.equations.erls.records import LINK, LINK_STATE, Chain, read_link, read_link_state
from erls.equations.serial.joints import move_joint
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    JointState,
    Serial,
    read_joint,
    read_joint_state,
    read_modes,
)
from erls.maths.jit import part
from erls.maths.products import add_columns, clear
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, rotate_back, transform_motion
from fe_import.model import IntArray


@part
def _interface(pose: Array, x: Array, out_columns: Array, elastic: Array, result: Array) -> None:
    """T (x + C x_d)."""
    for i in range(6):
        result[i] = x[i]
    add_columns(out_columns, elastic, 1.0, result)
    transform_motion(pose, result, result)


@part
def place_frames(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Poses and displacements of all link frames, with the coordinates (u, q_d) of each link beside each other."""
    for k in range(serial.links):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        first = read_modes(reals, integers, serial.modes + k * MODES).first
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        move_joint(serial, k, joint, motion, reals, integers, scratch, t, y, v, a)
        u, q = state.u, state.q
        for i in range(6, len(q)):
            q[i] = y[first + i - 6]
        if link.parent < 0:
            clear(u)
        else:
            before = read_link_state(scratch, integers, chain.states + link.parent * LINK_STATE)
            _interface(motion.pose, before.u, link.out, before.q[6:], u)
        for i in range(6):
            q[i] = u[i]


@part
def move_frames(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Twists and displacement rates of all link frames, at accelerations ``a``, or at zero ones where it is empty."""
    place_frames(serial, chain, reals, integers, scratch, t, y, v, a)
    for k in range(serial.links):
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        first = read_modes(reals, integers, serial.modes + k * MODES).first
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        pose = motion.pose
        qd, qdd = state.q_rate, state.q_acceleration
        for i in range(6, len(qd)):
            qd[i] = v[first + i - 6]
            qdd[i] = a[first + i - 6] if len(a) else 0.0
        if link.parent < 0:
            for i in range(6):
                state.twist[i], state.twist_rate[i] = motion.twist[i], motion.twist_rate[i]
            clear(state.u_rate)
            clear(state.u_acceleration)
            rotate_back(pose, serial.gravity, state.down)
        else:
            before = read_link_state(scratch, integers, chain.states + link.parent * LINK_STATE)
            transform_motion(pose, before.twist, state.twist)
            transform_motion(pose, before.twist_rate, state.twist_rate)
            for i in range(6):
                state.twist[i] += motion.twist[i]
                state.twist_rate[i] += motion.twist_rate[i]
            add_motion_cross(motion.twist, state.twist, -1.0, state.twist_rate)
            _interface(pose, before.u_rate, link.out, before.q_rate[6:], state.u_rate)
            if len(a):
                _interface(pose, before.u_acceleration, link.out, before.q_acceleration[6:], state.u_acceleration)
            else:
                transform_motion(pose, before.u_acceleration, state.u_acceleration)
            turn_along(state.u, state.u_rate, state.u_acceleration, motion)
            rotate_back(pose, before.down, state.down)
        for i in range(6):
            qd[i], qdd[i] = state.u_rate[i], state.u_acceleration[i]


@part
def turn_along(x: Array, x_rate: Array, x_acceleration: Array, motion: JointState) -> None:
    """Derivatives of T(θ) x that change with the joint, added to those of x alone."""
    add_motion_cross(motion.twist, x_rate, -1.0, x_acceleration)
    add_motion_cross(motion.twist, x, -1.0, x_rate)
    add_motion_cross(motion.twist, x_rate, -1.0, x_acceleration)
    add_motion_cross(motion.twist_rate, x, -1.0, x_acceleration)
