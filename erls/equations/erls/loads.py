"""Loads on nodes of links, after the forces on each link alone; see `erls.equations.serial.loads`."""

from __future__ import annotations

from erls.equations.erls.anchored_frames import to_world
from erls.equations.erls.records import LINK_STATE, Chain, read_chain, read_link_state
from erls.equations.serial.loads import LOAD, LOAD_STATE, LOADS, act, needs_world, read_load, read_load_state
from erls.equations.serial.records import Serial, read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import subtract
from erls.maths.so3 import Array
from erls.maths.spatial import set_identity
from fe_import.model import IntArray


@part
def _place(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, pose: Array, spare: Array
) -> None:
    """Pose of the frame of link k in the world."""
    set_identity(pose)
    if chain.bends >= 0:
        to_world(serial, chain, reals, integers, scratch, k, pose, spare, 0)
    else:
        to_world(serial, chain, reals, integers, scratch, k, pose, spare, None)


@kernel(LOADS, counted=False)
def loads(
    at: int, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
) -> None:
    """Subtract what loads do from ``wrench``, ``force`` and ``modal`` of their links; ``at`` is the place of the
    `Serial`.
    """
    serial = read_serial(reals, integers, at)
    chain = read_chain(reals, integers, serial.own)
    for number in range(serial.load_count):
        load = read_load(reals, integers, serial.load_records + number * LOAD)
        work = read_load_state(scratch, integers, serial.load_states + number * LOAD_STATE)
        state = read_link_state(scratch, integers, chain.states + load.link * LINK_STATE)
        turner = read_link_state(scratch, integers, chain.states + max(load.reference, 0) * LINK_STATE)
        if needs_world(load):
            _place(serial, chain, reals, integers, scratch, load.link, work.pose, work.spare)
            if load.reference >= 0:
                _place(serial, chain, reals, integers, scratch, load.reference, work.other, work.spare)
        motions = state.q, state.q_rate, state.twist, turner.q, turner.q_rate, turner.twist
        act(serial, at, reals, integers, scratch, number, t, *motions)
        subtract(work.wrench, state.wrench)
        subtract(work.forces, state.modal)
        subtract(work.forces[:6], state.force)
