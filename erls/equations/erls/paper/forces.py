"""Inertia forces of one flexible link in its own frame, from its kinetic energy.

With q the modal coordinates, ν = [v; ω] the twist of the link's frame and s = q̇ + ρ ν:

    T = ½ sᵀ m s + Σ_a ω_a sᵀ X_a q + ½ Σ_ab ω_a ω_b qᵀ Z_ab q

(see `fe_import.modal.inertia`). The forces follow from the Boltzmann-Hamel equations of T, so energy is conserved
for any mass matrix, commuting with nodal rotations or not; where the paper's eq. (49) has 2 UᵀM Ω U q̇, they have
X_ω q̇ - X_ωᵀ q̇. Of these forces five parts may be left out (`erls.mechanism.effects`), with s₀ = ρ ν,
X_ω = Σ_a ω_a X_a and α = ω̇:

- ``centrifugal_load``: -X_ωᵀ s₀ on the modes;
- ``coriolis``: X_ω q̇ - X_ωᵀ q̇ on the modes;
- ``inertia_first_order``: Σ_a α_a X_a q on the modes, and all of X in the frame's wrench;
- ``inertia_second_order``: all of Z in the frame's wrench;
- ``spin_softening``: -Σ_ab ω_a ω_b Z_ab q on the modes.

The first three come from the second term of T, the others from the third. Energy is conserved when each term is there
with all forces that do work, or with none; ``coriolis`` does none.
"""

from __future__ import annotations

from erls.equations.erls.paper.records import Body, BodyState, Paper
from erls.maths.jit import part
from erls.maths.products import add_columns, add_rows, clear, dot
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, dot3


@part
def fill_moments(paper: Paper, body: Body, state: BodyState) -> None:
    """X_a q, Z_ab q and qᵀ Z_ab q."""
    if paper.first_order:
        for a in range(3):
            clear(state.xq[a])
            add_rows(body.x[a], state.q, 1.0, state.xq[a])
    if paper.second_order or paper.softening:
        for pair in range(9):
            clear(state.zq[pair])
            add_rows(body.z[pair], state.q, 1.0, state.zq[pair])
            state.zqq[pair] = dot(state.zq[pair], state.q)


@part
def add_inertia_forces(paper: Paper, body: Body, state: BodyState) -> None:
    """Inertia forces at ``twist``, ``twist_rate`` and at q, q̇, q̈, after `fill_moments`.

    Adds to ``force`` the derivatives of p = ∂T/∂ν, and d/dt ∂T/∂q̇ - ∂T/∂q; p is left in the state. In the moving frame
    -ad(ν)ᵀ p is still to be added to the former.
    """
    twist, rate, omega, alpha = state.twist, state.twist_rate, state.twist[3:], state.twist_rate[3:]
    rates, wrench, modal = state.velocity[6:], state.force[:6], state.force[6:]
    for i in range(len(state.q)):
        state.s[i], state.s_rate[i] = rates[i], state.acceleration[6 + i]
    add_rows(body.rigid, twist, 1.0, state.s)
    add_rows(body.rigid, rate, 1.0, state.s_rate)
    clear(state.momentum)
    clear(state.momentum_rate)
    add_rows(body.m, state.s, 1.0, state.momentum)
    add_rows(body.m, state.s_rate, 1.0, state.momentum_rate)
    if paper.first_order:
        add_columns(state.xq, omega, 1.0, state.momentum)
        add_columns(state.xq, alpha, 1.0, state.momentum_rate)
    for i in range(len(modal)):
        modal[i] += state.momentum_rate[i]
    if paper.first_order or paper.coriolis:
        for a in range(3):
            clear(state.xqd[a])
            add_rows(body.x[a], rates, 1.0, state.xqd[a])
    if paper.coriolis:
        add_columns(state.xqd, omega, 1.0, modal)
    if paper.first_order:
        add_columns(state.xqd, omega, 1.0, state.momentum_rate)
    clear(state.p)
    add_columns(body.rigid, state.momentum, 1.0, state.p)
    add_columns(body.rigid, state.momentum_rate, 1.0, wrench)
    if paper.first_order:
        for a in range(3):
            state.p[3 + a] += dot(state.xq[a], state.s)
            wrench[3 + a] += dot(state.xq[a], state.s_rate) + dot(state.xqd[a], state.s)
    _add_turning(paper, body, state, rates, modal)
    if paper.second_order:
        for pair in range(9):
            state.zqqd[pair] = dot(state.zq[pair], rates)
        for a in range(3):
            for b in range(3):
                state.p[3 + a] += state.zqq[3 * a + b] * omega[b]
                wrench[3 + a] += state.zqq[3 * a + b] * alpha[b]
                wrench[3 + a] += (state.zqqd[3 * a + b] + state.zqqd[3 * b + a]) * omega[b]
    if paper.softening:
        for a in range(3):
            add_columns(state.zq[3 * a : 3 * a + 3], omega, -omega[a], modal)


@part
def _add_turning(paper: Paper, body: Body, state: BodyState, rates: Array, modal: Array) -> None:
    """-X_ωᵀ (q̇ + s₀), of which the effects keep a part; ``momentum`` and ``momentum_rate`` are used up."""
    if not (paper.centrifugal or paper.coriolis):
        return
    moving = state.momentum
    for i in range(len(moving)):
        moving[i] = state.s[i] if paper.centrifugal else rates[i]
        if not paper.coriolis:
            moving[i] -= rates[i]
    for a in range(3):
        add_columns(body.x[a], moving, -state.twist[3 + a], modal)


@part
def fill_mass(paper: Paper, body: Body, state: BodyState) -> None:
    """Mass matrix of (ν, q̇) into ``mass``, after `fill_moments`: L of the paper's eq. (71)."""
    n, mass = len(state.q), state.mass
    for i in range(n):
        for j in range(n):
            mass[6 + i, 6 + j] = body.m[i, j]
        for j in range(6):
            mass[6 + i, j] = body.rigid_coupling[i, j]
    for i in range(6):
        for j in range(6):
            mass[i, j] = body.rigid_mass[i, j]
    if paper.first_order:
        for a in range(3):
            for i in range(n):
                mass[6 + i, 3 + a] += state.xq[a, i]
            clear(state.p)
            add_columns(body.rigid, state.xq[a], 1.0, state.p)
            for i in range(6):
                mass[i, 3 + a] += state.p[i]
                mass[3 + a, i] += state.p[i]
    if paper.second_order:
        for a in range(3):
            for b in range(3):
                mass[3 + a, 3 + b] += (state.zqq[3 * a + b] + state.zqq[3 * b + a]) / 2
    for i in range(n):
        for j in range(6):
            mass[j, 6 + i] = mass[6 + i, j]


@part
def subtract_weight(body: Body, state: BodyState) -> None:
    """Weight on frame and modes: eq. (59), (61)-(63), and its potential."""
    g, moment = state.gravity, state.moment
    for i in range(3):
        moment[i] = body.first_moment[i]
        state.force[i] -= body.mass * g[i]
    add_rows(body.first_shape, state.q, 1.0, moment)
    add_cross(moment, g, -1.0, state.force[3:6])
    add_columns(body.first_shape, g, -1.0, state.force[6:])
    state.potential[0] -= dot3(g, moment)
    for i in range(3):  # the frame's place in its own axes
        height = state.world[i] * state.world[9] + state.world[3 + i] * state.world[10]
        state.potential[0] -= body.mass * g[i] * (height + state.world[6 + i] * state.world[11])
