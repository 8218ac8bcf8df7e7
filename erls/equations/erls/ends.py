"""Motion of frames on displaced nodes of links, which loops hold; see `erls.equations.compiled_system`.

Rows of their twists over velocities are what unit forces on them do to the coordinates: these pass from link to parent
as all forces do.
"""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.erls.anchored_frames import move_anchored, to_world
from erls.equations.erls.balance import hand_back, push_joint
from erls.equations.erls.frames import move_frames
from erls.equations.erls.records import (
    LINK,
    LINK_STATE,
    Chain,
    read_chain,
    read_link,
    read_link_state,
)
from erls.equations.serial.ends import END, END_STATE, column_of, move_end, read_end, read_end_state
from erls.equations.serial.records import (
    MODES,
    Serial,
    read_modes,
    read_serial,
)
from erls.maths.jit import kernel, part
from erls.maths.products import clear
from erls.maths.so3 import Array
from erls.maths.spatial import transform_force_back
from fe_import.model import IntArray


@part
def _move_end(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, number: int, found: Array,
    bends: Any,
) -> None:  # fmt: skip
    """Pose, twist and its derivative into the first 24 numbers of ``found``."""
    end = read_end(reals, integers, chain.ends + number * END)
    moved = read_end_state(scratch, integers, chain.end_states + number * END_STATE)
    state = read_link_state(scratch, integers, chain.states + end.link * LINK_STATE)
    move_end(end, moved, state.q, state.q_rate, state.q_acceleration, state.twist, state.twist_rate, found[:24])
    to_world(serial, chain, reals, integers, scratch, end.link, found[:12], moved.spare, bends)


@part
def _put_row(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, number: int, i: int, n: int,
    row: Array, bends: Any,
) -> None:  # fmt: skip
    """What a unit force along component ``i`` of an end's twist does to the coordinates, prescribed ones last."""
    end = read_end(reals, integers, chain.ends + number * END)
    moved = read_end_state(scratch, integers, chain.end_states + number * END_STATE)
    force = moved.force
    clear(row)
    clear(force)
    force[i] = 1.0
    transform_force_back(end.offset, force, force)
    k = end.link
    while k >= 0:
        _clear_forces(chain, integers, scratch, k)
        k = read_link(reals, integers, chain.links + k * LINK).parent
    state = read_link_state(scratch, integers, chain.states + end.link * LINK_STATE)
    transform_force_back(moved.pose, force, state.wrench)
    for j in range(len(state.modal)):
        for m in range(6):
            state.modal[j] += force[m] * moved.rows[m, j]
    for j in range(6):
        state.force[j] = state.modal[j]
    k = end.link
    while k >= 0:
        modal = read_link_state(scratch, integers, chain.states + k * LINK_STATE).modal
        first = read_modes(reals, integers, serial.modes + k * MODES).first
        for j in range(len(modal) - 6):
            row[first + j] = modal[6 + j]
        row[column_of(serial, reals, integers, k, n)] = push_joint(serial, chain, reals, integers, scratch, k, bends)
        parent = read_link(reals, integers, chain.links + k * LINK).parent
        if parent >= 0:
            hand_back(serial, chain, reals, integers, scratch, k, bends)
        k = parent


@part
def _clear_forces(chain: Chain, integers: IntArray, scratch: Array, k: int) -> None:
    state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
    clear(state.wrench)
    clear(state.force)
    clear(state.modal)


@part
def put_frames(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array, bends: Any
) -> None:
    """Of all ends; ``bends`` as in `erls.equations.erls.balance`."""
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    if bends is None:
        move_frames(serial, chain, reals, integers, scratch, t, y, v, y[0:0])
    else:
        move_anchored(serial, chain, reals, integers, scratch, t, y, v, y[0:0])
    for number in range(chain.end_count):
        found = out[number]
        _move_end(serial, chain, reals, integers, scratch, number, found, bends)
        size = (len(found) - 24) // 6
        for i in range(6):
            row = found[24 + i * size : 24 + (i + 1) * size]
            _put_row(serial, chain, reals, integers, scratch, number, i, len(y), row, bends)


@kernel(contract.FRAMES, counted=False)
def frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """Motion of the frames that loops hold."""
    put_frames(reals, integers, scratch, t, y, v, out, None)
