"""Forces out of balance on the independent coordinates: outward for the motion, inward for the wrenches.

Recursive Newton-Euler; what it leaves in the records (poses, twists, wrenches, efforts) is what runs report.
"""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.ffr.inertia import link_forces
from erls.equations.ffr.motion import move_frames
from erls.equations.ffr.records import (
    BODY,
    BODY_STATE,
    Frames,
    call_loads,
    read_body,
    read_body_state,
    read_frames,
)
from erls.equations.serial.joints import effort
from erls.equations.serial.nodes import NODE, NODE_STATE, from_node_axes, read_node, read_node_state
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    Serial,
    call_feed_forward,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.maths.jit import kernel, part
from erls.maths.products import add_columns
from erls.maths.so3 import Array
from erls.maths.spatial import dot6, transform_force_back
from fe_import.model import IntArray


@part
def pull_node(
    rows: Array, pose: Array, tangent: Array, wrench: Array, factor: float, spare: Array, forces: Array
) -> None:
    """Add to the forces on η the factor times what a wrench on a node, in its axes, does there."""
    from_node_axes(pose, tangent, wrench, spare)
    add_columns(rows, spare, factor, forces)


@part
def pass_joint(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, k: int, forces: Array
) -> Any:
    """Force along a joint by the wrench on a link's floating frame, which goes to the frame behind the joint.

    What it does on the way to the link's elastic coordinates is added to ``forces`` on all coordinates.
    """
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    inner = read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE)
    borne = state.borne
    for i in range(6):
        borne[i] = state.wrench[i]
    if inner.moves:
        moved = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        pulled = forces[modes.first : modes.first + len(modes.stiffness)]
        transform_force_back(moved.back, borne, borne)
        pull_node(moved.rows, moved.pose, moved.tangent, borne, -1.0, state.spare[:6], pulled)
    return dot6(read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).screw, borne)


@part
def hand_back(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, k: int, parent: int, forces: Array
) -> None:
    """The wrench on the frame behind a joint goes on to the floating frame of the parent, after `pass_joint`."""
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    before = read_body_state(scratch, integers, frames.body_states + parent * BODY_STATE)
    base = read_node(reals, integers, frames.nodes + 2 * k * NODE)
    passed = state.spare[6:]
    pose = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose
    transform_force_back(pose, state.borne, passed)
    if base.moves:
        moved = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
        modes = read_modes(reals, integers, serial.modes + parent * MODES)
        pulled = forces[modes.first : modes.first + len(modes.stiffness)]
        pull_node(moved.rows, moved.pose, moved.tangent, passed, 1.0, state.spare[:6], pulled)
        transform_force_back(moved.pose, passed, passed)
    for i in range(6):
        before.wrench[i] += passed[i]


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f, see `erls.equations.compiled_system`; an empty ``a`` stands for zeros, with which nothing is
    multiplied then.
    """
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    move_frames(serial, frames, reals, integers, scratch, t, y, v, a)
    for k in range(serial.links):
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        first, last = modes.first, modes.first + len(modes.stiffness)
        q, rates, accelerations = y[first:last], v[first:last], a[first:last] if len(a) > 0 else a
        link_forces(frames, reals, integers, scratch, k, modes, q, rates, accelerations, out[first:last])
    if serial.loads >= 0:
        call_loads(serial.loads, integers[0], reals, integers, scratch, t, y, v, out)
    for k in range(serial.links - 1, -1, -1):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        moved = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        turning, forces = moved.coordinate, moved.forces
        forces[1] = 0.0
        if joint.acts:
            forces[1] = effort(joint, reals, integers, t, turning[0], turning[1], moved.feed[0])
        along = pass_joint(serial, frames, reals, integers, scratch, k, out)
        forces[0] = along + joint.rotor * turning[2] - forces[1]
        if joint.place >= 0:
            out[joint.place] = forces[0]
        parent = read_body(reals, integers, frames.bodies + k * BODY).parent
        if parent >= 0:
            hand_back(serial, frames, reals, integers, scratch, k, parent, out)
