"""The conditions of all closing joints at a state: Φ, Φ̇, Φ̈ at zero accelerations, and Φ_y of those in use."""

from __future__ import annotations

import math
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as chain
from erls.equations.erls.motion import move_frames
from erls.equations.loops import layout as at
from erls.equations.loops.ends import move_end, place_links, pull_end
from erls.equations.serial.curves import curve
from erls.equations.serial.drives import effort, wanted
from erls.equations.serial.linear import add_bracket, carry, carry_back
from erls.maths.jit import ENABLED, kernel, part

CLOSURE: Any = None
if ENABLED:
    from numba import types as _t

    CLOSURE = _t.void(contract.REALS, contract.INTEGERS, contract.REALS, _t.float64, contract.REALS, contract.REALS)


@part
def _between(motion: Array) -> None:
    """Pose, twist and its derivative of the outer frame in the inner one."""
    outer, inner = motion[at.OUTER_END : at.OUTER_END + at.END], motion[at.INNER_END : at.INNER_END + at.END]
    found, carried = motion[at.BETWEEN : at.BETWEEN + at.LOCAL], motion[at.SPARE : at.SPARE + 6]
    for i in range(3):
        for j in range(3):
            found[3 * i + j] = inner[i] * outer[j] + inner[3 + i] * outer[3 + j] + inner[6 + i] * outer[6 + j]
        found[9 + i] = 0.0
        for j in range(3):
            found[9 + i] += inner[3 * j + i] * (outer[9 + j] - inner[9 + j])
    carry(found, inner, at.BIAS, carried, 0)
    for i in range(6):
        found[at.BIAS + i] = outer[at.BIAS + i] - carried[i]
    carry(found, inner, at.TWIST, carried, 0)
    for i in range(6):
        found[at.TWIST + i] = outer[at.TWIST + i] - carried[i]
    add_bracket(found, at.TWIST, carried, 0, 1.0, found, at.BIAS)


@part
def _less_prescribed(reals: Array, integers: IntArray, record: int, t: float, motion: Array) -> None:
    """LEFT: what is between the frames beside the prescribed coordinate, or all of it."""
    found, left = motion[at.BETWEEN : at.BETWEEN + at.LOCAL], motion[at.LEFT : at.LEFT + at.LOCAL]
    for i in range(at.LOCAL):
        left[i] = found[i]
    if integers[record + at.PRESCRIBED] < 0:
        return
    value, rate, acceleration = curve(integers, reals, integers[record + at.PRESCRIBED], t)
    value -= reals[integers[record + at.FREEDOM]]
    screw = motion[at.SPARE : at.SPARE + 6]
    for i in range(6):
        screw[i] = 0.0
    screw[integers[record + at.ALONG]] = 1.0
    if integers[record + at.ALONG] == 5:
        c, s = math.cos(value), math.sin(value)
        for j in range(3):
            left[j], left[3 + j] = c * found[j] + s * found[3 + j], c * found[3 + j] - s * found[j]
        left[9], left[10] = c * found[9] + s * found[10], c * found[10] - s * found[9]
    else:
        left[11] -= value
    carry(left, screw, 0, screw, 0)
    for i in range(6):
        left[at.TWIST + i] -= screw[i] * rate
        left[at.BIAS + i] -= screw[i] * acceleration
    add_bracket(left, at.TWIST, screw, 0, rate, left, at.BIAS)


@part
def _measure(reals: Array, integers: IntArray, scratch: Array, number: int, motion: Array) -> None:
    """Φ, Φ̇ and Φ̈ of a condition; FORCE gets its derivatives by the twist."""
    row = at.place(integers, at.ROWS) + at.ROW * number
    factors = at.place(integers, at.FACTORS) + 3 * number
    left, force = motion[at.LEFT : at.LEFT + at.LOCAL], motion[at.FORCE : at.FORCE + 6]
    twist = left[at.TWIST : at.TWIST + 6]
    w0, w1, w2 = twist[3], twist[4], twist[5]
    for i in range(6):
        force[i] = 0.0
    value = bend = 0.0
    line = integers[row + at.LINE]
    if line >= 0:
        r0, r1, r2 = left[3 * line], left[3 * line + 1], left[3 * line + 2]
        value = left[9 + line]
        force[0], force[1], force[2] = r0, r1, r2
        bend = r0 * (w1 * twist[2] - w2 * twist[1])
        bend += r1 * (w2 * twist[0] - w0 * twist[2]) + r2 * (w0 * twist[1] - w1 * twist[0])
    else:
        speed = w0 * w0 + w1 * w1 + w2 * w2
        for term in range(2):
            factor = reals[factors + term]
            i, j = integers[row + at.ENTRIES + 2 * term], integers[row + at.ENTRIES + 2 * term + 1]
            along = left[3 * i] * w0 + left[3 * i + 1] * w1 + left[3 * i + 2] * w2
            value += factor * left[3 * i + j]
            bend += factor * (along * twist[3 + j] - left[3 * i + j] * speed)
            # - r × e_j
            after, last = (j + 1) % 3, (j + 2) % 3
            force[3 + after] -= factor * left[3 * i + last]
            force[3 + last] += factor * left[3 * i + after]
    rate = 0.0
    for i in range(6):
        rate += force[i] * twist[i]
        bend += force[i] * left[at.BIAS + i]
    place, count = at.place(integers, at.VIOLATION) + number, at.place(integers, at.CONDITIONS)
    scratch[place], scratch[place + count], scratch[place + 2 * count] = value, rate, bend


@part
def _pull(reals: Array, integers: IntArray, scratch: Array, record: int, motion: Array, row: Array) -> None:
    """The force FORCE on the relative twist as one on the coordinates."""
    force, spare = motion[at.FORCE : at.FORCE + 6], motion[at.SPARE : at.SPARE + 18]
    for i in range(len(row)):
        row[i] = 0.0
    for i in range(6):
        spare[i] = force[i]
    outer = motion[at.OUTER_END : at.OUTER_END + at.END]
    link, place = integers[record + at.OUTER], integers[record + at.OUTER_AT]
    pull_end(reals, integers, scratch, link, place, outer, spare, row)
    carry_back(motion[at.BETWEEN : at.BETWEEN + 12], force, 0, spare, 0)
    for i in range(6):
        spare[i] = -spare[i]
    inner = motion[at.INNER_END : at.INNER_END + at.END]
    link, place = integers[record + at.INNER], integers[record + at.INNER_AT]
    pull_end(reals, integers, scratch, link, place, inner, spare, row)


@part
def _act(reals: Array, integers: IntArray, scratch: Array, number: int, t: float, motion: Array, n: int) -> None:
    """Coordinate of a closing joint, and what acts along it."""
    record = at.place(integers, at.RECORDS) + at.RECORD * number
    freedom, along = integers[record + at.FREEDOM], integers[record + at.ALONG]
    place = at.place(integers, at.EFFORTS) + number * (n + at.EFFORT)
    row, found = scratch[place : place + n], scratch[place + n : place + n + at.EFFORT]
    between = motion[at.BETWEEN : at.BETWEEN + at.LOCAL]
    value = between[11]
    if along == 5:
        angle = math.atan2(between[3] - between[1], between[0] + between[4])
        turned = -reals[freedom + 1]
        for k in range(integers[chain.LINKS]):
            memory = integers[chain.HEADER + k * chain.RECORD + chain.MEMORY]
            turned += reals[freedom + 2 + k] * scratch[memory + chain.ANGLE]
        value = angle + 2 * math.pi * math.floor((turned - angle) / (2 * math.pi) + 0.5)
    found[at.COORDINATE], found[at.RATE] = reals[freedom] + value, between[at.TWIST + along]
    found[at.TURNING] = between[at.BIAS + along]
    link = motion[at.SPARE - chain.ANGLE : at.MOTION]  # as if it were a joint of the chain
    link[chain.ANGLE], link[chain.ANGLE + 1] = found[at.COORDINATE], found[at.RATE]
    found[at.PUSH] = effort(reals, integers, integers[record + at.ACTS], t, link)
    found[at.WANTED] = wanted(reals, integers, integers[record + at.ACTS], t, link)
    for i in range(6):
        motion[at.FORCE + i] = 1.0 if i == along else 0.0
    _pull(reals, integers, scratch, record, motion, row)


@kernel(CLOSURE, counted=False)
def closure(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array) -> None:
    """Conditions and efforts of all loops into ``scratch``, where `layout` says."""
    move_frames(reals, integers, scratch, t, y, v, scratch[0:0])
    place_links(integers, scratch)
    n = len(y)
    for number in range(at.place(integers, at.LOOPS)):
        record = at.place(integers, at.RECORDS) + at.RECORD * number
        place = at.place(integers, at.MOTIONS) + at.MOTION * number
        motion = scratch[place : place + at.MOTION]
        spare = motion[at.SPARE : at.SPARE + 18]
        outer = motion[at.OUTER_END : at.OUTER_END + at.END]
        inner = motion[at.INNER_END : at.INNER_END + at.END]
        link, constants = integers[record + at.OUTER], integers[record + at.OUTER_AT]
        move_end(reals, integers, scratch, link, constants, outer, spare)
        link, constants = integers[record + at.INNER], integers[record + at.INNER_AT]
        move_end(reals, integers, scratch, link, constants, inner, spare)
        _between(motion)
        _less_prescribed(reals, integers, record, t, motion)
        first = integers[record + at.FIRST]
        for condition in range(first, first + integers[record + at.COUNT]):
            _measure(reals, integers, scratch, condition, motion)
            used = integers[at.place(integers, at.ROWS) + at.ROW * condition + at.PLACE]
            if used >= 0:
                row = at.place(integers, at.GRADIENT) + used * n
                _pull(reals, integers, scratch, record, motion, scratch[row : row + n])
        if integers[record + at.ACTS] >= 0:
            _act(reals, integers, scratch, number, t, motion, n)
