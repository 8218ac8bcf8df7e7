"""Outward: poses, twists and displacements of all link frames."""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.serial.curves import curve
from erls.equations.serial.linear import add_bracket, add_columns, carry
from erls.maths.jit import part


@part
def step_pose(reals: Array, start: int, slides: int, coordinate: float, link: Array) -> None:
    """Pose of a link's frame in that before: rotation row after row, then place."""
    if slides:
        for i in range(12):
            link[at.TURN + i] = reals[start + i] + coordinate * reals[start + 12 + i]
    else:
        c, s = math.cos(coordinate), math.sin(coordinate)
        for i in range(12):
            link[at.TURN + i] = reals[start + i] + c * reals[start + 12 + i] + s * reals[start + 24 + i]


@part
def joint_motion(
    reals: Array, integers: IntArray, record: int, t: float, y: Array, v: Array, a: Array, link: Array
) -> None:
    """θ, θ̇, θ̈ of a joint: from the state or, prescribed, from time; θ̈ from ``a`` unless that is empty."""
    place = integers[record + at.JOINT]
    if place >= 0:
        link[at.ANGLE] = y[place]
        link[at.ANGLE + 1] = v[place]
        link[at.ANGLE + 2] = a[place] if len(a) else 0.0
    else:
        angle, rate, acceleration = curve(integers, reals, integers[record + at.MOTION], t)
        link[at.ANGLE], link[at.ANGLE + 1], link[at.ANGLE + 2] = angle, rate, acceleration


@part
def displace(
    reals: Array, integers: IntArray, record: int, before: Array, x: Array, start: int, link: Array, out: int
) -> None:
    """T (x_before + C x_d): x_before from ``start`` in the link before, x_d from the elastic part of x there."""
    point = link[at.POINT : at.POINT + 6]
    for i in range(6):
        point[i] = before[start + i]
    add_columns(reals, integers[record + at.OUT], 6, x, integers[record + at.MODES], 1.0, point)
    carry(link, point, 0, link, out)


@part
def place_frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array) -> None:
    """Poses and displacements of all link frames, with the modal coordinates u, q_d of each link beside each other."""
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        n = 6 + integers[record + at.MODES]
        memory, first = integers[record + at.MEMORY], integers[record + at.FIRST_MODE]
        link = scratch[memory : memory + at.VECTORS]
        joint_motion(reals, integers, record, t, y, v, a, link)
        step_pose(reals, integers[record + at.STEP], integers[record + at.SLIDES], link[at.ANGLE], link)
        q = scratch[memory + at.VECTORS : memory + at.VECTORS + n]
        for i in range(6, n):
            q[i] = y[first + i - 6]
        if k == 0:
            for i in range(6):
                link[at.U + i] = 0.0
                q[i] = 0.0
        else:
            previous = record - at.RECORD
            start = integers[previous + at.MEMORY]
            before = scratch[start : start + at.VECTORS]
            stop = start + at.VECTORS + 6 + integers[previous + at.MODES]
            displace(reals, integers, previous, before, scratch[start + at.VECTORS + 6 : stop], at.U, link, at.U)
            for i in range(6):
                q[i] = link[at.U + i]


@part
def move_frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array) -> None:
    """Twists and displacement rates of all link frames; without accelerations when ``a`` is empty.

    The second derivatives are those at the given θ̈, q̈_d (at zero where ``a`` is empty).
    """
    place_frames(reals, integers, scratch, t, y, v, a)
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        n = 6 + integers[record + at.MODES]
        memory, first = integers[record + at.MEMORY], integers[record + at.FIRST_MODE]
        link = scratch[memory : memory + at.VECTORS]
        rate, acceleration = link[at.ANGLE + 1], link[at.ANGLE + 2]
        screw = reals[integers[record + at.SCREW] : integers[record + at.SCREW] + 6]
        vectors = memory + at.VECTORS
        qd = scratch[vectors + at.Q_RATE * n : vectors + (at.Q_RATE + 1) * n]
        qdd = scratch[vectors + at.Q_ACCELERATION * n : vectors + (at.Q_ACCELERATION + 1) * n]
        for i in range(6, n):
            qd[i] = v[first + i - 6]
            qdd[i] = a[first + i - 6] if len(a) else 0.0
        if k == 0:
            for i in range(6):
                link[at.TWIST + i] = screw[i] * rate
                link[at.TWIST_RATE + i] = screw[i] * acceleration
                link[at.U_RATE + i] = link[at.U_ACCELERATION + i] = 0.0
            for i in range(3):
                link[at.DOWN + i] = (
                    link[i] * reals[at.GRAVITY]
                    + link[3 + i] * reals[at.GRAVITY + 1]
                    + link[6 + i] * reals[at.GRAVITY + 2]
                )
        else:
            previous = record - at.RECORD
            start, count = integers[previous + at.MEMORY], 6 + integers[previous + at.MODES]
            before = scratch[start : start + at.VECTORS]
            start += at.VECTORS
            carry(link, before, at.TWIST, link, at.TWIST)
            carry(link, before, at.TWIST_RATE, link, at.TWIST_RATE)
            for i in range(6):
                link[at.TWIST + i] += screw[i] * rate
                link[at.TWIST_RATE + i] += screw[i] * acceleration
            add_bracket(screw, 0, link, at.TWIST, -rate, link, at.TWIST_RATE)
            before_qd = scratch[start + at.Q_RATE * count + 6 : start + (at.Q_RATE + 1) * count]
            displace(reals, integers, previous, before, before_qd, at.U_RATE, link, at.U_RATE)
            if len(a):
                before_qdd = scratch[start + at.Q_ACCELERATION * count + 6 : start + (at.Q_ACCELERATION + 1) * count]
                displace(reals, integers, previous, before, before_qdd, at.U_ACCELERATION, link, at.U_ACCELERATION)
            else:
                carry(link, before, at.U_ACCELERATION, link, at.U_ACCELERATION)
            add_bracket(screw, 0, link, at.U_RATE, -rate, link, at.U_ACCELERATION)
            add_bracket(screw, 0, link, at.U, -rate, link, at.U_RATE)
            add_bracket(screw, 0, link, at.U_RATE, -rate, link, at.U_ACCELERATION)
            add_bracket(screw, 0, link, at.U, -acceleration, link, at.U_ACCELERATION)
            for i in range(3):
                link[at.DOWN + i] = (
                    link[i] * before[at.DOWN] + link[3 + i] * before[at.DOWN + 1] + link[6 + i] * before[at.DOWN + 2]
                )
        for i in range(6):
            link[at.W + i] = link[at.TWIST + i] + link[at.U_RATE + i]
            link[at.W_RATE + i] = link[at.TWIST_RATE + i] + link[at.U_ACCELERATION + i]
            qd[i] = link[at.U_RATE + i]
