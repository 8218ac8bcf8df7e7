"""Outward over equivalent rigid links that are anchored, at every instant, where the displaced links are.

Displacements of second order turn and move what stands outboard by finite amounts; counted from a rigid chain they
would have to be carried to every order (without the third, ω q² q̇ is missing from the kinetic energy). Each equivalent
rigid link is therefore anchored on the displaced interface of its parent, whose pose N(q_p) there is exact: the
displacement u of its frame is zero at every instant, and compatibility (ERLS-CMS paper, eq. 6) is about rates. With T
the change of frame over the joint and ν_N the twist that q̇_p makes of N, w = ν + u̇ is

    w_k = T_k(θ_k) (Ad(N⁻¹) w_p + ν_N) + S_k θ̇_k.

The anchors follow from the coordinates (θ, q_d), so that a state is what it was, and re-anchoring changes no pose and
no velocity.
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.records import (
    BEND_STATE,
    LINK,
    LINK_STATE,
    Chain,
    read_bend_state,
    read_link,
    read_link_state,
)
from erls.equations.serial.joints import move_joint
from erls.equations.serial.nodes import NODE, NODE_STATE, move_node, place_node, read_node, read_node_state
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    Serial,
    read_joint,
    read_joint_state,
    read_modes,
)
from erls.maths.jit import part
from erls.maths.products import copy
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, compose_poses, rotate_back, step_back, transform_motion
from fe_import.model import IntArray


@part
def place_anchored(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Joints, displaced interfaces, and the coordinates (0, q_d) of each link."""
    for k in range(serial.links):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        move_joint(serial, k, joint, motion, reals, integers, scratch, t, y, v, a)
        first = read_modes(reals, integers, serial.modes + k * MODES).first
        q = read_link_state(scratch, integers, chain.states + k * LINK_STATE).q
        for i in range(6):
            q[i] = 0.0
        for i in range(6, len(q)):
            q[i] = y[first + i - 6]
        seat = read_node(reals, integers, chain.seats + k * NODE)
        if seat.moves:
            modes = read_modes(reals, integers, serial.modes + seat.link * MODES)
            moved = read_node_state(scratch, integers, chain.seat_states + k * NODE_STATE)
            place_node(seat, moved, y[modes.first : modes.first + len(modes.stiffness)])


@part
def move_anchored(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Twists w of all link frames, and their derivatives at accelerations ``a``, or at zero ones where it is empty."""
    place_anchored(serial, chain, reals, integers, scratch, t, y, v, a)
    for k in range(serial.links):
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        first = read_modes(reals, integers, serial.modes + k * MODES).first
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        for i in range(6):
            state.q_rate[i] = state.q_acceleration[i] = 0.0
        for i in range(6, len(state.q)):
            state.q_rate[i] = v[first + i - 6]
            state.q_acceleration[i] = a[first + i - 6] if len(a) else 0.0
        twist, rate = state.twist, state.twist_rate
        if link.parent < 0:
            for i in range(6):
                twist[i], rate[i] = motion.twist[i], motion.twist_rate[i]
            rotate_back(motion.pose, serial.gravity, state.down)
        else:
            _leave(serial, chain, reals, integers, scratch, k, link.parent, v, a)
            transform_motion(motion.pose, twist, twist)
            transform_motion(motion.pose, rate, rate)
            add_motion_cross(twist, motion.twist, 1.0, rate)
            for i in range(6):
                twist[i] += motion.twist[i]
                rate[i] += motion.twist_rate[i]
            rotate_back(motion.pose, state.down, state.down)


@part
def _leave(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, parent: int, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Motion of the displaced interface on which joint k stands, in the place of that of link k."""
    state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
    before = read_link_state(scratch, integers, chain.states + parent * LINK_STATE)
    seat = read_node(reals, integers, chain.seats + k * NODE)
    if not seat.moves:
        for i in range(6):
            state.twist[i], state.twist_rate[i] = before.twist[i], before.twist_rate[i]
        for i in range(3):
            state.down[i] = before.down[i]
        return
    moved = read_node_state(scratch, integers, chain.seat_states + k * NODE_STATE)
    modes = read_modes(reals, integers, serial.modes + parent * MODES)
    first, last = modes.first, modes.first + len(modes.stiffness)
    move_node(seat, moved, v[first:last], a[first:last] if len(a) > 0 else a)
    transform_motion(moved.pose, before.twist, state.twist)
    transform_motion(moved.pose, before.twist_rate, state.twist_rate)
    rotate_back(moved.pose, before.down, state.down)
    add_motion_cross(state.twist, moved.twist, 1.0, state.twist_rate)
    for i in range(6):
        state.twist[i] += moved.twist[i]
        state.twist_rate[i] += moved.twist_rate[i]


@part
def set_pose(serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int) -> None:
    """``pose`` of `BendState`: displaced interface and joint."""
    pose = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose
    whole = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE).pose
    if read_node(reals, integers, chain.seats + k * NODE).moves:
        moved = read_node_state(scratch, integers, chain.seat_states + k * NODE_STATE)
        compose_poses(moved.pose, pose, whole)
    else:
        copy(pose, whole)


@part
def to_world(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, pose: Array, spare: Array,
    bends: Any,
) -> None:  # fmt: skip
    """A pose (12,) in the frame of link k becomes that in the world, after frames were moved."""
    while k >= 0:
        step = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose
        if bends is not None:
            set_pose(serial, chain, reals, integers, scratch, k)
            step = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE).pose
        step_back(step, pose, spare)
        k = read_link(reals, integers, chain.links + k * LINK).parent
