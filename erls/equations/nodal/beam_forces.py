"""Two-node geometrically exact beams with helicoidal interpolation on SE(3).

V. Sonneville, A. Cardona, O. Brüls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451–474. Between the section frames at
its ends an element follows H(s) = H_A exp(s d / L), d = log(H_A⁻¹ H_B): the strain (d − d₀)/L is constant, exact for
every helix, and free of locking. With the twists ν of the end sections, ḋ = P ν, P = [−T⁻¹(−d), T⁻¹(d)], so that

    f = Pᵀ σ,  σ = K (d − d₀)/L,    K_t = Pᵀ K P / L + (∂Pᵀ/∂d σ) P,

all functions of d alone. Inertia is that of the same interpolation: ν(s) = Q(s, d) ν at three Gauss points, and forces
∫ Qᵀ (M ν̇ − ad(ν)ᵀ M ν) ds with ν̇ = Q a + Q̇ ν, which follow from the kinetic energy ½ ∫ νᵀ M ν ds.
"""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.beam_ends import NONE, inward, outward, section_at, unit_twist
from erls.equations.nodal.beam_linear import linear_derivatives, linear_energies, linear_inertia
from erls.equations.nodal.contract import (
    BLOCKS,
    ENERGIES,
    FORCES,
    HELICOIDAL,
    LINEAR,
    REMEMBER,
    Model,
    Work,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.maths.coefficients import Three, inverse_coefficient, stumpff, tangent_coefficients
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
    series_transposed,
    transformed,
    transposed,
)
from erls.maths.rotations import exponential, logarithm_near, value
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    add,
    back_product,
    cross,
    dot,
    minus,
    nine,
    of_matrix,
    plus,
    product,
    scaled,
    times,
    turned,
    unit,
    vector,
)

_POINTS = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))  # of Gauss's rule on a length of one
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
_HALF = (0.5, 0.0, 0.0)


@part
def _bend(model: Model, poses: Array, before: Array, out: Array, e: int) -> tuple[Vector, Vector]:
    """d of element e, which goes on past a turn of π, near that in ``before``; also written into ``out``."""
    place, turn = section_at(model, poses, e, 0)
    end, end_turn = section_at(model, poses, e, 1)
    psi = logarithm_near(back_product(turn, end_turn), vector(before, e, 3))
    u = value(-0.5, inverse_coefficient(dot(psi, psi))[0], psi, turned(turn, minus(end, place)))
    out[e, 0], out[e, 1], out[e, 2] = u
    out[e, 3], out[e, 4], out[e, 5] = psi
    return u, psi


@part
def _section_force(model: Model, e: int, u: Vector, psi: Vector) -> Twist:
    built = model.beam_built
    return of_matrix(model.beam_stiffness, e, minus(u, vector(built, e, 0)), minus(psi, vector(built, e, 3)))


@part
def _inertia(model: Model, work: Work, e: int, u: Vector, psi: Vector, b: Three) -> tuple[Twist, Twist]:
    """Inertia less weight as a wrench on the first section, and one along d."""
    c0, c1 = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    a0, a1 = outward(model, e, 0, work.rate), outward(model, e, 1, work.rate)
    apart, pull = pair_minus(c1, c0), pair_minus(a1, a0)
    eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(_HALF, b, u, psi, apart[0], apart[1]))
    gain = pair_plus(bracket(u, psi, a0[0], a0[1]), series(_HALF, b, u, psi, pull[0], pull[1]))
    gain = pair_plus(gain, change(_HALF, b, u, psi, eta[0], eta[1], apart[0], apart[1]))
    gain = pair_plus(gain, bracket(eta[0], eta[1], c0[0], c0[1]))
    _, turn = section_at(model, work.poses, e, 0)
    down = turned(turn, vector(model.gravity, 0, 0))
    angle = dot(psi, psi)
    direct = along = NONE
    for k in range(3):
        x, weight = _POINTS[k], _WEIGHTS[k]
        xu, xpsi = scaled(x, u), scaled(x, psi)
        c = stumpff(x * x * angle)
        f, g = tangent_coefficients(c)
        r = exponential(xpsi, c[0], c[1])
        p = value(-f[0], g[0], xpsi, xu)
        carried = transformed(p, r, c0[0], c0[1])
        own = pair_scaled(x, series(f, g, xu, xpsi, eta[0], eta[1]))
        nu = pair_plus(carried, own)
        rate = pair_plus(transformed(p, r, a0[0], a0[1]), pair_scaled(x, series(f, g, xu, xpsi, gain[0], gain[1])))
        curve = change(f, g, xu, xpsi, scaled(x, eta[0]), scaled(x, eta[1]), eta[0], eta[1])
        rate = pair_plus(rate, pair_scaled(x, curve))
        rate = pair_minus(rate, bracket(own[0], own[1], carried[0], carried[1]))
        force = of_matrix(model.beam_inertia, e, minus(rate[0], turned(r, down)), rate[1])
        momentum = of_matrix(model.beam_inertia, e, nu[0], nu[1])
        force = pair_minus(force, cobracket(nu[0], nu[1], momentum[0], momentum[1]))
        force = pair_scaled(weight, force)
        direct = pair_plus(direct, transposed(p, r, force[0], force[1]))
        along = pair_plus(along, pair_scaled(x, series_transposed(f, g, xu, xpsi, force[0], force[1])))
    return direct, along


@kernel(FORCES, counted=False)
def beam_forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Add inertia and internal forces less weight to the force in `Work`, from poses, twists and rates there."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before, out = read_state(last, integers, known.state).bent, work.force
    for e in range(len(model.beam_nodes)):
        u, psi = _bend(model, work.poses, before, work.bent, e)
        b = inverse_coefficient(dot(psi, psi))
        push = _section_force(model, e, u, psi)
        direct = further = NONE
        if model.beam_moving[e] == HELICOIDAL:
            direct, along = _inertia(model, work, e, u, psi, b)
            push = pair_plus(push, along)
        elif model.beam_moving[e] == LINEAR:
            direct, further = linear_inertia(model, work, e)
        outer = series_transposed(_HALF, b, u, psi, push[0], push[1])
        inner = pair_plus(direct, pair_minus(cobracket(u, psi, push[0], push[1]), outer))
        outer = pair_plus(outer, further)
        for side in range(2):
            force = inward(model, e, side, inner if side == 0 else outer)
            at = 6 * model.beam_nodes[e, side]
            add(out, at, force[0])
            add(out, at + 3, force[1])


@kernel(REMEMBER, counted=False)
def bend_beams(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """d of all elements at the poses of `Work`, near those of ``last``."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before = read_state(last, integers, known.state).bent
    for e in range(len(model.beam_nodes)):
        _bend(model, work.poses, before, work.bent, e)


@part
def _column(table: Array, j: int) -> Twist:
    return (table[0, j], table[1, j], table[2, j]), (table[3, j], table[4, j], table[5, j])


@part
def _set_column(table: Array, j: int, a: Twist) -> None:
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
def _inertia_derivatives(model: Model, work: Work, e: int, block: Array, u: Vector, psi: Vector) -> None:
    rows, shape = work.rows, work.shape
    c0, c1 = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    apart = pair_minus(c1, c0)
    b = inverse_coefficient(dot(psi, psi))
    eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(_HALF, b, u, psi, apart[0], apart[1]))
    _, turn = section_at(model, work.poses, e, 0)
    down = turned(turn, vector(model.gravity, 0, 0))
    for k in range(3):
        x, weight = _POINTS[k], _WEIGHTS[k]
        xu, xpsi = scaled(x, u), scaled(x, psi)
        c = stumpff(x * x * dot(psi, psi))
        f, g = tangent_coefficients(c)
        r = exponential(xpsi, c[0], c[1])
        p = value(-f[0], g[0], xpsi, xu)
        pull = turned(r, down)
        own = pair_scaled(x, series(f, g, xu, xpsi, eta[0], eta[1]))
        nu = pair_plus(transformed(p, r, c0[0], c0[1]), own)
        momentum = of_matrix(model.beam_inertia, e, nu[0], nu[1])
        for j in range(12):
            q = _column(rows, j)
            q = pair_scaled(x, series(f, g, xu, xpsi, q[0], q[1]))
            if j < 6:
                first = unit_twist(model, e, j)[0]
                q = pair_plus(q, transformed(p, r, first[0], first[1]))
            _set_column(shape, j, q)
        for j in range(12):
            q = _column(shape, j)
            heavy = of_matrix(model.beam_inertia, e, q[0], q[1])
            _add_power(block[0], shape, j, weight, heavy)
            tilt = of_matrix(model.beam_inertia, e, cross(q[1], pull), (0.0, 0.0, 0.0))
            _add_power(block[2], shape, j, weight, tilt)
            spin = cobracket(nu[0], nu[1], heavy[0], heavy[1])
            spin = pair_plus(spin, cobracket(q[0], q[1], momentum[0], momentum[1]))
            _add_power(block[1], shape, j, -weight, spin)


@part
def _derivatives(model: Model, work: Work, e: int, block: Array, material: int) -> None:
    """Mass, damping and stiffness of element e at ``work``'s poses, bends and twists into a block of zeros."""
    stiffness, rows = block[2], work.rows
    u, psi = vector(work.bent, e, 0), vector(work.bent, e, 3)
    b = inverse_coefficient(dot(psi, psi))
    push = _section_force(model, e, u, psi)
    for j in range(12):
        c0, c1 = unit_twist(model, e, j)
        apart = pair_minus(c1, c0)
        eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(_HALF, b, u, psi, apart[0], apart[1]))
        _set_column(rows, j, eta)
    for j in range(12):
        eta = _column(rows, j)
        force = of_matrix(model.beam_stiffness, e, eta[0], eta[1])
        _add_power(stiffness, rows, j, 1.0, force)
        if material:
            continue
        # derivative of Pᵀ σ at fixed σ as d moves along η
        outer = change_transposed(_HALF, b, u, psi, eta[0], eta[1], push[0], push[1])
        inner = pair_minus(cobracket(eta[0], eta[1], push[0], push[1]), outer)
        for side in range(2):
            n, m = inward(model, e, side, inner if side == 0 else outer)
            for i in range(3):
                stiffness[6 * side + i, j] += n[i]
                stiffness[6 * side + 3 + i, j] += m[i]
    if model.beam_moving[e] == HELICOIDAL:
        _inertia_derivatives(model, work, e, block, u, psi)
    elif model.beam_moving[e] == LINEAR:
        linear_derivatives(model, work, e, block)


@kernel(BLOCKS, counted=False)
def beam_derivatives(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Mass, damping and stiffness of all elements, the first ones, into `Work.blocks`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for e in range(len(model.beam_nodes)):
        _derivatives(model, work, e, work.blocks[e], material)


@part
def _energy(model: Model, work: Work, e: int) -> tuple[float, float, float]:
    """Kinetic, elastic and that of gravity of element e."""
    u, psi = vector(work.bent, e, 0), vector(work.bent, e, 3)
    built = model.beam_built
    push = _section_force(model, e, u, psi)
    strain = minus(u, vector(built, e, 0)), minus(psi, vector(built, e, 3))
    elastic = 0.5 * (dot(push[0], strain[0]) + dot(push[1], strain[1]))
    if model.beam_moving[e] == LINEAR:
        kinetic, gravity = linear_energies(model, work, e)
        return kinetic, elastic, gravity
    kinetic = height = 0.0 * elastic
    b = inverse_coefficient(dot(psi, psi))
    c0, c1 = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    apart = pair_minus(c1, c0)
    eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(_HALF, b, u, psi, apart[0], apart[1]))
    place, turn = section_at(model, work.poses, e, 0)
    for k in range(3):
        x = _POINTS[k]
        xu, xpsi = scaled(x, u), scaled(x, psi)
        c = stumpff(x * x * dot(psi, psi))
        f, g = tangent_coefficients(c)
        p = value(-f[0], g[0], xpsi, xu)
        own = pair_scaled(x, series(f, g, xu, xpsi, eta[0], eta[1]))
        nu = pair_plus(transformed(p, exponential(xpsi, c[0], c[1]), c0[0], c0[1]), own)
        momentum = of_matrix(model.beam_inertia, e, nu[0], nu[1])
        kinetic += 0.5 * _WEIGHTS[k] * (dot(nu[0], momentum[0]) + dot(nu[1], momentum[1]))
        height += _WEIGHTS[k] * dot(vector(model.gravity, 0, 0), plus(place, times(turn, p)))
    return kinetic, elastic, -model.beam_inertia[e, 0, 0] * height


@kernel(ENERGIES, counted=False)
def beam_energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Add kinetic and elastic energy and that of gravity."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for e in range(len(model.beam_nodes)):
        kinetic, elastic, gravity = _energy(model, work, e)
        out[0] += kinetic
        out[1] += elastic
        out[2] += gravity
