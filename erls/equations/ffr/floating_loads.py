"""Loads on nodes of links that float freely (`erls.equations.ffr.floating`); see `erls.equations.serial.loads`."""

from __future__ import annotations

from erls.equations.ffr.records import read_frames
from erls.equations.serial.loads import LOAD, LOAD_STATE, LOADS, act, elastic_places, read_load, read_load_state
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel
from erls.maths.products import copy, subtract
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(LOADS, counted=False)
def floating_loads(
    at: int, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
) -> None:
    """Subtract what loads do from the forces on twists and elastic coordinates of their links."""
    serial = read_serial(reals, integers, at)
    free = read_frames(reals, integers, serial.own).free
    in_y, in_v = 12 * serial.links - free, 6 * serial.links - free
    for number in range(serial.load_count):
        load = read_load(reals, integers, serial.load_records + number * LOAD)
        work = read_load_state(scratch, integers, serial.load_states + number * LOAD_STATE)
        k, reference = load.link, max(load.reference, 0)
        first, last = elastic_places(serial, reals, integers, k, in_y)
        begin, end = elastic_places(serial, reals, integers, reference, in_y)
        low, high = elastic_places(serial, reals, integers, k, in_v)
        copy(y[12 * k : 12 * k + 12], work.pose)
        copy(y[12 * reference : 12 * reference + 12], work.other)
        since, until = elastic_places(serial, reals, integers, reference, in_v)
        motion = y[first:last], v[low:high], v[6 * k : 6 * k + 6]
        other = y[begin:end], v[since:until], v[6 * reference : 6 * reference + 6]
        act(serial, at, reals, integers, scratch, number, t, *motion, *other)
        subtract(work.wrench, out[6 * k : 6 * k + 6])
        subtract(work.forces, out[low:high])
