"""Frames on displaced nodes of links: where they go, and what forces on them do to the coordinates.

A node turns by Cayley's rotation of its rotation vector φ, as in `erls.equations.serial.displaced_frame`.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as chain
from erls.equations.loops import layout as at
from erls.equations.serial.linear import add_bracket, carry, carry_back, dot6
from erls.maths.jit import part


@part
def compose(first: Array, second: Array, out: Array) -> None:
    """Product of two poses (12,); ``out`` is neither."""
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = (
                first[3 * i] * second[j] + first[3 * i + 1] * second[3 + j] + first[3 * i + 2] * second[6 + j]
            )
        out[9 + i] = first[9 + i]
        for j in range(3):
            out[9 + i] += first[3 * i + j] * second[9 + j]


@part
def place_links(integers: IntArray, scratch: Array) -> None:
    """Poses of all link frames in the world."""
    start = at.place(integers, at.WORLD)
    for k in range(integers[chain.LINKS]):
        memory = integers[chain.HEADER + k * chain.RECORD + chain.MEMORY]
        step, world = scratch[memory : memory + 12], scratch[start + 12 * k : start + 12 * k + 12]
        if k == 0:
            for i in range(12):
                world[i] = step[i]
        else:
            compose(scratch[start + 12 * k - 12 : start + 12 * k], step, world)


@part
def move_end(reals: Array, integers: IntArray, scratch: Array, link: int, place: int, end: Array, spare: Array) -> None:
    """Motion of the frame whose constants start at ``place``, from that of its link."""
    if link < 0:
        for i in range(12):
            end[i] = reals[place + i]
            end[at.TWIST + i] = 0.0
        return
    record = chain.HEADER + link * chain.RECORD
    n = 6 + integers[record + chain.MODES]
    memory = integers[record + chain.MEMORY]
    frame = scratch[memory : memory + chain.VECTORS]
    start = memory + chain.VECTORS + chain.Q * n
    start_rate = memory + chain.VECTORS + chain.Q_RATE * n
    # displacement and rotation vector, their rates, and accelerations at zero accelerations of the coordinates
    for i in range(18):
        spare[i] = 0.0
    for j in range(n):
        column = place + at.SHAPES + 6 * j
        q, qd = scratch[start + j], scratch[start_rate + j]
        for i in range(6):
            spare[i] += reals[column + i] * q
            spare[6 + i] += reals[column + i] * qd
        if j < 6:
            qdd = frame[chain.U_ACCELERATION + j]
            for i in range(6):
                spare[12 + i] += reals[column + i] * qdd
    a, b, c = spare[3], spare[4], spare[5]
    size = 1.0 + (a * a + b * b + c * c) / 4
    slip = (a * spare[9] + b * spare[10] + c * spare[11]) / (2 * size)
    local = end[at.LOCAL : at.LOCAL + 12]
    local[0], local[4], local[8] = -(b * b + c * c) / 2, -(a * a + c * c) / 2, -(a * a + b * b) / 2
    local[1], local[2], local[5] = a * b / 2 - c, a * c / 2 + b, b * c / 2 - a
    local[3], local[6], local[7] = a * b / 2 + c, a * c / 2 - b, b * c / 2 + a
    for i in range(9):
        local[i] = local[i] / size + (1.0 if i % 4 == 0 else 0.0)
    for i in range(3):
        local[9 + i] = reals[place + at.POSITION + i] + spare[i]
        end[at.PHI + i] = spare[3 + i]
    end[at.SIZE] = size
    _turn_into(local, spare, 6, size, a, b, c)
    _turn_into(local, spare, 12, size, a, b, c)
    for i in range(3):
        spare[15 + i] -= spare[9 + i] * slip
    # (v × ω, 0) and what the link's own motion adds: ad(carried) local
    v0, v1, v2, w0, w1, w2 = spare[6], spare[7], spare[8], spare[9], spare[10], spare[11]
    spare[12] += v1 * w2 - v2 * w1
    spare[13] += v2 * w0 - v0 * w2
    spare[14] += v0 * w1 - v1 * w0
    twist, bias = end[at.TWIST : at.TWIST + 6], end[at.BIAS : at.BIAS + 6]
    carry(local, frame, chain.TWIST, twist, 0)
    carry(local, frame, chain.TWIST_RATE, bias, 0)
    for i in range(6):
        bias[i] += spare[12 + i]
    add_bracket(twist, 0, spare, 6, 1.0, bias, 0)
    for i in range(6):
        twist[i] += spare[6 + i]
    # on to the joint's frame
    offset = reals[place + at.OFFSET : place + at.OFFSET + 12]
    carry(offset, twist, 0, twist, 0)
    carry(offset, bias, 0, bias, 0)
    world = at.place(integers, at.WORLD) + 12 * link
    compose(scratch[world : world + 12], local, spare)
    compose(spare, offset, end)


@part
def _turn_into(turn: Array, x: Array, start: int, size: float, a: float, b: float, c: float) -> None:
    """Rates of (u, φ) from ``start`` become a twist in the node's own axes: Rᵀ u̇, (φ̇ - φ × φ̇/2)/size."""
    u, v, w = x[start], x[start + 1], x[start + 2]
    for i in range(3):
        x[start + i] = turn[i] * u + turn[3 + i] * v + turn[6 + i] * w
    u, v, w = x[start + 3], x[start + 4], x[start + 5]
    x[start + 3] = (u - (b * w - c * v) / 2) / size
    x[start + 4] = (v - (c * u - a * w) / 2) / size
    x[start + 5] = (w - (a * v - b * u) / 2) / size


@part
def pull_end(
    reals: Array, integers: IntArray, scratch: Array, link: int, place: int, end: Array, spare: Array, row: Array
) -> None:
    """Add to ``row`` (n,) what a force (6,) on a frame, the first of ``spare``, does to the coordinates."""
    if link < 0:
        return
    record = chain.HEADER + link * chain.RECORD
    n, first = 6 + integers[record + chain.MODES], integers[record + chain.FIRST_MODE]
    local = end[at.LOCAL : at.LOCAL + 12]
    a, b, c, size = end[at.PHI], end[at.PHI + 1], end[at.PHI + 2], end[at.SIZE]
    carry_back(reals[place + at.OFFSET : place + at.OFFSET + 12], spare, 0, spare, 0)
    f0, f1, f2, m0, m1, m2 = spare[0], spare[1], spare[2], spare[3], spare[4], spare[5]
    for i in range(3):
        spare[6 + i] = local[3 * i] * f0 + local[3 * i + 1] * f1 + local[3 * i + 2] * f2
    spare[9] = (m0 + (b * m2 - c * m1) / 2) / size
    spare[10] = (m1 + (c * m0 - a * m2) / 2) / size
    spare[11] = (m2 + (a * m1 - b * m0) / 2) / size
    for j in range(n):
        total = dot6(reals, place + at.SHAPES + 6 * j, spare, 6)
        if j < 6:
            spare[12 + j] = total
        else:
            row[first + j - 6] += total
    carry_back(local, spare, 0, spare, 0)
    # forces on ν, the first, and on u̇, from 12: inward from link to link
    for k in range(link, -1, -1):
        record = chain.HEADER + k * chain.RECORD
        memory, joint = integers[record + chain.MEMORY], integers[record + chain.JOINT]
        frame = scratch[memory : memory + chain.VECTORS]
        if joint >= 0:
            screw = reals[integers[record + chain.SCREW] : integers[record + chain.SCREW] + 6]
            row[joint] += dot6(screw, 0, spare, 0)
            if k > 0:  # the joint turns the displacement along
                for i in range(6):
                    spare[6 + i] = 0.0
                add_bracket(frame, chain.U, screw, 0, 1.0, spare, 6)
                row[joint] += dot6(spare, 6, spare, 12)
        if k > 0:
            carry_back(frame, spare, 0, spare, 0)
            carry_back(frame, spare, 12, spare, 12)
            previous = record - chain.RECORD
            outward, before = integers[previous + chain.OUT], integers[previous + chain.FIRST_MODE]
            for j in range(integers[previous + chain.MODES]):
                row[before + j] += dot6(reals, outward + 6 * j, spare, 12)
