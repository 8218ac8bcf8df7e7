"""Inertia forces and weight of one link: formulas of `erls.equations.erls.paper.second_order_inertia` and
`erls.equations.erls.paper.link_inertia`, with the effects that are on.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.forces import along, pair_of, vector
from erls.equations.erls.stiffened import layout as more
from erls.equations.erls.stiffened.tensors import add_cross, add_forms, add_stack, add_three, clear, product, set_pairs
from erls.equations.serial.linear import add_transport
from erls.maths.jit import part


@part
def last(integers: IntArray, record: int, number: int, count: int) -> int:
    """Where the last entries of a vector (n,) of a link start."""
    n = 6 + integers[record + at.MODES]
    return int(vector(integers[record + at.MEMORY], n, number) + n - count)


@part
def curve_inertia(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int) -> None:
    """The second-order tensors of a link times its q: ROWS_Q, MOMENT and SPIN."""
    own, rows, m = integers[mine + more.MEMORY], integers[mine + more.ROWS_Q], integers[mine + more.KEPT]
    q, count = last(integers, record, at.Q, m), 6 + 3 * integers[record + at.AXES]
    clear(scratch, rows, count * m)
    add_stack(reals, integers[mine + more.ROWS], count * m, scratch, q, m, scratch, rows)
    for i in range(3):
        scratch[own + more.MOMENT + i] = 0.5 * product(scratch, rows + i * m, scratch, q, m)
    for i in range(6, count):
        scratch[own + more.SPIN + i - 6] = 0.5 * product(scratch, rows + i * m, scratch, q, m)


@part
def deform_inertia(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int) -> None:
    """X q and Z q of a link, as far as an effect needs them."""
    n, left, own = 6 + integers[record + at.MODES], integers[mine + more.LEFT], integers[mine + more.MEMORY]
    q = last(integers, record, at.Q, left)
    if integers[at.FIRST_ORDER]:
        turned = integers[mine + more.X_Q]
        clear(scratch, turned, 3 * n)
        add_stack(reals, integers[mine + more.X], 3 * n, scratch, q, left, scratch, turned)
    if integers[at.SECOND_ORDER] or integers[at.SOFTENING]:
        twice = integers[mine + more.Z_Q]
        clear(scratch, twice, 6 * left)
        add_stack(reals, integers[mine + more.Z], 6 * left, scratch, q, left, scratch, twice)
        if integers[at.SECOND_ORDER]:
            for pair in range(6):
                scratch[own + more.TURN_MOMENTS + pair] = product(scratch, twice + pair * left, scratch, q, left)


@part
def _comply(reals: Array, compliance: int, bent: Array, place: int, to: int) -> None:
    """Add M₀⁻¹ times six numbers and times the six after them."""
    for i in range(6):
        for j in range(6):
            weight = reals[compliance + 6 * i + j]
            bent[to + i] += weight * bent[place + j]
            bent[to + 6 + i] += weight * bent[place + 6 + j]


@part
def _add_momenta(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, link: Array) -> None:
    """Add M₀⁻¹ (C q̇ + H ν) to FULL, and its derivative to FULL_RATE."""
    m, axes, axis = integers[mine + more.KEPT], integers[record + at.AXES], integers[record + at.AXIS]
    own, rows = integers[mine + more.MEMORY], integers[mine + more.ROWS_Q]
    bent = scratch[own : own + more.NUMBERS]
    qd, qdd = last(integers, record, at.Q_RATE, m), last(integers, record, at.Q_ACCELERATION, m)
    curve_inertia(reals, integers, scratch, record, mine)
    for i in range(6):
        bent[more.ADDED + i] = product(scratch, rows + i * m, scratch, qd, m)
        bent[more.ADDED_RATE + i] = product(scratch, rows + i * m, scratch, qdd, m)
    for i in range(3):
        bent[more.MOMENT_RATE + i] = bent[more.ADDED + i]
    pairs = integers[mine + more.PAIRS]
    add_forms(reals, integers[mine + more.FORMS], more.MOVES, m, scratch, pairs, bent, more.ADDED_RATE)
    omega, alpha = at.TWIST + 3, at.TWIST_RATE + 3
    add_cross(bent, more.MOMENT, link, omega, -1.0, bent, more.ADDED)
    add_cross(bent, more.MOMENT, link, alpha, -1.0, bent, more.ADDED_RATE)
    add_cross(bent, more.MOMENT_RATE, link, omega, -1.0, bent, more.ADDED_RATE)
    for a in range(axes):
        turn, turn_rate = along(reals, axis + 3 * a, link, omega), along(reals, axis + 3 * a, link, alpha)
        for c in range(3):
            i = 3 * a + c
            rate = product(scratch, rows + (6 + i) * m, scratch, qd, m)
            bent[more.SPIN_RATE + i] = rate
            bent[more.ADDED + 3 + c] += bent[more.SPIN + i] * turn
            bent[more.ADDED_RATE + 3 + c] += bent[more.SPIN + i] * turn_rate + rate * turn
    _comply(reals, integers[mine + more.COMPLIANCE], bent, more.ADDED, more.FULL)


@part
def _turn_first_order(
    reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, bent: Array, modal: int
) -> None:
    """Forces and momentum of X, as far as effects ask for them."""
    n, left = 6 + integers[record + at.MODES], integers[mine + more.LEFT]
    top, turned, s = integers[mine + more.X_TOP], integers[mine + more.X_Q], integers[mine + more.VELOCITY]
    qd, qdd = last(integers, record, at.Q_RATE, left), last(integers, record, at.Q_ACCELERATION, n)
    omega, alpha, spin_rates = more.FULL + 3, more.FULL_RATE + 3, more.MOMENTUM_RATE + 3
    if integers[at.FIRST_ORDER]:
        add_stack(scratch, turned, n, bent, alpha, more.AXES, scratch, modal)
        pairs = integers[mine + more.PAIRS]
        add_forms(reals, integers[mine + more.X_FORMS], more.AXES, left, scratch, pairs, bent, spin_rates)
        for a in range(3):
            bent[more.MOMENTUM + 3 + a] += product(scratch, turned + a * n, scratch, s, n)
            bent[spin_rates + a] += product(scratch, turned + a * n, scratch, qdd, n)
            for i in range(6):
                rate = product(reals, top + (6 * a + i) * left, scratch, qd, left)
                push = scratch[turned + a * n + i]
                bent[more.MOMENTUM + i] += bent[omega + a] * push
                bent[more.MOMENTUM_RATE + i] += bent[alpha + a] * push + bent[omega + a] * rate
                bent[spin_rates + a] += rate * bent[more.FULL + i]
    if integers[at.CORIOLIS]:
        odd = integers[mine + more.X_ODD]
        add_three(reals, odd, left, scratch, qd, left, bent, omega, scratch, modal + n - left)
    if integers[at.CENTRIFUGAL]:
        for a in range(3):
            for i in range(6):
                bent[more.WEIGHTS + 6 * a + i] = -bent[omega + a] * bent[more.FULL + i]
        add_stack(reals, top, left, bent, more.WEIGHTS, more.TOP_ROWS, scratch, modal + n - left)


@part
def _turn_second_order(
    integers: IntArray, scratch: Array, record: int, mine: int, bent: Array, modal: int
) -> None:
    """Forces and momentum of Z, as far as effects ask for them."""
    left, twice = integers[mine + more.LEFT], integers[mine + more.Z_Q]
    qd, omega, alpha = last(integers, record, at.Q_RATE, left), more.FULL + 3, more.FULL_RATE + 3
    if integers[at.SECOND_ORDER]:
        for pair in range(6):
            bent[more.TURN_RATES + pair] = 2 * product(scratch, twice + pair * left, scratch, qd, left)
        for a in range(3):
            for b in range(3):
                moment, rate = bent[more.TURN_MOMENTS + pair_of(3, a, b)], bent[more.TURN_RATES + pair_of(3, a, b)]
                bent[more.MOMENTUM + 3 + a] += moment * bent[omega + b]
                bent[more.MOMENTUM_RATE + 3 + a] += moment * bent[alpha + b] + rate * bent[omega + b]
    if integers[at.SOFTENING]:
        clear(bent, more.WEIGHTS, more.AXIS_PAIRS)
        for a in range(3):
            for b in range(3):
                bent[more.WEIGHTS + pair_of(3, a, b)] -= bent[omega + a] * bent[omega + b]
        to = modal + 6 + integers[record + at.MODES] - left
        add_stack(scratch, twice, left, bent, more.WEIGHTS, more.AXIS_PAIRS, scratch, to)


@part
def _feel_curvature(
    reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, link: Array, modal: int
) -> None:
    """What second-order momenta add to the modal forces and to the rates of momentum."""
    m, axes, axis = integers[mine + more.KEPT], integers[record + at.AXES], integers[record + at.AXIS]
    own, rows = integers[mine + more.MEMORY], integers[mine + more.ROWS_Q]
    bent, share, share_rate = scratch[own : own + more.NUMBERS], more.SHARE, more.SHARE_RATE
    to = modal + 6 + integers[record + at.MODES] - m
    clear(bent, share, 2 * more.MOVES)
    _comply(reals, integers[mine + more.COMPLIANCE], bent, more.MOMENTUM, share)
    for i in range(6):
        bent[more.WEIGHTS + i] = bent[share_rate + i]
    for i in range(3):
        bent[more.WEIGHTS + i] -= link[at.DOWN + i]
    add_cross(bent, share, link, at.TWIST + 3, -1.0, bent, more.WEIGHTS)
    for a in range(axes):
        turn = along(reals, axis + 3 * a, link, at.TWIST + 3)
        total = total_rate = 0.0
        for c in range(3):
            i = 3 * a + c
            bent[more.WEIGHTS + 6 + i] = -turn * bent[share + 3 + c]
            total += bent[more.SPIN + i] * bent[share + 3 + c]
            total_rate += bent[more.SPIN + i] * bent[share_rate + 3 + c]
            total_rate += bent[more.SPIN_RATE + i] * bent[share + 3 + c]
        for i in range(3):
            bent[more.MOMENTUM + 3 + i] += total * reals[axis + 3 * a + i]
            bent[more.MOMENTUM_RATE + 3 + i] += total_rate * reals[axis + 3 * a + i]
    add_cross(bent, more.MOMENT, bent, share, 1.0, bent, more.MOMENTUM + 3)
    add_cross(bent, more.MOMENT, bent, share_rate, 1.0, bent, more.MOMENTUM_RATE + 3)
    add_cross(bent, more.MOMENT_RATE, bent, share, 1.0, bent, more.MOMENTUM_RATE + 3)
    add_stack(scratch, rows, m, bent, more.WEIGHTS, 6 + 3 * axes, scratch, to)
    for i in range(3):
        bent[share + 3 + i] = -bent[share + 3 + i]
    qd = last(integers, record, at.Q_RATE, m)
    add_three(reals, integers[mine + more.ODD], m, scratch, qd, m, bent, share + 3, scratch, to)


@part
def _weigh(
    reals: Array, mass: int, scratch: Array, q: int, n: int, link: Array, bent: Array, curved: int, modal: int
) -> None:
    """Weight, on the modes and on the frame; that of second order on the modes is in WEIGHTS."""
    moment = more.SPARE
    for j in range(3):
        g = link[at.DOWN + j]
        for i in range(n):
            scratch[modal + i] -= reals[mass + j * n + i] * g
        for i in range(6):
            link[at.WRENCH + i] -= reals[mass + j * n + i] * g
        bent[moment + j] = product(reals, mass + j * n, scratch, q, n)
        if curved:
            bent[moment + j] += bent[more.MOMENT + j]
    add_cross(bent, moment, link, at.DOWN, -1.0, link, at.WRENCH + 3)


@part
def link_forces(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, accelerated: bool) -> None:
    """WRENCH, FORCE and MODAL of a link that moves as its memory says; without ``accelerated`` q̈_d is zero."""
    memory, n, own = integers[record + at.MEMORY], 6 + integers[record + at.MODES], integers[mine + more.MEMORY]
    link, bent = scratch[memory : memory + at.VECTORS], scratch[own : own + more.NUMBERS]
    q, qd = last(integers, record, at.Q, n), last(integers, record, at.Q_RATE, n)
    qdd, modal = last(integers, record, at.Q_ACCELERATION, n), last(integers, record, at.MODAL, n)
    mass, left, s = integers[mine + more.MASS], integers[mine + more.LEFT], integers[mine + more.VELOCITY]
    curved = integers[mine + more.CURVED]
    for i in range(6):
        bent[more.FULL + i] = link[at.TWIST + i]
        bent[more.FULL_RATE + i] = link[at.TWIST_RATE + i]
    if curved or integers[at.FIRST_ORDER]:
        set_pairs(scratch, qd + n - left, left, scratch, integers[mine + more.PAIRS])
    if curved:
        _add_momenta(reals, integers, scratch, record, mine, link)
    for i in range(n):
        scratch[s + i] = scratch[qd + i]
    for i in range(6):
        scratch[s + i] += bent[more.FULL + i]
        scratch[qdd + i] += bent[more.FULL_RATE + i]
    clear(scratch, modal, n)
    add_stack(reals, mass, n, scratch, qdd, n if accelerated else more.MOVES, scratch, modal)
    for i in range(6):
        bent[more.MOMENTUM + i] = product(reals, mass + i * n, scratch, s, n)
        bent[more.MOMENTUM_RATE + i] = scratch[modal + i]
    deform_inertia(reals, integers, scratch, record, mine)
    _turn_first_order(reals, integers, scratch, record, mine, bent, modal)
    _turn_second_order(integers, scratch, record, mine, bent, modal)
    if curved:
        _feel_curvature(reals, integers, scratch, record, mine, link, modal)
    for i in range(6):
        link[at.WRENCH + i] = bent[more.MOMENTUM_RATE + i]
    if integers[at.WEIGHT]:
        _weigh(reals, mass, scratch, q, n, link, bent, curved, modal)
    if record != at.HEADER:  # on the ground the frame moves along the joint, which does not feel this
        add_transport(link, at.TWIST, bent, more.MOMENTUM, link, at.WRENCH)
        for i in range(6):
            link[at.FORCE + i] = bent[more.PUSH + i] = scratch[modal + i]
