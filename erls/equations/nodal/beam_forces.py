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
from erls.equations.nodal.beam_ends import NONE, inward, outward, section
from erls.equations.nodal.beam_linear import linear_energies, linear_inertia
from erls.equations.nodal.contract import (
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
    Twist,
    Vector,
    add,
    back_product,
    dot,
    minus,
    of_matrix,
    plus,
    scaled,
    times,
    turned,
    vector,
)

POINTS = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))  # of Gauss's rule on a length of one
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
HALF = (0.5, 0.0, 0.0)


@part
def _bend(model: Model, poses: Array, before: Array, out: Array, e: int) -> tuple[Vector, Vector]:
    """d of element e, which goes on past a turn of π, near that in ``before``; also written into ``out``."""
    place, turn = section(model, poses, e, 0)
    end, end_turn = section(model, poses, e, 1)
    psi = logarithm_near(back_product(turn, end_turn), vector(before, e, 3))
    u = value(-0.5, inverse_coefficient(dot(psi, psi))[0], psi, turned(turn, minus(end, place)))
    out[e, 0], out[e, 1], out[e, 2] = u
    out[e, 3], out[e, 4], out[e, 5] = psi
    return u, psi


@part
def section_force(model: Model, e: int, u: Vector, psi: Vector) -> Twist:
    """Force [N] and moment [N m] of a section, of the strains of element e less those that it was built with."""
    built = model.beam_built
    return of_matrix(model.beam_stiffness, e, minus(u, vector(built, e, 0)), minus(psi, vector(built, e, 3)))


@part
def _inertia(model: Model, work: Work, e: int, u: Vector, psi: Vector, b: Three) -> tuple[Twist, Twist]:
    """Inertia less weight as a wrench on the first section, and one along d."""
    c0, c1 = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    a0, a1 = outward(model, e, 0, work.rate), outward(model, e, 1, work.rate)
    apart, pull = pair_minus(c1, c0), pair_minus(a1, a0)
    eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(HALF, b, u, psi, apart[0], apart[1]))
    gain = pair_plus(bracket(u, psi, a0[0], a0[1]), series(HALF, b, u, psi, pull[0], pull[1]))
    gain = pair_plus(gain, change(HALF, b, u, psi, eta[0], eta[1], apart[0], apart[1]))
    gain = pair_plus(gain, bracket(eta[0], eta[1], c0[0], c0[1]))
    _, turn = section(model, work.poses, e, 0)
    down = turned(turn, vector(model.gravity, 0, 0))
    angle = dot(psi, psi)
    direct = along = NONE
    for k in range(3):
        x, weight = POINTS[k], WEIGHTS[k]
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


@part
def between(model: Model, work: Work, e: int, u: Vector, psi: Vector) -> tuple[Twist, Twist]:
    """Inertia and internal forces less weight of element e, bent by [u; ψ], on its first and its second section."""
    b = inverse_coefficient(dot(psi, psi))
    push = section_force(model, e, u, psi)
    direct = further = NONE
    if model.beam_moving[e] == HELICOIDAL:
        direct, along = _inertia(model, work, e, u, psi, b)
        push = pair_plus(push, along)
    elif model.beam_moving[e] == LINEAR:
        direct, further = linear_inertia(model, work, e, psi)
    outer = series_transposed(HALF, b, u, psi, push[0], push[1])
    inner = pair_plus(direct, pair_minus(cobracket(u, psi, push[0], push[1]), outer))
    return inner, pair_plus(outer, further)


@kernel(FORCES, counted=False)
def beam_forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Add inertia and internal forces less weight to the force in `Work`, from poses, twists and rates there."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before, out = read_state(last, integers, known.state).bent, work.force
    for e in range(len(model.beam_nodes)):
        u, psi = _bend(model, work.poses, before, work.bent, e)
        inner, outer = between(model, work, e, u, psi)
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
def _energy(model: Model, work: Work, e: int) -> tuple[float, float, float]:
    """Kinetic, elastic and that of gravity of element e."""
    u, psi = vector(work.bent, e, 0), vector(work.bent, e, 3)
    built = model.beam_built
    push = section_force(model, e, u, psi)
    strain = minus(u, vector(built, e, 0)), minus(psi, vector(built, e, 3))
    elastic = 0.5 * (dot(push[0], strain[0]) + dot(push[1], strain[1]))
    if model.beam_moving[e] == LINEAR:
        kinetic, gravity = linear_energies(model, work, e)
        return kinetic, elastic, gravity
    kinetic = height = 0.0 * elastic
    b = inverse_coefficient(dot(psi, psi))
    c0, c1 = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    apart = pair_minus(c1, c0)
    eta = pair_plus(bracket(u, psi, c0[0], c0[1]), series(HALF, b, u, psi, apart[0], apart[1]))
    place, turn = section(model, work.poses, e, 0)
    for k in range(3):
        x = POINTS[k]
        xu, xpsi = scaled(x, u), scaled(x, psi)
        c = stumpff(x * x * dot(psi, psi))
        f, g = tangent_coefficients(c)
        p = value(-f[0], g[0], xpsi, xu)
        own = pair_scaled(x, series(f, g, xu, xpsi, eta[0], eta[1]))
        nu = pair_plus(transformed(p, exponential(xpsi, c[0], c[1]), c0[0], c0[1]), own)
        momentum = of_matrix(model.beam_inertia, e, nu[0], nu[1])
        kinetic += 0.5 * WEIGHTS[k] * (dot(nu[0], momentum[0]) + dot(nu[1], momentum[1]))
        height += WEIGHTS[k] * dot(vector(model.gravity, 0, 0), plus(place, times(turn, p)))
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
