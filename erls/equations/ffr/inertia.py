"""Inertia forces, weight and elastic forces of one link in its floating frame, with the effects that are on.

The formulas are those of `erls.equations.ffr.standard_data`. With one axis of rotation the moment about that axis is
complete, and no joint feels the others.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.bent import bent_forces, correct_frame
from erls.equations.ffr.rows import add_rows, cross3, vector
from erls.equations.serial.linear import add_columns, add_symmetric, add_transport, dot
from erls.maths.jit import part


@part
def along(reals: Array, axis: int, x: Array, place: int) -> float:
    """Component of a vector (3,) along an axis."""
    return float(reals[axis] * x[place] + reals[axis + 1] * x[place + 1] + reals[axis + 2] * x[place + 2])


@part
def turn_inertia(reals: Array, integers: IntArray, scratch: Array, record: int, q: Array) -> None:
    """TURNED_Q of a link for its axes: C₁ η."""
    e, axes = len(q), integers[record + at.AXES]
    for a in range(axes):
        start = vector(integers[record + at.MEMORY], e, at.TURNED_Q + a)
        turned = scratch[start : start + e]
        turned[:] = 0.0
        add_columns(reals, integers[record + at.TURNED] + a * e * e, e, q, e, 1.0, turned)


@part
def square_inertia(reals: Array, integers: IntArray, scratch: Array, record: int, pair: int, q: Array) -> int:
    """Where M₂ η of a pair of axes starts, once computed."""
    e = len(q)
    start = vector(integers[record + at.MEMORY], e, at.SQUARE_Q)
    squared = scratch[start : start + e]
    squared[:] = 0.0
    add_symmetric(reals, integers[record + at.SQUARE] + pair * e * e, e, q, 0, squared)
    return start


@part
def _constant(reals: Array, integers: IntArray, record: int, link: Array, rates: Array, moved: Array) -> None:
    """Start WRENCH and MOMENTUM: M₀ and C₀ with the frame's twist and η̇, with its rate and η̈."""
    frame, wrench, momentum = (
        link[at.FRAME : at.FRAME + 15],
        link[at.WRENCH : at.WRENCH + 6],
        link[at.MOMENTUM : at.MOMENTUM + 6],
    )
    rigid, coupling = integers[record + at.RIGID], integers[record + at.COUPLING]
    for i in range(6):
        p = f = 0.0
        for j in range(6):
            p += reals[rigid + 6 * i + j] * frame[j]
            f += reals[rigid + 6 * i + j] * frame[6 + j]
        momentum[i], wrench[i] = p, f
    add_rows(reals, coupling, rates, 1.0, momentum)
    if len(moved):
        add_rows(reals, coupling, moved, 1.0, wrench)


@part
def _first_order(
    reals: Array, integers: IntArray, scratch: Array, record: int, link: Array, q: Array, rates: Array, moved: Array,
    forces: Array,
) -> None:  # fmt: skip
    """What M₁ η and C₁ η add to the frame's wrench and momentum and, by ω̇, to the elastic forces."""
    e, memory = len(q), integers[record + at.MEMORY]
    frame, wrench, momentum = (
        link[at.FRAME : at.FRAME + 15],
        link[at.WRENCH : at.WRENCH + 6],
        link[at.MOMENTUM : at.MOMENTUM + 6],
    )
    half, half_rate = link[at.POINT : at.POINT + 6], link[at.OTHER : at.OTHER + 6]
    turn_inertia(reals, integers, scratch, record, q)
    for a in range(integers[record + at.AXES]):
        axis = integers[record + at.AXIS] + 3 * a
        omega, alpha = along(reals, axis, frame, 3), along(reals, axis, frame, 9)
        start, start_rate = vector(memory, e, at.TURNED_Q + a), vector(memory, e, at.TURNED_RATE + a)
        turned, turned_rate = scratch[start : start + e], scratch[start_rate : start_rate + e]
        turned_rate[:] = 0.0
        add_columns(reals, integers[record + at.TURNED] + a * e * e, e, rates, e, 1.0, turned_rate)
        for i in range(6):
            half[i] = half_rate[i] = 0.0
        add_rows(reals, integers[record + at.HALF] + 6 * a * e, q, 1.0, half)
        add_rows(reals, integers[record + at.HALF] + 6 * a * e, rates, 1.0, half_rate)
        spin, spin_rate = dot(turned, rates, 0, e), dot(turned_rate, rates, 0, e)
        if len(moved):
            spin_rate += dot(turned, moved, 0, e)
        for i in range(6):
            momentum[i] += omega * half[i]
            wrench[i] += alpha * half[i] + omega * half_rate[i]
            spin += half[i] * frame[i]
            spin_rate += half[i] * frame[6 + i] + half_rate[i] * frame[i]
        for i in range(3):
            momentum[3 + i] += spin * reals[axis + i]
            wrench[3 + i] += spin_rate * reals[axis + i]
        for i in range(e):
            forces[i] += alpha * turned[i]


@part
def _second_order(
    reals: Array, integers: IntArray, scratch: Array, record: int, link: Array, q: Array, rates: Array, forces: Array
) -> None:
    """What M₂ adds to the frame's wrench and momentum, and to the elastic forces: spin softening."""
    e, axes, axis = len(q), integers[record + at.AXES], integers[record + at.AXIS]
    frame, wrench, momentum = (
        link[at.FRAME : at.FRAME + 15],
        link[at.WRENCH : at.WRENCH + 6],
        link[at.MOMENTUM : at.MOMENTUM + 6],
    )
    for a in range(axes):
        for b in range(a, axes):
            start = square_inertia(reals, integers, scratch, record, a if a == b else a + b + 2, q)
            squared = scratch[start : start + e]
            omega_a, omega_b = along(reals, axis + 3 * a, frame, 3), along(reals, axis + 3 * b, frame, 3)
            if integers[at.SOFTENING]:
                factor = omega_a * omega_b * (1.0 if a == b else 2.0)
                for i in range(e):
                    forces[i] -= factor * squared[i]
            if integers[at.SECOND_ORDER]:
                moment, rate = dot(squared, q, 0, e), 2.0 * dot(squared, rates, 0, e)
                about_a = moment * along(reals, axis + 3 * b, frame, 9) + rate * omega_b
                about_b = moment * along(reals, axis + 3 * a, frame, 9) + rate * omega_a
                for i in range(3):
                    momentum[3 + i] += moment * omega_b * reals[axis + 3 * a + i]
                    wrench[3 + i] += about_a * reals[axis + 3 * a + i]
                    if a != b:
                        momentum[3 + i] += moment * omega_a * reals[axis + 3 * b + i]
                        wrench[3 + i] += about_b * reals[axis + 3 * b + i]


@part
def _spin_forces(
    reals: Array, integers: IntArray, scratch: Array, record: int, link: Array, rates: Array, forces: Array
) -> None:
    """Coriolis forces on η by its own rates, and centrifugal ones."""
    e, frame = len(rates), link[at.FRAME : at.FRAME + 15]
    for a in range(integers[record + at.AXES]):
        omega = along(reals, integers[record + at.AXIS] + 3 * a, frame, 3)
        if integers[at.CORIOLIS]:
            add_columns(reals, integers[record + at.GYROSCOPIC] + a * e * e, e, rates, e, omega, forces)
        if integers[at.CENTRIFUGAL]:
            add_columns(reals, integers[record + at.HALF] + 6 * a * e, e, frame, 6, -omega, forces)


@part
def _weigh(reals: Array, integers: IntArray, record: int, link: Array, q: Array) -> None:
    """Take the weight from WRENCH."""
    moment, wrench = link[at.POINT : at.POINT + 3], link[at.WRENCH : at.WRENCH + 6]
    constant = integers[record + at.MOMENT]
    for i in range(3):
        moment[i] = reals[constant + 1 + i]
    add_rows(reals, integers[record + at.COUPLING], q, 1.0, moment)
    if integers[record + at.BEND] >= 0:
        for i in range(3):
            moment[i] += link[at.BLOCK + i]
    g0, g1, g2 = link[at.FRAME + 12], link[at.FRAME + 13], link[at.FRAME + 14]
    wrench[0] -= reals[constant] * g0
    wrench[1] -= reals[constant] * g1
    wrench[2] -= reals[constant] * g2
    t0, t1, t2 = cross3(moment[0], moment[1], moment[2], g0, g1, g2)
    wrench[3] -= t0
    wrench[4] -= t1
    wrench[5] -= t2


@part
def link_forces(
    reals: Array, integers: IntArray, scratch: Array, record: int, q: Array, rates: Array, moved: Array, forces: Array
) -> None:
    """WRENCH of a link on its frame, and ``forces`` (e,) on its η; all as inertia less what acts.

    ``moved`` is η̈, empty for zero.
    """
    e, memory = len(q), integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    bent = integers[record + at.BEND] >= 0
    if bent:
        correct_frame(reals, integers, scratch, record, rates, moved)
    _constant(reals, integers, record, link, rates, moved)
    if e:
        stiffness, damping = integers[record + at.STIFFNESS], integers[record + at.DAMPING]
        for i in range(e):
            forces[i] = reals[stiffness + i] * q[i] + reals[damping + i] * rates[i]
        pull = link[at.POINT : at.POINT + 6]  # of the frame, less the weight
        for i in range(3):
            pull[i] = link[at.FRAME + 6 + i] - link[at.FRAME + 12 + i]
            pull[3 + i] = link[at.FRAME + 9 + i]
        add_columns(reals, integers[record + at.COUPLING], e, pull, 6, 1.0, forces)
        if len(moved):
            add_columns(reals, integers[record + at.ELASTIC], e, moved, e, 1.0, forces)
        if integers[at.FIRST_ORDER]:
            _first_order(reals, integers, scratch, record, link, q, rates, moved, forces)
        if integers[at.SECOND_ORDER] or integers[at.SOFTENING]:
            _second_order(reals, integers, scratch, record, link, q, rates, forces)
        if integers[at.CORIOLIS] or integers[at.CENTRIFUGAL]:
            _spin_forces(reals, integers, scratch, record, link, rates, forces)
    if bent:
        bent_forces(reals, integers, scratch, record, rates, forces)
    add_transport(link, at.FRAME, link, at.MOMENTUM, link, at.WRENCH)
    if integers[at.WEIGHT]:
        _weigh(reals, integers, record, link, q)
