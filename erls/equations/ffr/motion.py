"""Outward: nodes, poses, twists and their rates of all floating frames.

From the floating frame of a link its displaced node follows, from that the frame behind the joint that stands on it,
from that, displaced by its inboard node, the floating frame of the next link: three changes of frame, ν' = Ad⁻¹ν + ξ.
"""

from __future__ import annotations

from erls.equations.ffr.records import BODY, BODY_STATE, BodyState, Frames, call_bend_link, read_body, read_body_state
from erls.equations.serial.joints import move_joint
from erls.equations.serial.nodes import (
    NODE,
    NODE_STATE,
    Node,
    NodeState,
    move_node,
    place_node,
    read_node,
    read_node_state,
)
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
from erls.maths.products import clear
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, rotate_back, step_back, transform_motion
from fe_import.model import IntArray


@part
def place_frames(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Joint coordinates, and the poses of all joints and nodes."""
    for k in range(serial.links):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        moved = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        move_joint(serial, k, joint, moved, reals, integers, scratch, t, y, v, a)
        if read_body(reals, integers, frames.bodies + k * BODY).bent:
            modes = read_modes(reals, integers, serial.modes + k * MODES)
            q = y[modes.first : modes.first + len(modes.stiffness)]
            call_bend_link(frames.bend_link, k, reals, integers, scratch, q)
    for number in range(frames.node_count):
        node = read_node(reals, integers, frames.nodes + number * NODE)
        if node.moves:
            state = read_node_state(scratch, integers, frames.node_states + number * NODE_STATE)
            modes = read_modes(reals, integers, serial.modes + node.link * MODES)
            place_node(node, state, y[modes.first : modes.first + len(modes.stiffness)])


@part
def move_frames(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """Motion of all frames at accelerations θ̈, η̈; at zero ones of what is free where ``a`` is empty."""
    place_frames(serial, frames, reals, integers, scratch, t, y, v, a)
    for number in range(frames.node_count):
        node = read_node(reals, integers, frames.nodes + number * NODE)
        if node.moves:
            displaced = read_node_state(scratch, integers, frames.node_states + number * NODE_STATE)
            modes = read_modes(reals, integers, serial.modes + node.link * MODES)
            first, last = modes.first, modes.first + len(modes.stiffness)
            move_node(node, displaced, v[first:last], a[first:last] if len(a) > 0 else a)
    for k in range(serial.links):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        moved = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        base = read_node(reals, integers, frames.nodes + 2 * k * NODE)
        base_state = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
        inner = read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE)
        inner_state = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
        if body.parent < 0:
            clear(state.twist)
            clear(state.twist_rate)
            rotate_back(moved.pose, serial.gravity, state.gravity)
        else:
            before = read_body_state(scratch, integers, frames.body_states + body.parent * BODY_STATE)
            _leave(base, base_state, before, state)
            transform_motion(moved.pose, state.twist, state.twist)
            transform_motion(moved.pose, state.twist_rate, state.twist_rate)
            rotate_back(moved.pose, state.gravity, state.gravity)
        _turn_joint(moved, state.twist, state.twist_rate, state.arrived)
        if inner.moves:
            _arrive(inner_state, state)


@part
def _turn_joint(moved: JointState, twist: Array, rate: Array, arrived: Array) -> None:
    """Over a joint: ν + S θ̇, and its rate."""
    add_motion_cross(twist, moved.twist, 1.0, rate)
    for i in range(6):
        twist[i] += moved.twist[i]
        rate[i] += moved.twist_rate[i]
        arrived[i] = twist[i]


@part
def _leave(node: Node, moved: NodeState, before: BodyState, state: BodyState) -> None:
    """Motion of the node that a joint stands on, from the floating frame ``before``."""
    twist, rate, gravity = state.twist, state.twist_rate, state.gravity
    if not node.moves:
        for i in range(6):
            twist[i], rate[i] = before.twist[i], before.twist_rate[i]
        for i in range(3):
            gravity[i] = before.gravity[i]
        return
    transform_motion(moved.pose, before.twist, twist)
    transform_motion(moved.pose, before.twist_rate, rate)
    rotate_back(moved.pose, before.gravity, gravity)
    add_motion_cross(twist, moved.twist, 1.0, rate)
    for i in range(6):
        twist[i] += moved.twist[i]
        rate[i] += moved.twist_rate[i]


@part
def _arrive(inner: NodeState, state: BodyState) -> None:
    """From the inboard node to the floating frame in which it moves."""
    twist, rate = state.twist, state.twist_rate
    for i in range(6):
        rate[i] -= inner.twist_rate[i]
    add_motion_cross(twist, inner.twist, -1.0, rate)
    for i in range(6):
        twist[i] -= inner.twist[i]
    transform_motion(inner.back, twist, twist)
    transform_motion(inner.back, rate, rate)
    rotate_back(inner.back, state.gravity, state.gravity)


@part
def to_world(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, k: int, pose: Array, spare: Array
) -> None:
    """A pose (12,) in the floating frame of link k becomes that in the world."""
    while k >= 0:
        if read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE).moves:
            inner = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
            step_back(inner.back, pose, spare)
        step_back(read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose, pose, spare)
        if read_node(reals, integers, frames.nodes + 2 * k * NODE).moves:
            base = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
            step_back(base.pose, pose, spare)
        k = read_body(reals, integers, frames.bodies + k * BODY).parent
