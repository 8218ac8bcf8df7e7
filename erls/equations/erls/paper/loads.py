"""Loads on nodes of links: eq. (64)-(67) of the paper; see `erls.equations.serial.loads`."""

from __future__ import annotations

from erls.equations.erls.paper.records import BODY_STATE, read_body_state, read_paper
from erls.equations.serial.loads import LOAD, LOAD_STATE, LOADS, act, read_load, read_load_state
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel
from erls.maths.products import copy, subtract
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(LOADS, counted=False)
def loads(
    at: int, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
) -> None:
    """Subtract what loads do from the ``force`` of their links on (ν, q̇)."""
    serial = read_serial(reals, integers, at)
    paper = read_paper(reals, integers, serial.own)
    for number in range(serial.load_count):
        load = read_load(reals, integers, serial.load_records + number * LOAD)
        work = read_load_state(scratch, integers, serial.load_states + number * LOAD_STATE)
        state = read_body_state(scratch, integers, paper.body_states + load.link * BODY_STATE)
        turner = read_body_state(scratch, integers, paper.body_states + max(load.reference, 0) * BODY_STATE)
        copy(state.world, work.pose)
        copy(turner.world, work.other)
        own, other = state.velocity, turner.velocity
        motions = state.q, own[6:], own[:6], turner.q, other[6:], other[:6]
        act(serial, at, reals, integers, scratch, number, t, *motions)
        subtract(work.wrench, state.force[:6])
        subtract(work.forces, state.force[6:])
