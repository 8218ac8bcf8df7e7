"""Derivatives of the forces of beams (`erls.equations.nodal.beam_forces`), as iteration matrices take them, or exact.

Iterations do without what inertia changes as an element bends: blocks of mass, of damping but for Q̇, and of stiffness.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.beam_ends import inward, outward, section, unit_twist
from erls.equations.nodal.beam_forces import HALF, POINTS, WEIGHTS, section_force
from erls.equations.nodal.beam_linear import linear_derivatives
from erls.equations.nodal.contract import (
    BLOCKS,
    LINEAR,
    Model,
    Work,
    read_layout,
    read_model,
    read_work,
)
from erls.maths.coefficients import inverse_coefficient, stumpff, tangent_coefficients
from erls.maths.jit import kernel, part
from erls.maths.motions import (
    bracket,
    change,
    change_transposed,
    cobracket,
    pair_minus,
    pair_plus,
    pair_scaled,
    series,
    transformed,
)
from erls.maths.rotations import exponential, value
from erls.maths.vectors import (
    Twist,
    Vector,
    cross,
    dot,
    of_matrix,
    scaled,
    turned,
    vector,
)


@part
def column(table: Array, j: int) -> Twist:
    """Column j of a (6, n) table: its translational and its rotational part."""
    return (table[0, j], table[1, j], table[2, j]), (table[3, j], table[4, j], table[5, j])


@part
def set_column(table: Array, j: int, a: Twist) -> None:
    """Put a twist or wrench into column j of a (6, n) table."""
    table[0, j], table[1, j], table[2, j] = a[0]
    table[3, j], table[4, j], table[5, j] = a[1]


@part
def _add_power(out: Array, table: Array, j: int, scale: float, force: Twist) -> None:
    """out[:, j] += scale · tableᵀ force."""
    n, m = force
    for i in range(12):
        linear = table[0, i] * n[0] + table[1, i] * n[1] + table[2, i] * n[2]
        out[i, j] += scale * (linear + table[3, i] * m[0] + table[4, i] * m[1] + table[5, i] * m[2])


@part
def inertia_derivatives(
    model: Model, work: Work, e: int, block: Array, u: Vector, psi: Vector, exact: int
) -> None:
    """Those by accelerations and velocities, and what turns of sections do to the weight; those by velocities in
    full if ``exact``, and then at fixed bending those of the weight."""
    if model.beam_moving[e] == LINEAR:
        linear_derivatives(model, work, e, block, psi, exact)
        return
    rows, shape, bends = work.rows, work.shape, work.bends
    c0, c1 = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    apart = pair_minus(c1, c0)
    b = inverse_coefficient(dot(psi, psi))
    eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(HALF, b, u, psi, apart[0], apart[1]))
    _, turn = section(model, work.poses, e, 0)
    down = turned(turn, vector(model.gravity, 0, 0))
    if exact:
        for j in range(12):  # of d̈, by velocities
            first, second = unit_twist(model, e, j)
            q, swing = column(rows, j), pair_minus(second, first)
            bend = change(HALF, b, u, psi, q[0], q[1], apart[0], apart[1])
            bend = pair_plus(bend, change(HALF, b, u, psi, eta[0], eta[1], swing[0], swing[1]))
            bend = pair_plus(bend, bracket(q[0], q[1], c0[0], c0[1]))
            set_column(bends, j, pair_plus(bend, bracket(eta[0], eta[1], first[0], first[1])))
    for k in range(3):
        x, weight = POINTS[k], WEIGHTS[k]
        xu, xpsi = scaled(x, u), scaled(x, psi)
        c = stumpff(x * x * dot(psi, psi))
        f, g = tangent_coefficients(c)
        r = exponential(xpsi, c[0], c[1])
        p = value(-f[0], g[0], xpsi, xu)
        pull = turned(r, down)
        own = pair_scaled(x, series(f, g, xu, xpsi, eta[0], eta[1]))
        direct = transformed(p, r, c0[0], c0[1])
        nu = pair_plus(direct, own)
        momentum = of_matrix(model.beam_inertia, e, nu[0], nu[1])
        for j in range(12):
            q = column(rows, j)
            q = pair_scaled(x, series(f, g, xu, xpsi, q[0], q[1]))
            if j < 6:
                first = unit_twist(model, e, j)[0]
                q = pair_plus(q, transformed(p, r, first[0], first[1]))
            set_column(shape, j, q)
        for j in range(12):
            q = column(shape, j)
            heavy = of_matrix(model.beam_inertia, e, q[0], q[1])
            _add_power(block[0], shape, j, weight, heavy)
            spin = cobracket(nu[0], nu[1], heavy[0], heavy[1])
            spin = pair_plus(spin, cobracket(q[0], q[1], momentum[0], momentum[1]))
            tipped = q[1]
            if exact:
                first = unit_twist(model, e, j)[0]
                carried = transformed(p, r, first[0], first[1])
                tipped = carried[1]  # bending does the rest
                way, bend, bent = pair_minus(q, carried), column(bends, j), column(rows, j)
                rate = pair_scaled(x, series(f, g, xu, xpsi, bend[0], bend[1]))
                curve = change(f, g, xu, xpsi, bent[0], bent[1], eta[0], eta[1])
                curve = pair_plus(curve, change(f, g, xu, xpsi, eta[0], eta[1], bent[0], bent[1]))
                rate = pair_plus(rate, pair_scaled(x * x, curve))
                rate = pair_minus(rate, bracket(way[0], way[1], direct[0], direct[1]))
                rate = pair_minus(rate, bracket(own[0], own[1], carried[0], carried[1]))
                spin = pair_minus(spin, of_matrix(model.beam_inertia, e, rate[0], rate[1]))
            _add_power(block[1], shape, j, -weight, spin)
            tilt = of_matrix(model.beam_inertia, e, cross(tipped, pull), (0.0, 0.0, 0.0))
            _add_power(block[2], shape, j, weight, tilt)


@part
def set_rows(model: Model, work: Work, e: int, u: Vector, psi: Vector) -> None:
    """P (6, 12) of element e, over the twists of its nodes, into ``work.rows``."""
    b = inverse_coefficient(dot(psi, psi))
    for j in range(12):
        c0, c1 = unit_twist(model, e, j)
        apart = pair_minus(c1, c0)
        eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(HALF, b, u, psi, apart[0], apart[1]))
        set_column(work.rows, j, eta)


@part
def elastic_derivatives(
    model: Model, work: Work, e: int, stiffness: Array, u: Vector, psi: Vector, material: int
) -> None:
    """Of internal forces, into a block of zeros."""
    rows, b = work.rows, inverse_coefficient(dot(psi, psi))
    push = section_force(model, e, u, psi)
    for j in range(12):
        eta = column(rows, j)
        force = of_matrix(model.beam_stiffness, e, eta[0], eta[1])
        _add_power(stiffness, rows, j, 1.0, force)
        if material:
            continue
        # derivative of Pᵀ σ at fixed σ as d moves along η
        outer = change_transposed(HALF, b, u, psi, eta[0], eta[1], push[0], push[1])
        inner = pair_minus(cobracket(eta[0], eta[1], push[0], push[1]), outer)
        for side in range(2):
            n, m = inward(model, e, side, inner if side == 0 else outer)
            for i in range(3):
                stiffness[6 * side + i, j] += n[i]
                stiffness[6 * side + 3 + i, j] += m[i]


@kernel(BLOCKS, counted=False)
def beam_derivatives(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Mass, damping and stiffness of all elements, the first ones, into `Work.blocks`, which are zeros."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for e in range(len(model.beam_nodes)):
        u, psi = vector(work.bent, e, 0), vector(work.bent, e, 3)
        set_rows(model, work, e, u, psi)
        elastic_derivatives(model, work, e, work.blocks[e, 2], u, psi, material)
        if model.beam_moving[e]:
            inertia_derivatives(model, work, e, work.blocks[e], u, psi, 0)
