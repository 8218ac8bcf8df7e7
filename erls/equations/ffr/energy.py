"""Kinetic, elastic, gravity and spring energy; see `erls.equations.compiled_system`."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.motion import move_frames
from erls.equations.ffr.records import (
    BENT_STATE,
    BODY,
    BODY_STATE,
    read_bent_state,
    read_body,
    read_body_state,
    read_frames,
)
from erls.equations.ffr.segments import fill_segments
from erls.equations.serial.elastic import elastic_energy
from erls.equations.serial.joints import joint_energy
from erls.equations.serial.nodes import NODE, NODE_STATE, read_node, read_node_state
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.equations.serial.segments import SEGMENT, read_segment
from erls.maths.jit import kernel
from erls.maths.products import add_rows, dot
from erls.maths.so3 import Array
from erls.maths.spatial import dot3, rotate_back
from fe_import.model import IntArray


@kernel(contract.ENERGY, counted=False)
def energy(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """``out`` (4,): kinetic with rotors, elastic of links, gravity, springs in joints [J].

    Kinetic energy is the quadratic form of `erls.equations.serial.segments`.
    """
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    fill_segments(serial, frames, reals, integers, scratch, t, y)
    move_frames(serial, frames, reals, integers, scratch, t, y, v, y[0:0])
    out[:] = 0.0
    for k in range(serial.links):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        own = read_segment(scratch, integers, frames.segments + k * SEGMENT)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        turning = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        first, last = modes.first, modes.first + len(modes.stiffness)
        q, rates = y[first:last], v[first:last]
        for i in range(6):
            out[0] += state.arrived[i] * (dot(own.inertia[i], state.arrived) / 2 + dot(own.coupling[i], rates))
        for i in range(len(rates)):
            out[0] += rates[i] * dot(modes.mass[i], rates) / 2
            out[1] += elastic_energy(modes.stiffness[i], q[i], modes.rest[i])
        for r in range(own.change.shape[0]):
            out[0] += dot(own.change[r], rates) * dot(own.partner[r], rates) / 2
        out[0] += joint.rotor * turning.coordinate[1] ** 2 / 2
        out[3] += joint_energy(joint, turning.coordinate[0])
        # g · place of the frame, from link to link
        height, gravity = state.spare, state.spare[9:]
        height[0] = 0.0
        for i in range(3):
            gravity[i] = serial.gravity[i]
        if body.parent >= 0:
            before = read_body_state(scratch, integers, frames.body_states + body.parent * BODY_STATE)
            height[0] = before.spare[0]
            for i in range(3):
                gravity[i] = before.gravity[i]
        if read_node(reals, integers, frames.nodes + 2 * k * NODE).moves:
            base = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
            height[0] += dot3(gravity, base.pose[9:])
            rotate_back(base.pose, gravity, gravity)
        height[0] += dot3(gravity, turning.pose[9:])
        rotate_back(turning.pose, gravity, gravity)
        if read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE).moves:
            inner = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
            height[0] += dot3(gravity, inner.back[9:])
        moment = state.moment
        for i in range(3):
            moment[i] = body.moment[i]
        add_rows(body.coupling[:3], q, 1.0, moment)
        if body.bent:
            bent = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
            for i in range(3):
                moment[i] += bent.moment[i]
        out[2] -= body.mass * height[0] + dot3(state.gravity, moment)
