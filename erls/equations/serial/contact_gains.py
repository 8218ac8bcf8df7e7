"""Stiffness and damping of contacts on the independent coordinates.

With a row J of the rate of the gap over the velocities, a normal force F puts Jᵀ F on the coordinates. That is what a
residual changes by where the contact is asked for a unit force, so that no formulation says it twice; the stiffness is
∂F/∂δ JᵀJ, damping and friction are likewise. How rows turn with motion is left out, and that friction grows with depth.
"""

from __future__ import annotations

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import call_residual
from erls.equations.serial.contacts import CONTACT_STATE, GAP, read_contact_room, read_contact_state
from erls.equations.serial.records import Serial, read_serial
from erls.maths.jit import kernel, part
from erls.maths.so3 import Array
from fe_import.model import IntArray


@part
def _ask(serial: Serial, integers: IntArray, scratch: Array, number: int, x: float, y: float, z: float) -> None:
    """Ask one contact for a force along the axes of its plane, and all others for none."""
    for k in range(serial.contact_count):
        asked = read_contact_state(scratch, integers, serial.contact_states + k * CONTACT_STATE).asked
        asked[0], asked[1], asked[2], asked[3] = 1.0, 0.0, 0.0, 0.0
        if k == number:
            asked[1], asked[2], asked[3] = x, y, z


@part
def _add_gains(
    serial: Serial, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, number: int,
    k: Array, c: Array,
) -> None:  # fmt: skip
    """Of one contact, against the residual without any."""
    state = read_contact_state(scratch, integers, serial.contact_states + number * CONTACT_STATE)
    room = read_contact_room(scratch, integers, serial.contact_room)
    row, n, gains = room.row, len(v), state.gains
    along, across = state.slip[0], state.slip[1]
    speed = np.sqrt(along * along + across * across)
    if speed > 0.0:
        along, across = along / speed, across / speed
    else:
        along, across = 1.0, 0.0
    for direction in range(3):
        stiffness, damping = gains[0] if direction == 0 else gains[4], gains[1 + direction]
        if stiffness == 0.0 and damping == 0.0:
            continue
        if direction == 0:
            _ask(serial, integers, scratch, number, 1.0, 0.0, 0.0)
        elif direction == 1:
            _ask(serial, integers, scratch, number, 0.0, along, across)
        else:
            _ask(serial, integers, scratch, number, 0.0, -across, along)
        call_residual(serial.residual, reals, integers, scratch, t, y, v, v[0:0], row)
        for i in range(n):
            row[i] -= room.without[i]
        for i in range(n):
            for j in range(n):
                k[i, j] += stiffness * row[i] * row[j]
                c[i, j] += damping * row[i] * row[j]


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def contact_gains(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Add those of contacts; see `erls.equations.compiled_system`."""
    serial = read_serial(reals, integers, integers[0])
    without = read_contact_room(scratch, integers, serial.contact_room).without
    call_residual(serial.residual, reals, integers, scratch, t, y, v, v[0:0], without)
    touching = False
    for number in range(serial.contact_count):
        state = read_contact_state(scratch, integers, serial.contact_states + number * CONTACT_STATE)
        touching = touching or state.known[GAP] < 0.0
    if not touching:
        return
    _ask(serial, integers, scratch, -1, 0.0, 0.0, 0.0)
    call_residual(serial.residual, reals, integers, scratch, t, y, v, v[0:0], without)
    for number in range(serial.contact_count):
        state = read_contact_state(scratch, integers, serial.contact_states + number * CONTACT_STATE)
        if state.known[GAP] < 0.0:
            _add_gains(serial, reals, integers, scratch, t, y, v, number, k, c)
    for number in range(serial.contact_count):
        read_contact_state(scratch, integers, serial.contact_states + number * CONTACT_STATE).asked[0] = 0.0
