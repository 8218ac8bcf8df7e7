"""Links as segments of `erls.equations.serial.segments`: μ is the twist of the frame behind the joint.

With ν' = Z μ + W η̇, the twist of the floating frame, corrected where displacements are of second order, is

    I = Zᵀ M Z,   B = Zᵀ (M W + C),   E = W,   F = M W + 2 C,

to which modal inertia adds E = K, F = 2 + σ⁻¹ K. Z is not 1 and W not 0 where the inboard node moves in the floating
frame or displacements are of second order.
"""

from __future__ import annotations

from typing import Any

from erls.equations.ffr.inertia import inertia_blocks
from erls.equations.ffr.motion import place_frames
from erls.equations.ffr.records import (
    BENT_STATE,
    BODY,
    BODY_STATE,
    BodyState,
    Frames,
    call_correct_arrival,
    read_bent_state,
    read_body,
    read_body_state,
)
from erls.equations.serial.modal_inertia_kernels import (
    WARP,
    WARP_STATE,
    read_warp,
    read_warp_state,
    set_warp,
    warp_rows,
)
from erls.equations.serial.nodes import NODE, NODE_STATE, NodeState, node_moves, read_node, read_node_state
from erls.equations.serial.records import (
    JOINT_STATE,
    MODES,
    Serial,
    read_joint_state,
    read_modes,
)
from erls.equations.serial.segments import SEGMENT, Segment, read_segment
from erls.maths.jit import part
from erls.maths.products import add_product, add_transposed_product, copy, copy_matrix
from erls.maths.so3 import Array
from erls.maths.spatial import transform_motion
from fe_import.model import IntArray


@part
def fill_segments(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array
) -> None:
    """All links, at a place."""
    place_frames(serial, frames, reals, integers, scratch, t, y, y, y[0:0])
    for number in range(frames.node_count):
        if read_node(reals, integers, frames.nodes + number * NODE).moves:
            node_moves(read_node_state(scratch, integers, frames.node_states + number * NODE_STATE))
    for k in range(serial.links):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        inner = read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE)
        inner_state = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
        own = read_segment(scratch, integers, frames.segments + k * SEGMENT)
        inertia_blocks(frames, body, state, y[modes.first : modes.first + len(modes.stiffness)])
        _arrival(inner.moves, inner_state, state)
        _reach(serial, frames, k, body.parent, state, own, reals, integers, scratch)
        _weights(frames, reals, integers, scratch, k, inner.moves)


@part
def _arrival(floats: Any, inner: NodeState, state: BodyState) -> None:
    """Z and W of the floating frame."""
    x = state.spare[:6]
    for j in range(6):
        for i in range(6):
            x[i] = 1.0 if i == j else 0.0
        if floats:
            transform_motion(inner.back, x, x)
        for i in range(6):
            state.arrival[i, j] = x[i]
    if floats:
        for j in range(state.carried.shape[1]):
            for i in range(6):
                x[i] = -inner.moves[i, j]
            transform_motion(inner.back, x, x)
            for i in range(6):
                state.carried[i, j] = x[i]


@part
def _reach(
    serial: Serial, frames: Frames, k: int, parent: int, state: BodyState, own: Segment, reals: Array,
    integers: IntArray, scratch: Array,
) -> None:  # fmt: skip
    """L, N and S."""
    joint = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
    pose = joint.pose
    for i in range(6):
        own.subspace[i] = joint.screw[i]
    if parent < 0:
        return
    base = read_node(reals, integers, frames.nodes + 2 * k * NODE)
    moved = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
    floats = read_node(reals, integers, frames.nodes + (2 * parent + 1) * NODE).moves
    before = read_body_state(scratch, integers, frames.body_states + parent * BODY_STATE)
    x = state.spare[:6]
    for j in range(6):
        for i in range(6):
            x[i] = before.arrival[i, j]
        if base.moves:
            transform_motion(moved.pose, x, x)
        transform_motion(pose, x, x)
        for i in range(6):
            own.lead[i, j] = x[i]
    if not (base.moves or floats):
        return
    for j in range(own.reach.shape[1]):
        for i in range(6):
            x[i] = before.carried[i, j]
        if base.moves:
            transform_motion(moved.pose, x, x)
            for i in range(6):
                x[i] += moved.moves[i, j]
        transform_motion(pose, x, x)
        for i in range(6):
            own.reach[i, j] = x[i]


@part
def _weights(
    frames: Frames, reals: Array, integers: IntArray, scratch: Array, k: int, floats: Any
) -> None:
    """I, B, E and F of link k."""
    body = read_body(reals, integers, frames.bodies + k * BODY)
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    bending = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
    own = read_segment(scratch, integers, frames.segments + k * SEGMENT)
    e = state.coupling.shape[1]
    if not (floats or body.bent):
        for i in range(6):
            for j in range(6):
                own.inertia[i, j] = state.inertia[i, j]
            for j in range(e):
                own.coupling[i, j] = state.coupling[i, j]
        return
    if body.bent:
        call_correct_arrival(frames.correct_arrival, k, reals, integers, scratch, floats)
    arrival = bending.arrival if body.bent else state.arrival
    carried = bending.carried if body.bent else state.carried
    for i in range(6):
        for j in range(6):
            own.inertia[i, j] = state.spare_inertia[i, j] = 0.0
        for j in range(e):
            state.spare_coupling[i, j], own.coupling[i, j] = state.coupling[i, j], 0.0
    add_product(state.inertia, arrival, state.spare_inertia)
    add_product(state.inertia, carried, state.spare_coupling)
    add_transposed_product(arrival, state.spare_inertia, own.inertia)
    add_transposed_product(arrival, state.spare_coupling, own.coupling)
    for i in range(6):
        for j in range(e):
            own.change[i, j] = carried[i, j]
            own.partner[i, j] = state.spare_coupling[i, j] + state.coupling[i, j]
    if body.warped:
        warp = read_warp(reals, integers, frames.warps + k * WARP)
        warp_state = read_warp_state(scratch, integers, frames.warp_states + k * WARP_STATE)
        set_warp(warp, warp_state, warp_state.q)
        warp_rows(warp, warp_state, own.change[6:], own.partner[6:])


@part
def free_segment(frames: Frames, reals: Array, integers: IntArray, scratch: Array, k: int) -> None:
    """I, B, E and F of link k over the twist of the floating frame itself."""
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    for i in range(6):
        for j in range(6):
            state.arrival[i, j] = 1.0 if i == j else 0.0
    _weights(frames, reals, integers, scratch, k, 0)


@part
def _combine(rows: Array, vectors: Array, out: Array) -> None:
    """Rows over elastic coordinates become rows over decoupled ones."""
    out[:, :] = 0.0
    add_product(rows, vectors, out)


@part
def decouple_segments(serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array) -> None:
    """The same segments in decoupled coordinates."""
    for k in range(serial.links):
        own = read_segment(scratch, integers, frames.segments + k * SEGMENT)
        out = read_segment(scratch, integers, frames.decoupled + k * SEGMENT)
        vectors = read_modes(reals, integers, serial.modes + k * MODES).decoupled
        copy(own.subspace, out.subspace)
        copy_matrix(own.inertia, out.inertia)
        _combine(own.coupling, vectors, out.coupling)
        _combine(own.change, vectors, out.change)
        _combine(own.partner, vectors, out.partner)
        if own.parent >= 0:
            copy_matrix(own.lead, out.lead)
            before = read_modes(reals, integers, serial.modes + own.parent * MODES).decoupled
            _combine(own.reach, before, out.reach)
