"""Geometric stiffening of ERLS: what second-order displacements ½ qᵀ Ψ q do to the inertia of a link.

Equivalent rigid links are anchored where the links are (`erls.equations.erls.anchored_frames`), so that q = q_d moves
the link in its frame, of which w is the twist. Of the velocity of ½ qᵀ Ψ q the kinetic energy needs, to second order in
q, what it has in common with rigid-body motions: the momenta, with the tensors of `fe_import.second_order.data`,

    h = C q̇ + H w,   C = [S_ab q; qᵀ P],   H = [0, -S̃; 0, ½ qᵀ W q],   S = ½ qᵀ S_ab q.

They are those of a rigid-body motion with twist M₀⁻¹ h, M₀ the mass matrix of the undeformed link, so that

    T = T₁(w + M₀⁻¹ h, q, q̇)

with T₁ that of the linear modes: positive for any q, and with forces that conserve energy. What it has in common with
elastic modes is `erls.equations.serial.modal_inertia`.
"""

from __future__ import annotations

from erls.equations.erls.link_forces import link_forces
from erls.equations.erls.records import (
    BEND,
    BEND_STATE,
    LINK,
    LINK_STATE,
    Bend,
    BendState,
    Chain,
    Link,
    LinkState,
    read_bend,
    read_bend_state,
    read_link,
    read_link_state,
)
from erls.equations.serial.modal_inertia_kernels import (
    WARP,
    WARP_STATE,
    read_warp,
    read_warp_state,
    set_warp_rates,
    warp_forces,
)
from erls.maths.jit import part, reordered
from erls.maths.products import add_rows, clear, dot
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, dot3
from fe_import.model import IntArray


@reordered
def add_stack(stack: Array, x: Array, out: Array) -> None:
    """Add to a matrix (r, m) Σ_j x_j stack_j, whose matrices (r, m) are rows of ``stack``."""
    flat = out.reshape((out.size,))
    for j in range(len(x)):
        row, weight = stack[j], x[j]
        for i in range(len(flat)):
            flat[i] += weight * row[i]


@part
def curve_inertia(bend: Bend, state: LinkState, bent: BendState) -> None:
    """The second-order tensors of a link times its elastic coordinates: ``rows``, S and ½ qᵀ W q."""
    x = state.q[6:]
    bent.rows[:, :] = 0.0
    add_stack(bend.rows, x, bent.rows)
    for i in range(3):
        bent.moment[i] = dot(bent.rows[i], x) / 2
    for i in range(len(bent.spin)):
        bent.spin[i] = dot(bent.rows[6 + i], x) / 2


@part
def correct_twist(bend: Bend, state: LinkState, bent: BendState) -> None:
    """``full`` = w + M₀⁻¹ (C q̇ + H w), and its derivative."""
    x_rate, x_acceleration = state.q_rate[6:], state.q_acceleration[6:]
    omega, alpha, added, added_rate = state.twist[3:], state.twist_rate[3:], bent.added, bent.added_rate
    curve_inertia(bend, state, bent)
    bent.rows_rate[:, :] = 0.0
    add_stack(bend.rows, x_rate, bent.rows_rate)
    clear(added)
    clear(added_rate)
    add_rows(bent.rows, x_rate, 1.0, added)
    add_rows(bent.rows, x_acceleration, 1.0, added_rate)
    add_rows(bent.rows_rate, x_rate, 1.0, added_rate)
    for i in range(3):
        bent.moment_rate[i] = added[i]
    add_cross(bent.moment, omega, -1.0, added)
    add_cross(bent.moment, alpha, -1.0, added_rate)
    add_cross(bent.moment_rate, omega, -1.0, added_rate)
    for a in range(len(bend.axes)):
        turn, turn_rate = dot3(bend.axes[a], omega), dot3(bend.axes[a], alpha)
        for c in range(3):
            i = 3 * a + c
            bent.spin_rate[i] = dot(bent.rows[6 + i], x_rate)
            added[3 + c] += bent.spin[i] * turn
            added_rate[3 + c] += bent.spin[i] * turn_rate + bent.spin_rate[i] * turn
    for i in range(6):
        bent.full[i], bent.full_rate[i] = state.twist[i], state.twist_rate[i]
    add_rows(bend.compliance, added, 1.0, bent.full)
    add_rows(bend.compliance, added_rate, 1.0, bent.full_rate)


@part
def _feel_curvature(bend: Bend, link: Link, state: LinkState, bent: BendState) -> None:
    """What second-order momenta add to the modal forces, the momentum and the wrench of a link."""
    share, share_rate, weights = bent.share, bent.share_rate, bent.weights
    omega, x_rate, m = state.twist[3:], state.q_rate[6:], len(state.q) - 6
    forces = state.modal[6:]
    for i in range(6):  # the weight is no rate of momentum
        for j in range(3):
            state.wrench[i] += link.mass[j, i] * state.down[j]
    clear(share)
    clear(share_rate)
    add_rows(bend.compliance, state.momentum, 1.0, share)
    add_rows(bend.compliance, state.wrench, 1.0, share_rate)
    for i in range(6):
        weights[i] = share_rate[i]
    for i in range(3):
        weights[i] -= state.down[i]
    add_cross(share, omega, -1.0, weights)
    for a in range(len(bend.axes)):
        turn = dot3(bend.axes[a], omega)
        total = total_rate = 0.0
        for c in range(3):
            i = 3 * a + c
            weights[6 + i] = -turn * share[3 + c]
            total += bent.spin[i] * share[3 + c]
            total_rate += bent.spin[i] * share_rate[3 + c] + bent.spin_rate[i] * share[3 + c]
        for i in range(3):
            state.momentum[3 + i] += total * bend.axes[a, i]
            state.wrench[3 + i] += total_rate * bend.axes[a, i]
    add_cross(bent.moment, share, 1.0, state.momentum[3:])
    add_cross(bent.moment, share_rate, 1.0, state.wrench[3:])
    add_cross(bent.moment_rate, share, 1.0, state.wrench[3:])
    for r in range(len(weights)):
        row, weight = bent.rows[r], weights[r]
        for i in range(m):
            forces[i] += weight * row[i]
    for j in range(m):
        odd, weight = bend.odd[j], x_rate[j]
        for a in range(3):
            for i in range(m):
                forces[i] -= share[3 + a] * weight * odd[a * m + i]
    for i in range(6):
        for j in range(3):
            state.wrench[i] -= link.mass[j, i] * state.down[j]
    add_cross(bent.moment, state.down, -1.0, state.wrench[3:])


@part
def bent_forces(
    chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, accelerated: bool
) -> None:
    """`erls.equations.erls.link_forces.link_forces` of link k with its second-order displacements."""
    link = read_link(reals, integers, chain.links + k * LINK)
    state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
    bend = read_bend(reals, integers, chain.bends + k * BEND)
    bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
    if not bend.curved:
        link_forces(chain, link, state, state.twist, state.twist_rate, accelerated)
        return
    correct_twist(bend, state, bent)
    link_forces(chain, link, state, bent.full, bent.full_rate, accelerated)
    _feel_curvature(bend, link, state, bent)
    if bend.warped:
        warp = read_warp(reals, integers, chain.warps + k * WARP)
        warp_state = read_warp_state(scratch, integers, chain.warp_states + k * WARP_STATE)
        set_warp_rates(warp, warp_state, state.q[6:], state.q_rate[6:])
        moved = state.q_acceleration[6:] if accelerated else state.q_acceleration[6:6]
        warp_forces(warp, warp_state, state.q_rate[6:], moved, state.modal[6:])
