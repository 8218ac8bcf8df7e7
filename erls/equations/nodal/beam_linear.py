"""Inertia and weight of beam elements whose places and turns are linear between their ends.

With shares N = (1 - x, x) along an element, the world's velocities ẋ of its end sections and their angular velocities
ω, each in its own axes,

    T = ½ Σ_ij n_ij (m ẋ_i · ẋ_j + ω_i · J ω_j),   n_ij = ∫ N_i N_j dx = 1/3 or 1/6,

the consistent mass of the linear two-node element with rotary inertia (M. Géradin, A. Cardona, Flexible Multibody
Dynamics, 2001, ch. 4). It knows nothing of how an element bends between its ends, so that single elements are less
heavy against turning than those of `beam_forces`; both converge to the same. Forces follow from T:

    f_i = R_iᵀ Σ_j n_ij m ẍ_j - ½ m R_iᵀ g,   μ_i = Σ_j n_ij J ω̇_j + ω_i × Σ_j n_ij J ω_j.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.beam_ends import inward, outward, section, unit_twist
from erls.equations.nodal.contract import Model, Work
from erls.maths.coefficients import stumpff
from erls.maths.jit import part
from erls.maths.rotations import exponential
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    cross,
    dot,
    minus,
    of_matrix,
    plus,
    scaled,
    times,
    turned,
    vector,
)

_SAME, _OTHER = 1.0 / 3.0, 1.0 / 6.0
_ZERO = (0.0, 0.0, 0.0)


@part
def _mean(own: Vector, other: Vector) -> Vector:
    """Σ_j n_ij of what both ends have, ``own`` first."""
    return plus(scaled(_SAME, own), scaled(_OTHER, other))


@part
def _turning(model: Model, e: int, own: Vector, other: Vector) -> Vector:
    """Σ_j n_ij J of what both ends have."""
    return of_matrix(model.beam_inertia, e, _ZERO, _mean(own, other))[1]


@part
def _between(psi: Vector) -> Rotation:
    """Turn of the second section in the first."""
    c = stumpff(dot(psi, psi))
    return exponential(psi, c[0], c[1])


@part
def linear_inertia(model: Model, work: Work, e: int, psi: Vector) -> tuple[Twist, Twist]:
    """Inertia less weight as wrenches on the first and on the second section, turned by ψ, in their own axes."""
    mass, r = model.beam_inertia[e, 0, 0], _between(psi)
    down = turned(section(model, work.poses, e, 0)[1], scaled(0.5, vector(model.gravity, 0, 0)))
    (v0, w0), (v1, w1) = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    (a0, b0), (a1, b1) = outward(model, e, 0, work.rate), outward(model, e, 1, work.rate)
    x0, x1 = plus(a0, cross(w0, v0)), plus(a1, cross(w1, v1))
    f0 = scaled(mass, minus(_mean(x0, times(r, x1)), down))
    f1 = scaled(mass, minus(_mean(x1, turned(r, x0)), turned(r, down)))
    m0 = plus(_turning(model, e, b0, b1), cross(w0, _turning(model, e, w0, w1)))
    m1 = plus(_turning(model, e, b1, b0), cross(w1, _turning(model, e, w1, w0)))
    return (f0, m0), (f1, m1)


@part
def _add_column(model: Model, e: int, out: Array, j: int, first: Twist, second: Twist) -> None:
    """Wrenches on both sections, as forces on the nodes, into a column of a block."""
    for side in range(2):
        force, moment = inward(model, e, side, first if side == 0 else second)
        for i in range(3):
            out[6 * side + i, j] += force[i]
            out[6 * side + 3 + i, j] += moment[i]


@part
def linear_derivatives(model: Model, work: Work, e: int, block: Array, psi: Vector, exact: int) -> None:
    """Add those by accelerations and velocities, and what turns of sections do to the weight; if ``exact``, at fixed
    bending.
    """
    mass, r = model.beam_inertia[e, 0, 0], _between(psi)
    half = scaled(0.5 * mass, vector(model.gravity, 0, 0))
    (v0, w0), (v1, w1) = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    pull0 = turned(section(model, work.poses, e, 0)[1], half)
    pull1 = turned(r, pull0)
    spin0, spin1 = _turning(model, e, w0, w1), _turning(model, e, w1, w0)
    for j in range(12):
        (c0, d0), (c1, d1) = unit_twist(model, e, j)
        m0, m1 = _turning(model, e, d0, d1), _turning(model, e, d1, d0)
        first, second = (scaled(mass, _mean(c0, times(r, c1))), m0), (scaled(mass, _mean(c1, turned(r, c0))), m1)
        _add_column(model, e, block[0], j, first, second)
        k0, k1 = plus(cross(d0, v0), cross(w0, c0)), plus(cross(d1, v1), cross(w1, c1))
        g0, g1 = plus(cross(d0, spin0), cross(w0, m0)), plus(cross(d1, spin1), cross(w1, m1))
        first, second = (scaled(mass, _mean(k0, times(r, k1))), g0), (scaled(mass, _mean(k1, turned(r, k0))), g1)
        _add_column(model, e, block[1], j, first, second)
        tipped = turned(r, d0) if exact else d1
        _add_column(model, e, block[2], j, (cross(d0, pull0), _ZERO), (cross(tipped, pull1), _ZERO))


@part
def linear_energies(model: Model, work: Work, e: int) -> tuple[float, float]:
    """Kinetic energy, and that of gravity."""
    mass = model.beam_inertia[e, 0, 0]
    (v0, w0), (v1, w1) = outward(model, e, 0, work.twist), outward(model, e, 1, work.twist)
    (p0, r0), (p1, r1) = section(model, work.poses, e, 0), section(model, work.poses, e, 1)
    x0, x1 = times(r0, v0), times(r1, v1)
    kinetic = mass * (dot(x0, _mean(x0, x1)) + dot(x1, _mean(x1, x0)))
    kinetic += dot(w0, _turning(model, e, w0, w1)) + dot(w1, _turning(model, e, w1, w0))
    return 0.5 * kinetic, -0.5 * mass * dot(vector(model.gravity, 0, 0), plus(p0, p1))
