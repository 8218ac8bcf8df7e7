"""Outward: poses, twists and their rates of all floating frames."""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.bending import bend, bend_rates, inner_slope, outer_slope
from erls.equations.ffr.nodes import invert_pose, move_node, place_node
from erls.equations.ffr.rows import vector
from erls.equations.serial.curves import curve
from erls.equations.serial.linear import add_bracket, carry
from erls.maths.jit import part


@part
def step_pose(reals: Array, start: int, slides: int, coordinate: float, out: Array) -> None:
    """Pose (12,) over a joint at its coordinate."""
    if slides:
        for i in range(12):
            out[i] = reals[start + i] + coordinate * reals[start + 12 + i]
    else:
        c, s = math.cos(coordinate), math.sin(coordinate)
        for i in range(12):
            out[i] = reals[start + i] + c * reals[start + 12 + i] + s * reals[start + 24 + i]


@part
def turn_back(pose: Array, x: Array, start: int, out: Array, to: int) -> None:
    """Rᵀ x of a vector (3,); both may be the same."""
    x0, x1, x2 = x[start], x[start + 1], x[start + 2]
    for i in range(3):
        out[to + i] = pose[i] * x0 + pose[3 + i] * x1 + pose[6 + i] * x2


@part
def joint_motion(
    reals: Array, integers: IntArray, record: int, t: float, y: Array, v: Array, a: Array, link: Array
) -> None:
    """θ, θ̇, θ̈ of a joint: from the state or, prescribed, from time; θ̈ = 0 where ``a`` is empty."""
    place = integers[record + at.JOINT]
    if place >= 0:
        link[at.ANGLE] = y[place]
        link[at.ANGLE + 1] = v[place]
        link[at.ANGLE + 2] = a[place] if len(a) else 0.0
    else:
        angle, rate, acceleration = curve(integers, reals, integers[record + at.MOTION], t)
        link[at.ANGLE], link[at.ANGLE + 1], link[at.ANGLE + 2] = angle, rate, acceleration


@part
def place_frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array) -> None:
    """Joint coordinates and the poses of all steps and nodes."""
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        e, memory, first = integers[record + at.MODES], integers[record + at.MEMORY], integers[record + at.FIRST_MODE]
        link, q = scratch[memory : memory + at.VECTORS], y[first : first + e]
        joint_motion(reals, integers, record, t, y, v, a, link)
        step_pose(reals, integers[record + at.STEP], integers[record + at.SLIDES], link[at.ANGLE], link)
        if integers[record + at.BEND] >= 0:
            bend(reals, integers, scratch, record, q)
        if integers[record + at.INBOARD] >= 0:
            node, start = link[at.INNER : at.INNER + at.NODE], vector(memory, e, at.INNER_ROWS)
            slope, length = inner_slope(integers, record, at.BENDING)
            rows = scratch[start : start + 6 * e]
            place_node(reals, integers[record + at.INBOARD], q, scratch[slope : slope + length], rows, node)
            invert_pose(node, node[at.BACK : at.BACK + 12])
        if integers[record + at.OUTBOARD] >= 0:
            node, start = link[at.OUTER : at.OUTER + at.NODE], vector(memory, e, at.OUTER_ROWS)
            slope, length = outer_slope(integers, record, at.BENDING)
            rows = scratch[start : start + 6 * e]
            place_node(reals, integers[record + at.OUTBOARD], q, scratch[slope : slope + length], rows, node)


@part
def _arrive(reals: Array, integers: IntArray, scratch: Array, k: int) -> None:
    """FRAME of a link, from NEXT of the link before or from the ground."""
    record = at.HEADER + k * at.RECORD
    memory = integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    screw = reals[integers[record + at.SCREW] : integers[record + at.SCREW] + 6]
    rate, acceleration = link[at.ANGLE + 1], link[at.ANGLE + 2]
    frame, joint = link[at.FRAME : at.FRAME + 15], link[at.OTHER : at.OTHER + 6]
    for i in range(6):
        joint[i] = screw[i] * rate
    if k == 0:
        for i in range(6):
            frame[i], frame[6 + i] = joint[i], screw[i] * acceleration
        turn_back(link, reals, at.GRAVITY, frame, 12)
    else:
        start = integers[record - at.RECORD + at.MEMORY]
        before = scratch[start + at.NEXT : start + at.NEXT + 15]
        carry(link, before, 0, frame, 0)
        carry(link, before, 6, frame, 6)
        turn_back(link, before, 12, frame, 12)
        add_bracket(frame, 0, joint, 0, 1.0, frame, 6)
        for i in range(6):
            frame[i] += joint[i]
            frame[6 + i] += screw[i] * acceleration
    if integers[record + at.INBOARD] >= 0:  # now from the inboard node to the frame
        node = link[at.INNER : at.INNER + at.NODE]
        back = node[at.BACK : at.BACK + 12]
        for i in range(6):
            frame[6 + i] -= node[at.RATE + i]
        add_bracket(frame, 0, node, at.TWIST, -1.0, frame, 6)
        for i in range(6):
            frame[i] -= node[at.TWIST + i]
        carry(back, frame, 0, frame, 0)
        carry(back, frame, 6, frame, 6)
        turn_back(back, frame, 12, frame, 12)


@part
def _leave(reals: Array, integers: IntArray, record: int, link: Array) -> None:
    """NEXT of a link from its FRAME."""
    frame, after = link[at.FRAME : at.FRAME + 15], link[at.NEXT : at.NEXT + 15]
    if integers[record + at.OUTBOARD] < 0:
        for i in range(15):
            after[i] = frame[i]
        return
    node = link[at.OUTER : at.OUTER + at.NODE]
    carry(node, frame, 0, after, 0)
    carry(node, frame, 6, after, 6)
    turn_back(node, frame, 12, after, 12)
    add_bracket(after, 0, node, at.TWIST, 1.0, after, 6)
    for i in range(6):
        after[i] += node[at.TWIST + i]
        after[6 + i] += node[at.RATE + i]


@part
def move_frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array) -> None:
    """Motion of all frames, with accelerations θ̈, η̈; at zero ones of what is free where ``a`` is empty."""
    place_frames(reals, integers, scratch, t, y, v, a)
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        e, memory, first = integers[record + at.MODES], integers[record + at.MEMORY], integers[record + at.FIRST_MODE]
        link, rates = scratch[memory : memory + at.VECTORS], v[first : first + e]
        accelerations = a[first : first + e] if len(a) else a
        if integers[record + at.BEND] >= 0:
            bend_rates(reals, integers, scratch, record, rates)
        if integers[record + at.INBOARD] >= 0:
            node, start = link[at.INNER : at.INNER + at.NODE], vector(memory, e, at.INNER_ROWS)
            slope, length = inner_slope(integers, record, at.BENDING_RATE)
            rows = scratch[start : start + 6 * e]
            move_node(rows, rates, accelerations, scratch[slope : slope + length], node)
        if integers[record + at.OUTBOARD] >= 0:
            node, start = link[at.OUTER : at.OUTER + at.NODE], vector(memory, e, at.OUTER_ROWS)
            slope, length = outer_slope(integers, record, at.BENDING_RATE)
            rows = scratch[start : start + 6 * e]
            move_node(rows, rates, accelerations, scratch[slope : slope + length], node)
        _arrive(reals, integers, scratch, k)
        if k + 1 < integers[at.LINKS]:
            _leave(reals, integers, record, link)
