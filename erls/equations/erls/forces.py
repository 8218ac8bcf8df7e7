"""Inertia forces and weight of one link in the modes [ρ Ψ], with the effects that are on.

The formulas are those of `erls.equations.erls.paper.link_inertia`. With one axis of rotation, the wrench holds the
moment about that axis only: no joint feels the others.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.serial.linear import add_columns, add_symmetric, add_transport, dot, dot6, pass_columns
from erls.maths.jit import part


@part
def vector(memory: int, n: int, number: int) -> int:
    """Where a vector (n,) of a link's memory starts, by its number in `layout`."""
    return memory + at.VECTORS + number * n


@part
def along(reals: Array, axis: int, x: Array, place: int) -> float:
    """Component of a vector (3,) along an axis."""
    return float(reals[axis] * x[place] + reals[axis + 1] * x[place + 1] + reals[axis + 2] * x[place + 2])


@part
def pair_of(axes: int, i: int, j: int) -> int:
    """Number of a pair of axes i, j."""
    return i if i == j or axes == 1 else i + j + 2


@part
def deform_first_order(reals: Array, integers: IntArray, scratch: Array, record: int) -> None:
    """X q of a link for its axes, where an effect needs it."""
    n = 6 + integers[record + at.MODES]
    memory, axes = integers[record + at.MEMORY], integers[record + at.AXES]
    skip = 6 if record == at.HEADER else 0  # u = 0 on the ground
    start = vector(memory, n, at.Q)
    q = scratch[start + skip : start + n]
    if integers[at.FIRST_ORDER]:
        for i in range(axes):
            start = vector(memory, n, at.X_Q + i)
            xq = scratch[start : start + n]
            xq[:] = 0.0
            add_columns(reals, integers[record + at.X] + (i * n + skip) * n, n, q, n - skip, 1.0, xq)


@part
def deform_second_order(reals: Array, integers: IntArray, scratch: Array, record: int) -> None:
    """Z q of a link for its pairs of axes, and qᵀ Z q, as far as an effect needs them."""
    n = 6 + integers[record + at.MODES]
    memory, axes = integers[record + at.MEMORY], integers[record + at.AXES]
    skip = 6 if record == at.HEADER else 0
    start = vector(memory, n, at.Q)
    q = scratch[start : start + n]
    if integers[at.SECOND_ORDER] or integers[at.SOFTENING]:
        link = scratch[memory : memory + at.VECTORS]
        for pair in range(axes * (axes + 1) // 2):
            start = vector(memory, n, at.Z_Q + pair)
            zq = scratch[start : start + n]
            zq[:] = 0.0
            add_symmetric(reals, integers[record + at.Z] + pair * n * n, n, q, skip, zq)
            if integers[at.SECOND_ORDER]:
                link[at.TURN_MOMENTS + pair] = dot(zq, q, skip, n)


@part
def link_forces(reals: Array, integers: IntArray, scratch: Array, record: int, accelerated: bool) -> None:
    """WRENCH, FORCE and the elastic part of MODAL of a link that moves as its memory says.

    Without ``accelerated`` q̈_d is zero.
    """
    e = integers[record + at.MODES]
    n = 6 + e
    memory, axes = integers[record + at.MEMORY], integers[record + at.AXES]
    ground = record == at.HEADER
    skip = 6 if ground else 0
    link = scratch[memory : memory + at.VECTORS]
    first, second = integers[at.FIRST_ORDER], integers[at.SECOND_ORDER]
    coriolis, centrifugal = integers[at.CORIOLIS], integers[at.CENTRIFUGAL]
    mass, axis = integers[record + at.MASS], integers[record + at.AXIS]
    q, qd = scratch[vector(memory, n, 0) : vector(memory, n, 1)], scratch[vector(memory, n, 1) : vector(memory, n, 2)]
    qdd, modal = (
        scratch[vector(memory, n, 2) : vector(memory, n, 3)],
        scratch[vector(memory, n, 3) : vector(memory, n, 4)],
    )
    wrench, spare = link[at.WRENCH : at.WRENCH + 6], link[at.POINT : at.POINT + 6]

    # m ṡ, with the weight as an acceleration of the frame
    for i in range(6):
        qdd[i] = link[at.W_RATE + i]
    for i in range(3):
        qdd[i] -= link[at.DOWN + i]
    modal[:] = 0.0
    if accelerated:
        add_symmetric(reals, mass, n, qdd, 0, modal)
    else:
        add_columns(reals, mass, n, qdd, 6, 1.0, modal)
    for i in range(6):
        wrench[i] = modal[i]
        qdd[i] = link[at.W_RATE + i]
    if integers[at.WEIGHT]:  # moment of the displaced mass
        for i in range(3):
            spare[i] = 0.0
        for j in range(skip, n):
            for i in range(3):
                spare[i] += reals[mass + j * n + i] * q[j]
        g0, g1, g2 = link[at.DOWN], link[at.DOWN + 1], link[at.DOWN + 2]
        wrench[3] -= spare[1] * g2 - spare[2] * g1
        wrench[4] -= spare[2] * g0 - spare[0] * g2
        wrench[5] -= spare[0] * g1 - spare[1] * g0

    # momentum of the frame, in spare
    for i in range(6):
        spare[i] = 0.0
    if not ground:
        for j in range(n):
            s = qd[j] if j >= 6 else link[at.W + j]
            for i in range(6):
                spare[i] += reals[mass + j * n + i] * s

    deform_second_order(reals, integers, scratch, record)
    start = vector(memory, n, at.COLUMN)
    speeds = scratch[start : start + n]
    for a in range(axes):
        omega = along(reals, axis + 3 * a, link, at.TWIST + 3)
        alpha = along(reals, axis + 3 * a, link, at.TWIST_RATE + 3)
        x = integers[record + at.X] + a * n * n
        start, start_rate = vector(memory, n, at.X_Q + a), vector(memory, n, at.X_RATE + a)
        xq, xqd = scratch[start : start + n], scratch[start_rate : start_rate + n]
        if first or coriolis:
            xq[:] = 0.0
            xqd[:] = 0.0
        if coriolis:  # -ω X_ωᵀ s with all velocities when the centrifugal load is on too, otherwise with those of q
            for i in range(n):
                speeds[i] = omega * qd[i]
            if centrifugal:
                for i in range(6):
                    speeds[i] = omega * link[at.W + i]
            pass_columns(reals, x, n, skip, q, qd, xq, xqd, speeds, modal)
            for i in range(n):
                modal[i] += omega * xqd[i]
        elif first:
            add_columns(reals, x + skip * n, n, q[skip:], n - skip, 1.0, xq)
            add_columns(reals, x + skip * n, n, qd[skip:], n - skip, 1.0, xqd)
        if centrifugal and not coriolis:
            for j in range(skip, n):
                modal[j] -= omega * dot6(reals, x + j * n, link, at.TWIST)
        if first:
            for i in range(6):
                wrench[i] += alpha * xq[i] + omega * xqd[i]
                spare[i] += omega * xq[i]
            for i in range(n):
                modal[i] += alpha * xq[i]
            # X q · s and its derivative, about the axis
            spin = spin_rate = 0.0
            for i in range(6):
                spin += xq[i] * link[at.W + i]
                spin_rate += xq[i] * link[at.W_RATE + i] + xqd[i] * link[at.W + i]
            spin += dot(xq, qd, 6, n)
            spin_rate += dot(xqd, qd, 6, n)
            if accelerated:
                spin_rate += dot(xq, qdd, 6, n)
            for i in range(3):
                spare[3 + i] += spin * reals[axis + 3 * a + i]
                wrench[3 + i] += spin_rate * reals[axis + 3 * a + i]
        if second or integers[at.SOFTENING]:
            for b in range(axes):
                pair = pair_of(axes, a, b)
                start = vector(memory, n, at.Z_Q + pair)
                zq = scratch[start : start + n]
                other = along(reals, axis + 3 * b, link, at.TWIST + 3)
                if second:
                    moment = link[at.TURN_MOMENTS + pair]
                    rate = moment * along(reals, axis + 3 * b, link, at.TWIST_RATE + 3)
                    rate += 2 * other * dot(zq, qd, skip, n)
                    for i in range(3):
                        spare[3 + i] += moment * other * reals[axis + 3 * a + i]
                        wrench[3 + i] += rate * reals[axis + 3 * a + i]
                if integers[at.SOFTENING]:
                    for i in range(n):
                        modal[i] -= omega * other * zq[i]
    if not ground:  # on the ground the frame moves along the joint, which does not feel this
        add_transport(link, at.TWIST, spare, 0, link, at.WRENCH)
        for i in range(6):
            link[at.FORCE + i] = modal[i]
