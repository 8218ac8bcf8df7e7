"""Outward: second-order displacements of all link frames, after the linear ones."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.stiffened import layout as more
from erls.equations.erls.stiffened.forces import last
from erls.equations.erls.stiffened.tensors import add_cross, add_forms, add_stack, clear, product, set_pairs
from erls.equations.serial.linear import add_bracket, carry
from erls.maths.jit import part


@part
def bend_frames(reals: Array, integers: IntArray, scratch: Array, moving: bool) -> None:
    """e of all links, added to the modal coordinates that `erls.equations.erls.motion` left.

    ``moving``: with first and second derivatives, at the given accelerations.
    """
    links = integers[at.LINKS]
    for k in range(links):
        record = at.HEADER + k * at.RECORD
        mine = more.header(integers, links) + more.HEADER + k * more.RECORD
        memory, n = integers[record + at.MEMORY], 6 + integers[record + at.MODES]
        link = scratch[memory : memory + at.VECTORS]
        own = integers[mine + more.MEMORY]
        bent = scratch[own : own + more.NUMBERS]
        q, qd, qdd = (
            last(integers, record, at.Q, n),
            last(integers, record, at.Q_RATE, n),
            last(integers, record, at.Q_ACCELERATION, n),
        )
        if k == 0:
            for i in range(24):
                bent[more.E + i] = 0.0
        else:
            start = integers[mine - more.RECORD + more.MEMORY]
            before = scratch[start : start + more.NUMBERS]
            _carry_on(reals, integers[record + at.SCREW], link, before, bent, moving)
            if integers[mine + more.ARMED]:
                _turn_arm(reals, integers[mine + more.REACH], link, bent, moving)
        if moving:
            for i in range(6):
                scratch[qdd + i] = link[at.U_ACCELERATION + i]
        if k + 1 < links:
            for i in range(6):
                bent[more.LIFT + i] = bent[more.E + i]
            if moving:
                for i in range(12):
                    bent[more.LIFT_RATE + i] = bent[more.E_RATE + i]
            if integers[mine + more.BOWS]:
                m = integers[mine + more.KEPT]
                _lift(reals, integers, scratch, mine, bent, q + n - m, qd + n - m, qdd + n - m, moving)
        for i in range(6):
            scratch[q + i] += bent[more.E + i]
        if moving:
            for i in range(6):
                scratch[qd + i] += bent[more.E_RATE + i]
                scratch[qdd + i] += bent[more.E_ACCELERATION + i]


@part
def _carry_on(reals: Array, screw: int, link: Array, before: Array, bent: Array, moving: bool) -> None:
    """CARRIED, E and its derivatives as what the link before hands on."""
    carry(link, before, more.LIFT, bent, more.E)
    for i in range(6):
        bent[more.CARRIED + i] = bent[more.E + i]
    if moving:
        rate = link[at.ANGLE + 1]
        carry(link, before, more.LIFT_RATE, bent, more.E_RATE)
        carry(link, before, more.LIFT_ACCELERATION, bent, more.E_ACCELERATION)
        add_bracket(reals, screw, bent, more.E_RATE, -rate, bent, more.E_ACCELERATION)
        add_bracket(reals, screw, bent, more.E, -rate, bent, more.E_RATE)
        add_bracket(reals, screw, bent, more.E_RATE, -rate, bent, more.E_ACCELERATION)
        add_bracket(reals, screw, bent, more.E, -link[at.ANGLE + 2], bent, more.E_ACCELERATION)


@part
def set_arm(reals: Array, reach: int, link: Array, bent: Array) -> None:
    """d and b = φ × d into SPARE."""
    for i in range(3):
        bent[more.SPARE + i] = link[at.ANGLE] * reals[reach + i] - reals[reach + 3 + i]
        bent[more.SPARE + 3 + i] = 0.0
    add_cross(link, at.U + 3, bent, more.SPARE, 1.0, bent, more.SPARE + 3)


@part
def _turn_arm(reals: Array, reach: int, link: Array, bent: Array, moving: bool) -> None:
    """Add ½ φ × (φ × d) to E."""
    phi, rate, acceleration = at.U + 3, at.U_RATE + 3, at.U_ACCELERATION + 3
    d, b = more.SPARE, more.SPARE + 3
    set_arm(reals, reach, link, bent)
    add_cross(link, phi, bent, b, 0.5, bent, more.E)
    if moving:
        along, along_rate, once = link[at.ANGLE + 1], link[at.ANGLE + 2], more.SPARE + 6
        add_cross(link, rate, bent, b, 0.5, bent, more.E_RATE)
        add_cross(link, acceleration, bent, b, 0.5, bent, more.E_ACCELERATION)
        for i in range(3):  # ḃ
            bent[once + i] = 0.0
        add_cross(link, rate, bent, d, 1.0, bent, once)
        add_cross(link, phi, reals, reach, along, bent, once)
        add_cross(link, phi, bent, once, 0.5, bent, more.E_RATE)
        add_cross(link, rate, bent, once, 1.0, bent, more.E_ACCELERATION)
        for i in range(3):  # its derivative
            bent[once + i] = 0.0
        add_cross(link, acceleration, bent, d, 1.0, bent, once)
        add_cross(link, rate, reals, reach, 2 * along, bent, once)
        add_cross(link, phi, reals, reach, along_rate, bent, once)
        add_cross(link, phi, bent, once, 0.5, bent, more.E_ACCELERATION)


@part
def _lift(
    reals: Array, integers: IntArray, scratch: Array, mine: int, bent: Array, q: int, qd: int, qdd: int, moving: bool
) -> None:
    """Add ½ xᵀ P x to LIFT, of coordinates x that start at ``q``; P x into BOW_Q."""
    m, bow, lift = integers[mine + more.KEPT], integers[mine + more.BOW_Q], more.LIFT
    clear(scratch, bow, 6 * m)
    add_stack(reals, integers[mine + more.BOW], 6 * m, scratch, q, m, scratch, bow)
    for r in range(6):
        bent[lift + r] += 0.5 * product(scratch, bow + r * m, scratch, q, m)
        if moving:
            bent[more.LIFT_RATE + r] += product(scratch, bow + r * m, scratch, qd, m)
            bent[more.LIFT_ACCELERATION + r] += product(scratch, bow + r * m, scratch, qdd, m)
    if moving:
        pairs = integers[mine + more.PAIRS]
        set_pairs(scratch, qd, m, scratch, pairs)
        add_forms(reals, integers[mine + more.BOW_FORMS], more.MOVES, m, scratch, pairs, bent, more.LIFT_ACCELERATION)
