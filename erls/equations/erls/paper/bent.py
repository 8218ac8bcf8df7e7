"""Inertia and weight of a link with its second-order displacement ½ qᵀ Ψ q, for ERLS: geometric stiffening.

Of the velocity of that displacement the kinetic energy needs, to second order in q, what it has in common with
rigid-body motions: the momenta, with ν = [v; ω] the twist of the link's frame and the tensors of
`fe_import.second_order.data`,

    h = C q̇ + H ν,   C = [S_ab q; qᵀ P],   H = [0, -S̃; 0, ½ qᵀ W q],   S = ½ qᵀ S_ab q.

They are those of a rigid-body motion with twist M₀⁻¹ h, M₀ the mass matrix of the undeformed link, so that

    T = T₁(ν + M₀⁻¹ h, q, q̇)

with the kinetic energy T₁ of the linear modes (`erls.equations.erls.paper.forces`): positive for any q, and with forces
that conserve energy. Weight adds -g·S to the potential. Beside rigid-body motion of the frame itself what acts on q is

    (S_ab q)·(v̇ + ω × v - g) + α_c P_cᵀ q + ω_c (P_cᵀ - P_c) q̇ - ω_c ω_d W_cd q.

What that velocity has in common with the elastic modes is the effect ``modal_inertia``: T₃ = q̇_e·k + ½ kᵀ σ⁻¹ k with
k = K(q) q̇, derived in `erls.equations.serial.modal_inertia`.
"""

from __future__ import annotations

from erls.equations.erls.paper.bent_records import (
    BENT_BODY,
    BENT_STATE,
    OF_LINK,
    BentBody,
    BentState,
    read_bent_body,
    read_bent_state,
)
from erls.equations.erls.paper.records import BODY_STATE, BodyState, Paper, read_body_state, read_paper
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import (
    add_columns,
    add_product,
    add_rows,
    add_transposed_product,
    clear,
    clear_matrix,
    dot,
)
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, dot3
from fe_import.model import IntArray


@part
def _fill_bend(bent: BentBody, state: BentState, q: Array) -> None:
    """C, W q, S, ½ qᵀ W q and K."""
    for i in range(6):
        clear(state.coupling[i])
        add_rows(bent.coupling[i], q, 1.0, state.coupling[i])
    for i in range(9):
        clear(state.spun[i])
        add_rows(bent.spin[i], q, 1.0, state.spun[i])
    for i in range(3):
        state.moment[i] = dot(state.coupling[i], q) / 2
        for j in range(3):
            state.square[i, j] = dot(state.spun[3 * i + j], q) / 2
    for c in range(bent.warp.shape[0]):
        clear(state.warp[c])
        add_rows(bent.warp[c], q, 1.0, state.warp[c])


@part
def _add_block(moment: Array, square: Array, x: Array, out: Array) -> None:
    """Add H x."""
    add_cross(moment, x[3:], -1.0, out[:3])
    add_rows(square, x[3:], 1.0, out[3:])


@part
def _add_block_back(moment: Array, square: Array, x: Array, out: Array) -> None:
    """Add Hᵀ x."""
    add_cross(moment, x[:3], 1.0, out[3:])
    add_columns(square, x[3:], 1.0, out[3:])


@part
def _correct_twist(bent: BentBody, state: BentState, body: BodyState) -> None:
    """ν + M₀⁻¹ h and its derivative in the place of ν and ν̇."""
    rates, nu, nu_rate = body.velocity[6:], body.velocity[:6], body.acceleration[:6]
    for i in range(6):
        clear(state.coupling_rate[i])
        add_rows(bent.coupling[i], rates, 1.0, state.coupling_rate[i])
    for i in range(3):
        state.moment_rate[i] = dot(state.coupling[i], rates)
        for j in range(3):
            state.square_rate[i, j] = dot(state.spun[3 * i + j], rates)
    clear(state.more)
    clear(state.more_rate)
    add_rows(state.coupling, rates, 1.0, state.more)
    _add_block(state.moment, state.square, nu, state.more)
    add_rows(state.coupling, body.acceleration[6:], 1.0, state.more_rate)
    add_rows(state.coupling_rate, rates, 1.0, state.more_rate)
    _add_block(state.moment, state.square, nu_rate, state.more_rate)
    _add_block(state.moment_rate, state.square_rate, nu, state.more_rate)
    add_rows(bent.per_mass, state.more, 1.0, body.twist)
    add_rows(bent.per_mass, state.more_rate, 1.0, body.twist_rate)


@part
def _add_bent_forces(bent: BentBody, state: BentState, body: BodyState) -> None:
    """Make forces on the corrected twist, and its momentum, those on the link's own twist; add those on q."""
    wrench, modal, omega = body.force[:6], body.force[6:], body.velocity[3:6]
    share, share_rate = state.share, state.share_rate
    clear(share)
    clear(share_rate)
    add_rows(bent.per_mass, body.p, 1.0, share)
    add_rows(bent.per_mass, wrench, 1.0, share_rate)
    _add_block_back(state.moment, state.square, share, body.p)
    _add_block_back(state.moment, state.square, share_rate, wrench)
    _add_block_back(state.moment_rate, state.square_rate, share, wrench)
    add_columns(state.coupling, share_rate, 1.0, modal)
    for c in range(3):
        add_columns(state.spun[3 * c : 3 * c + 3], omega, -share[3 + c], modal)
        clear(state.odd)
        add_rows(bent.odd[c], body.velocity[6:], 1.0, state.odd)
        for i in range(len(modal)):
            modal[i] -= 2 * share[3 + c] * state.odd[i]
    clear(state.more)
    add_cross(share[:3], omega, 1.0, state.more[:3])
    add_columns(state.coupling, state.more, -1.0, modal)


@part
def _subtract_bent_weight(state: BentState, body: BodyState) -> None:
    """Weight of ½ qᵀ Ψ q, and its potential."""
    clear(state.more)
    for i in range(3):
        state.more[i] = body.gravity[i]
    body.potential[0] -= dot3(body.gravity, state.moment)
    add_cross(state.moment, body.gravity, -1.0, body.force[3:6])
    add_columns(state.coupling, state.more, -1.0, body.force[6:])


@part
def _bend_mass(bent: BentBody, state: BentState, body: BodyState) -> None:
    """Mass matrix of (ν, q̇) from that of the corrected twist: Bᵀ M B, B = [1 + M₀⁻¹ H, M₀⁻¹ C; 0, 1]."""
    change, mass, changed, size = state.change, body.mass, state.changed, body.mass.shape[0]
    clear_matrix(change)
    for j in range(6):
        clear(state.share)
        clear(state.more)
        state.share[j] = 1.0
        _add_block(state.moment, state.square, state.share, state.more)
        add_rows(bent.per_mass, state.more, 1.0, state.share)
        for i in range(6):
            change[i, j] = state.share[i]
    for i in range(6):
        add_columns(state.coupling, bent.per_mass[i], 1.0, change[i, 6:])
    for i in range(size):  # M B
        for j in range(size):
            changed[i, j] = mass[i, j] if j >= 6 else 0.0
    add_product(mass[:, :6], change, changed)
    for i in range(size):  # Bᵀ (M B)
        for j in range(size):
            mass[i, j] = changed[i, j] if i >= 6 else 0.0
    add_transposed_product(change, changed[:6], mass)


@part
def _add_modal_inertia(bent: BentBody, state: BentState, body: BodyState) -> None:
    """Add d/dt ∂T₃/∂q̇ - ∂T₃/∂q."""
    rates, modal = body.velocity[6:], body.force[6:]
    for c in range(bent.warp.shape[0]):
        clear(state.warp_rate[c])
        add_rows(bent.warp[c], rates, 1.0, state.warp_rate[c])
        state.lag[c] = dot(state.warp[c], rates)
        state.lag_rate[c] = dot(state.warp_rate[c], rates) + dot(state.warp[c], body.acceleration[6:])
        state.pushed[c], state.pushed_rate[c] = rates[6 + c], body.acceleration[12 + c]
        modal[6 + c] += state.lag_rate[c]
    add_rows(bent.per_modal, state.lag, 1.0, state.pushed)
    add_rows(bent.per_modal, state.lag_rate, 1.0, state.pushed_rate)
    add_columns(state.warp, state.pushed_rate, 1.0, modal)
    add_columns(state.warp_rate, state.pushed, 1.0, modal)
    for c in range(bent.warp.shape[0]):
        add_columns(bent.warp[c], rates, -state.pushed[c], modal)


@part
def _add_modal_mass(bent: BentBody, state: BentState, mass: Array) -> None:
    """Add the mass matrix of T₃ = ½ q̇ᵀ M₃ q̇ to that of (ν, q̇)."""
    clear_matrix(state.warp_spare)
    add_product(bent.per_modal, state.warp, state.warp_spare)
    for c in range(bent.warp.shape[0]):
        for j in range(state.warp.shape[1]):
            mass[12 + c, 6 + j] += state.warp[c, j]
            mass[6 + j, 12 + c] += state.warp[c, j]
            for i in range(state.warp.shape[1]):
                mass[6 + i, 6 + j] += state.warp[c, i] * state.warp_spare[c, j]


@part
def _paper(reals: Array, integers: IntArray) -> Paper:
    return read_paper(reals, integers, read_serial(reals, integers, integers[0]).own)


@kernel(OF_LINK, counted=False)
def correct_twist(k: int, reals: Array, integers: IntArray, scratch: Array) -> None:
    """Corrected twist of link k and its derivative in the place of its own."""
    paper = _paper(reals, integers)
    bent = read_bent_body(reals, integers, paper.bent_bodies + k * BENT_BODY)
    state = read_bent_state(scratch, integers, paper.bent_states + k * BENT_STATE)
    body = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
    _fill_bend(bent, state, body.q)
    _correct_twist(bent, state, body)


@kernel(OF_LINK, counted=False)
def bent_forces(k: int, reals: Array, integers: IntArray, scratch: Array) -> None:
    """Forces on (ν, q̇) of link k from those on its corrected twist; modal inertia; weight of the displacement."""
    paper = _paper(reals, integers)
    bent = read_bent_body(reals, integers, paper.bent_bodies + k * BENT_BODY)
    state = read_bent_state(scratch, integers, paper.bent_states + k * BENT_STATE)
    body = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
    _add_bent_forces(bent, state, body)
    _add_modal_inertia(bent, state, body)
    _subtract_bent_weight(state, body)


@kernel(OF_LINK, counted=False)
def bent_mass(k: int, reals: Array, integers: IntArray, scratch: Array) -> None:
    """Mass matrix of (ν, q̇) of link k from that of its corrected twist."""
    paper = _paper(reals, integers)
    bent = read_bent_body(reals, integers, paper.bent_bodies + k * BENT_BODY)
    state = read_bent_state(scratch, integers, paper.bent_states + k * BENT_STATE)
    body = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
    _fill_bend(bent, state, body.q)
    _bend_mass(bent, state, body)
    _add_modal_mass(bent, state, body.mass)
