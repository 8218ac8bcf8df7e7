"""Forces out of balance on the independent coordinates: outward for the motion, inward for the wrenches.

Recursive Newton-Euler; what it leaves in the records (poses, twists, wrenches, efforts) is what runs report.
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.inertia import link_forces
from erls.equations.ffr.motion import move_frames
from erls.equations.ffr.nodes import from_node_axes
from erls.equations.ffr.records import (
    BENT_BODY,
    BENT_STATE,
    BODY,
    BODY_STATE,
    NODE,
    NODE_STATE,
    read_bent_body,
    read_bent_state,
    read_body,
    read_body_state,
    read_frames,
    read_node,
    read_node_state,
)
from erls.equations.serial.feed_forward import feed_forward
from erls.equations.serial.joints import effort
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
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
def _pull_node(
    rows: Array, pose: Array, tangent: Array, wrench: Array, factor: float, spare: Array, forces: Array
) -> None:
    """Add to the forces on η the factor times what a wrench on a node, in its axes, does there."""
    from_node_axes(pose, tangent, wrench, spare)
    add_columns(rows, spare, factor, forces)


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f, see `erls.equations.compiled_system`; an empty ``a`` stands for zeros, with which nothing is
    multiplied then.
    """
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    if serial.feeds:
        feed_forward(serial, reals, integers, scratch, t)
    move_frames(serial, frames, reals, integers, scratch, t, y, v, a)
    for k in range(serial.links):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        bent = read_bent_body(reals, integers, frames.bent_bodies + k * BENT_BODY)
        bending = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        first, last = modes.first, modes.first + len(modes.stiffness)
        q, rates, accelerations = y[first:last], v[first:last], a[first:last] if len(a) > 0 else a
        link_forces(frames, body, bent, modes, state, bending, q, rates, accelerations, out[first:last])
    for k in range(serial.links - 1, -1, -1):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        moved = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        base = read_node(reals, integers, frames.nodes + 2 * k * NODE)
        base_state = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
        inner = read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE)
        inner_state = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
        borne, spare = state.borne, state.spare[:6]
        for i in range(6):
            borne[i] = state.wrench[i]
        if inner.moves:
            modes = read_modes(reals, integers, serial.modes + k * MODES)
            pulled = out[modes.first : modes.first + len(modes.stiffness)]
            transform_force_back(inner_state.back, borne, borne)
            _pull_node(inner_state.rows, inner_state.pose, inner_state.tangent, borne, -1.0, spare, pulled)
        turning, forces = moved.coordinate, moved.forces
        forces[1] = 0.0
        if joint.acts:
            forces[1] = effort(joint, reals, integers, t, turning[0], turning[1], moved.feed[0])
        forces[0] = dot6(moved.screw, borne) + joint.rotor * turning[2] - forces[1]
        if joint.place >= 0:
            out[joint.place] = forces[0]
        if body.parent >= 0:
            before = read_body_state(scratch, integers, frames.body_states + body.parent * BODY_STATE)
            passed = state.spare[6:]
            transform_force_back(moved.pose, borne, passed)
            if base.moves:
                modes = read_modes(reals, integers, serial.modes + body.parent * MODES)
                pulled = out[modes.first : modes.first + len(modes.stiffness)]
                _pull_node(base_state.rows, base_state.pose, base_state.tangent, passed, 1.0, spare, pulled)
                transform_force_back(base_state.pose, passed, passed)
            for i in range(6):
                before.wrench[i] += passed[i]
