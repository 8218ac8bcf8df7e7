"""Motion of frames on displaced nodes of links, which loops hold; see `erls.equations.compiled_system`.

Rows of their twists over velocities are what unit forces on them do to the coordinates: these pass from link to parent
as all forces do.
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.motion import move_frames, to_world
from erls.equations.ffr.records import (
    BODY,
    BODY_STATE,
    END,
    EndRoom,
    Frames,
    read_body,
    read_body_state,
    read_end,
    read_end_room,
    read_frames,
)
from erls.equations.ffr.residual import hand_back, pass_joint, pull_node
from erls.equations.serial.ends import carry_end, column_of
from erls.equations.serial.nodes import NODE, NODE_STATE, move_node, place_node, read_node, read_node_state
from erls.equations.serial.records import MODES, Serial, read_modes, read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import clear
from erls.maths.so3 import Array
from erls.maths.spatial import transform_force_back
from fe_import.model import IntArray


@part
def _move_end(
    serial: Serial, frames: Frames, room: EndRoom, reals: Array, integers: IntArray, scratch: Array, number: int,
    y: Array, v: Array, found: Array,
) -> None:  # fmt: skip
    """Pose, twist and its derivative into the first 24 numbers of ``found``."""
    end = read_end(reals, integers, frames.ends + number * END)
    node = read_node(reals, integers, frames.nodes + end.node * NODE)
    moved = read_node_state(scratch, integers, frames.node_states + end.node * NODE_STATE)
    state = read_body_state(scratch, integers, frames.body_states + end.link * BODY_STATE)
    if node.moves:
        modes = read_modes(reals, integers, serial.modes + end.link * MODES)
        first, last = modes.first, modes.first + len(modes.stiffness)
        place_node(node, moved, y[first:last])
        move_node(node, moved, v[first:last], y[0:0])
    carry_end(moved.pose, moved.twist, moved.twist_rate, end.offset, state.twist, state.twist_rate, found)
    to_world(serial, frames, reals, integers, scratch, end.link, found[:12], room.pose)


@part
def _put_row(
    serial: Serial, frames: Frames, room: EndRoom, reals: Array, integers: IntArray, scratch: Array, number: int,
    i: int, n: int, row: Array,
) -> None:  # fmt: skip
    """What a unit force along component ``i`` of an end's twist does to the coordinates, prescribed ones last."""
    end = read_end(reals, integers, frames.ends + number * END)
    moved = read_node_state(scratch, integers, frames.node_states + end.node * NODE_STATE)
    force, k = room.force, end.link
    clear(row)
    clear(force)
    force[i] = 1.0
    transform_force_back(end.offset, force, force)
    while k >= 0:
        clear(read_body_state(scratch, integers, frames.body_states + k * BODY_STATE).wrench)
        k = read_body(reals, integers, frames.bodies + k * BODY).parent
    if read_node(reals, integers, frames.nodes + end.node * NODE).moves:
        modes = read_modes(reals, integers, serial.modes + end.link * MODES)
        pulled = row[modes.first : modes.first + len(modes.stiffness)]
        pull_node(moved.rows, moved.pose, moved.tangent, force, 1.0, room.spare, pulled)
    wrench = read_body_state(scratch, integers, frames.body_states + end.link * BODY_STATE).wrench
    transform_force_back(moved.pose, force, wrench)
    k = end.link
    while k >= 0:
        row[column_of(serial, reals, integers, k, n)] = pass_joint(serial, frames, reals, integers, scratch, k, row)
        parent = read_body(reals, integers, frames.bodies + k * BODY).parent
        if parent >= 0:
            hand_back(serial, frames, reals, integers, scratch, k, parent, row)
        k = parent


@kernel(contract.FRAMES, counted=False)
def frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """Motion of the frames that loops hold."""
    serial = read_serial(reals, integers, integers[0])
    own = read_frames(reals, integers, serial.own)
    room = read_end_room(scratch, integers, own.end_room)
    move_frames(serial, own, reals, integers, scratch, t, y, v, y[0:0])
    for number in range(own.end_count):
        found = out[number]
        _move_end(serial, own, room, reals, integers, scratch, number, y, v, found)
        size = (len(found) - 24) // 6
        for i in range(6):
            row = found[24 + i * size : 24 + (i + 1) * size]
            _put_row(serial, own, room, reals, integers, scratch, number, i, len(y), row)
