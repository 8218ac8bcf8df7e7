"""Loads on nodes of links, after the forces on each link alone; see `erls.equations.serial.loads`."""

from __future__ import annotations

from erls.equations.ffr.motion import to_world
from erls.equations.ffr.records import BODY_STATE, read_body_state, read_frames
from erls.equations.serial.loads import (
    LOAD,
    LOAD_STATE,
    LOADS,
    act,
    elastic_places,
    needs_world,
    read_load,
    read_load_state,
)
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel
from erls.maths.products import subtract
from erls.maths.so3 import Array
from erls.maths.spatial import set_identity
from fe_import.model import IntArray


@kernel(LOADS, counted=False)
def loads(
    at: int, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
) -> None:
    """Subtract what loads do from ``wrench`` of their links and from the forces on elastic coordinates."""
    serial = read_serial(reals, integers, at)
    frames = read_frames(reals, integers, serial.own)
    for number in range(serial.load_count):
        load = read_load(reals, integers, serial.load_records + number * LOAD)
        work = read_load_state(scratch, integers, serial.load_states + number * LOAD_STATE)
        state = read_body_state(scratch, integers, frames.body_states + load.link * BODY_STATE)
        first, last = elastic_places(serial, reals, integers, load.link, 0)
        begin, end = elastic_places(serial, reals, integers, max(load.reference, 0), 0)
        if needs_world(load):
            set_identity(work.pose)
            to_world(serial, frames, reals, integers, scratch, load.link, work.pose, work.spare)
            if load.reference >= 0:
                set_identity(work.other)
                to_world(serial, frames, reals, integers, scratch, load.reference, work.other, work.spare)
        turner = read_body_state(scratch, integers, frames.body_states + max(load.reference, 0) * BODY_STATE)
        motions = y[first:last], v[first:last], state.twist, y[begin:end], v[begin:end], turner.twist
        act(serial, at, reals, integers, scratch, number, t, *motions)
        subtract(work.wrench, state.wrench)
        subtract(work.forces, out[first:last])
