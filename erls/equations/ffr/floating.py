"""Links in floating frames that no joint holds, in absolute coordinates, as the functions of a compiled system.

A configuration q (c,) is the pose (12,) of every floating frame in the world, the elastic coordinates of all links and
the coordinates of all joints, which only count turns; velocities v (n,) are the twists of the frames, in their own
axes, and the rates of the elastic coordinates. Joints are conditions upon them (`erls.equations.loops`).
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.inertia import inertia_blocks, link_forces
from erls.equations.ffr.records import (
    BODY,
    BODY_STATE,
    END,
    Frames,
    call_bend_link,
    call_floating_loads,
    read_body,
    read_body_state,
    read_end,
    read_frames,
)
from erls.equations.ffr.segments import free_segment
from erls.equations.serial.ends import carry_end
from erls.equations.serial.nodes import (
    NODE,
    NODE_STATE,
    move_node,
    place_node,
    read_node,
    read_node_state,
    to_node_axes,
)
from erls.equations.serial.records import (
    MODES,
    Serial,
    call_contact_gains,
    call_feed_forward,
    read_modes,
    read_serial,
)
from erls.equations.serial.segments import SEGMENT, read_segment
from erls.maths.jit import kernel, part
from erls.maths.products import clear
from erls.maths.so3 import Array
from erls.maths.spatial import compose_poses, rotate_back, transform_motion
from fe_import.model import IntArray


@part
def elastic_at(serial: Serial, frames: Frames, reals: Array, integers: IntArray, k: int) -> int:
    """Place of a link's elastic coordinates among those of all links."""
    return int(read_modes(reals, integers, serial.modes + k * MODES).first - frames.free)


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f of links that nothing holds; an empty ``a`` stands for zeros."""
    serial = read_serial(reals, integers, integers[0])
    frames, links = read_frames(reals, integers, serial.own), serial.links
    for k in range(links):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        e, at = len(modes.stiffness), elastic_at(serial, frames, reals, integers, k)
        q, first = y[12 * links + at : 12 * links + at + e], 6 * links + at
        for i in range(6):
            state.twist[i] = v[6 * k + i]
            state.twist_rate[i] = a[6 * k + i] if len(a) > 0 else 0.0
        rotate_back(y[12 * k : 12 * k + 12], serial.gravity, state.gravity)
        if body.bent:
            call_bend_link(frames.bend_link, k, reals, integers, scratch, q)
        moved, forces = a[first : first + e] if len(a) > 0 else a, out[first : first + e]
        link_forces(frames, reals, integers, scratch, k, modes, q, v[first : first + e], moved, forces)
        for i in range(6):
            out[6 * k + i] = state.wrench[i]
    if serial.loads >= 0:
        call_floating_loads(serial.loads, integers[0], reals, integers, scratch, t, y, v, out)


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M: a block of every link."""
    serial = read_serial(reals, integers, integers[0])
    frames, links = read_frames(reals, integers, serial.own), serial.links
    out[:, :] = 0.0
    for k in range(links):
        body = read_body(reals, integers, frames.bodies + k * BODY)
        state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
        own = read_segment(scratch, integers, frames.segments + k * SEGMENT)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        e, at = len(modes.stiffness), elastic_at(serial, frames, reals, integers, k)
        q, first = y[12 * links + at : 12 * links + at + e], 6 * links + at
        if body.bent:
            call_bend_link(frames.bend_link, k, reals, integers, scratch, q)
        inertia_blocks(frames, body, state, q)
        free_segment(frames, reals, integers, scratch, k)
        for i in range(6):
            for j in range(6):
                out[6 * k + i, 6 * k + j] = own.inertia[i, j]
            for j in range(e):
                out[6 * k + i, first + j] = out[first + j, 6 * k + i] = own.coupling[i, j]
        for i in range(e):
            for j in range(e):
                total = modes.mass[i, j]
                for r in range(own.change.shape[0]):
                    total += (own.change[r, i] * own.partner[r, j] + own.partner[r, i] * own.change[r, j]) / 2
                out[first + i, first + j] = total


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Of the links' modes and of contacts."""
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    k[:, :] = 0.0
    c[:, :] = 0.0
    for number in range(serial.links):
        modes = read_modes(reals, integers, serial.modes + number * MODES)
        first = 6 * serial.links + elastic_at(serial, frames, reals, integers, number)
        for i in range(len(modes.stiffness)):
            k[first + i, first + i], c[first + i, first + i] = modes.stiffness[i], modes.damping[i]
    if serial.contact_gains >= 0:
        call_contact_gains(serial.contact_gains, reals, integers, scratch, t, y, v, k, c)


@part
def _put_end(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, number: int, y: Array, v: Array,
    found: Array,
) -> None:  # fmt: skip
    """Pose, twist, its derivative and rows of a frame on a node."""
    end, n, links = read_end(reals, integers, frames.ends + number * END), len(v), serial.links
    node = read_node(reals, integers, frames.nodes + end.node * NODE)
    moved = read_node_state(scratch, integers, frames.node_states + end.node * NODE_STATE)
    state = read_body_state(scratch, integers, frames.body_states + end.link * BODY_STATE)
    modes = read_modes(reals, integers, serial.modes + end.link * MODES)
    k, e = end.link, len(modes.stiffness)
    at = elastic_at(serial, frames, reals, integers, k)
    first, x, none = 6 * links + at, state.spare[:6], state.spare[6:]
    clear(none)
    if node.moves:
        place_node(node, moved, y[12 * links + at : 12 * links + at + e])
        move_node(node, moved, v[first : first + e], y[0:0])
    carry_end(moved.pose, moved.twist, moved.twist_rate, end.offset, v[6 * k : 6 * k + 6], none, found[:24])
    pose = state.spare  # 12 numbers
    for i in range(12):
        pose[i] = found[i]
    compose_poses(y[12 * k : 12 * k + 12], pose, found[:12])
    clear(found[24:])
    for j in range(6):
        clear(x)
        x[j] = 1.0
        transform_motion(moved.pose, x, x)
        transform_motion(end.offset, x, x)
        for i in range(6):
            found[24 + i * n + 6 * k + j] = x[i]
    if node.moves:
        for j in range(e):
            for i in range(6):
                x[i] = moved.rows[i, j]
            to_node_axes(moved.pose, moved.tangent, x)
            transform_motion(end.offset, x, x)
            for i in range(6):
                found[24 + i * n + first + j] = x[i]


@kernel(contract.FRAMES, counted=False)
def frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """Motion of the frames that joints hold, and what drives feed forward at this time."""
    serial = read_serial(reals, integers, integers[0])
    own = read_frames(reals, integers, serial.own)
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    for number in range(own.end_count):
        _put_end(serial, own, reals, integers, scratch, number, y, v, out[number])
