"""Inertia forces and weight of one link, from its kinetic energy, with the effects that are on.

With q = (u, q_d), ν = [v; ω] the twist of the link's frame and s = q̇ + ρ ν = (w, q̇_d):

    T = ½ sᵀ m s + Σ_a ω_a sᵀ X_a q + ½ Σ_ab ω_a ω_b qᵀ Z_ab q

(`fe_import.modal.inertia`). The forces follow from the Boltzmann-Hamel equations of T, so energy is conserved for any
mass matrix. Five parts may be left out (`erls.mechanism.effects`), with s₀ = ρ ν, X_ω = Σ_a ω_a X_a and α = ω̇:

- ``centrifugal_load``: -X_ωᵀ s₀ on the modes;
- ``coriolis``: X_ω q̇ - X_ωᵀ q̇ on the modes;
- ``inertia_first_order``: Σ_a α_a X_a q on the modes, and all of X in the frame's wrench;
- ``inertia_second_order``: all of Z in the frame's wrench;
- ``spin_softening``: -Σ_ab ω_a ω_b Z_ab q on the modes.

With one axis of rotation the wrench holds the moment about that axis only: no joint feels the others. Where the link
has second-order displacements, w + M₀⁻¹ (C q̇ + H w) takes the place of ν (`erls.equations.erls.second_order`).
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.records import Chain, Link, LinkState
from erls.maths.jit import part
from erls.maths.products import add_columns, add_symmetric, clear, dot, pass_columns
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, dot3, dot6


@part
def pair_of(axes: int, a: int, b: int) -> int:
    """Number of a pair of axes."""
    return a if a == b or axes == 1 else a + b + 2


@part
def deform(chain: Chain, link: Link, state: LinkState) -> None:
    """X q about the axes of a link, Z q and qᵀ Z q of their pairs, as far as the inertia of a link needs them."""
    axes, skip = len(link.axes), 6 if link.parent < 0 or chain.bends >= 0 else 0  # u = 0 on the ground and anchored
    if chain.first_order:
        for a in range(axes):
            clear(state.turned[a])
            add_columns(link.x[a, skip:], state.q[skip:], 1.0, state.turned[a])
    if chain.second_order:
        for pair in range(axes * (axes + 1) // 2):
            state.moments[pair] = _square(link.z[pair], state.q, skip, state.squared[pair])


@part
def _square(z: Array, q: Array, skip: int, squared: Array) -> Any:
    """Z q, and qᵀ Z q."""
    clear(squared)
    add_symmetric(z, q, skip, squared)
    return dot(squared[skip:], q[skip:])


@part
def link_forces(chain: Chain, link: Link, state: LinkState, twist: Array, rate: Array, accelerated: bool) -> None:
    """``wrench`` (without the transport of momentum), ``momentum`` and ``modal`` of a link, weight on it included.

    ``twist`` and ``rate`` are those that inertia knows; without ``accelerated`` q̈_d is zero.
    """
    axes, n, ground = len(link.axes), len(state.q), link.parent < 0
    skip = 6 if ground or chain.bends >= 0 else 0  # u = 0 on the ground and anchored
    q, qd, qdd, modal, w, w_rate = state.q, state.q_rate, state.q_acceleration, state.modal, state.w, state.w_rate
    wrench, momentum = state.wrench, state.momentum
    for i in range(6):
        w[i] = twist[i] + qd[i]
        w_rate[i] = rate[i] + qdd[i]

    # m ṡ, with the weight as an acceleration of the frame
    for i in range(6):
        qdd[i] = w_rate[i]
    for i in range(3):
        qdd[i] -= state.down[i]
    clear(modal)
    if accelerated:
        add_symmetric(link.mass, qdd, 0, modal)
    else:
        add_columns(link.mass, qdd[:6], 1.0, modal)
    for i in range(6):
        wrench[i], qdd[i] = modal[i], w_rate[i]
    clear(momentum)
    for j in range(n if not ground or chain.complete or chain.bends >= 0 else 0):  # otherwise nobody asks for it
        speed = w[j] if j < 6 else qd[j]
        for i in range(6):
            momentum[i] += link.mass[j, i] * speed

    if chain.second_order or chain.softening:
        for pair in range(axes * (axes + 1) // 2):
            state.moments[pair] = _square(link.z[pair], state.q, skip, state.squared[pair])
    for a in range(axes):
        axis, xq, xqd = link.axes[a], state.turned[a], state.turned_rate[a]
        omega, alpha = dot3(axis, twist[3:]), dot3(axis, rate[3:])
        if chain.first_order or chain.coriolis:
            clear(xq)
            clear(xqd)
        if chain.coriolis:  # -ω X_ωᵀ s with all velocities when the centrifugal load is on too, otherwise those of q
            for i in range(n):
                state.speeds[i] = omega * qd[i]
            if chain.centrifugal:
                for i in range(6):
                    state.speeds[i] = omega * w[i]
            pass_columns(link.x[a], skip, q, qd, xq, xqd, state.speeds, modal)
            for i in range(n):
                modal[i] += omega * xqd[i]
        elif chain.first_order:
            add_columns(link.x[a, skip:], q[skip:], 1.0, xq)
            add_columns(link.x[a, skip:], qd[skip:], 1.0, xqd)
        if chain.centrifugal and not chain.coriolis:
            for j in range(skip, n):
                modal[j] -= omega * dot6(link.x[a, j], twist)
        if chain.first_order:
            for i in range(6):
                wrench[i] += alpha * xq[i] + omega * xqd[i]
                momentum[i] += omega * xq[i]
            for i in range(n):
                modal[i] += alpha * xq[i]
            # X q · s and its derivative, about the axis
            spin = dot6(xq, w) + dot(xq[6:], qd[6:])
            spin_rate = dot6(xq, w_rate) + dot6(xqd, w) + dot(xqd[6:], qd[6:])
            if accelerated:
                spin_rate += dot(xq[6:], qdd[6:])
            for i in range(3):
                momentum[3 + i] += spin * axis[i]
                wrench[3 + i] += spin_rate * axis[i]
        if chain.second_order or chain.softening:
            for b in range(axes):
                squared, other = state.squared[pair_of(axes, a, b)], dot3(link.axes[b], twist[3:])
                if chain.second_order:
                    moment = state.moments[pair_of(axes, a, b)]
                    moment_rate = moment * dot3(link.axes[b], rate[3:]) + 2 * other * dot(squared[skip:], qd[skip:])
                    for i in range(3):
                        momentum[3 + i] += moment * other * axis[i]
                        wrench[3 + i] += moment_rate * axis[i]
                if chain.softening:
                    for i in range(n):
                        modal[i] -= omega * other * squared[i]


@part
def weigh_displaced(link: Link, state: LinkState) -> None:
    """Take the moment of weight on the displaced mass from ``wrench``."""
    moment = state.point[:3]
    clear(moment)
    skip = 6 if link.parent < 0 else 0
    for j in range(skip, len(state.q)):
        for i in range(3):
            moment[i] += link.mass[j, i] * state.q[j]
    add_cross(moment, state.down, -1.0, state.wrench[3:])
