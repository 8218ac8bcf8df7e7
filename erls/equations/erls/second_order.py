"""Geometric stiffening of ERLS: second-order displacements ½ qᵀ Ψ q of links, and of the frames that they carry.

With x = (φ, q_d), φ the turn in u, the frame of a link is displaced by u + e,

    e_k = T_k (e_p + ½ xᵀ P x) + ½ φ × (φ × d),   d = θ s - d₀,

where P is what the parent's interface moves to second order, seen as a motion of its frame, d₀ the arm from the inboard
interface to its joint and s how far the joint advances per unit of its coordinate; what is left out is of third order.
Forces on virtual u and those on virtual e go inward apart.

Of the velocity of ½ qᵀ Ψ q the kinetic energy needs, to second order in q, what it has in common with rigid-body
motions: the momenta, with the tensors of `fe_import.second_order.data`,

    h = C q̇ + H ν,   C = [S_ab q; qᵀ P],   H = [0, -S̃; 0, ½ qᵀ W q],   S = ½ qᵀ S_ab q.

They are those of a rigid-body motion with twist M₀⁻¹ h, M₀ the mass matrix of the undeformed link, so that

    T = T₁(ν + M₀⁻¹ h, q, q̇)

with T₁ that of the linear modes: positive for any q, and with forces that conserve energy.
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.frames import turn_along
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
from erls.equations.serial.records import JOINT_STATE, Serial, read_joint_state
from erls.maths.jit import part, reordered
from erls.maths.products import add_rows, clear, dot
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, dot3, transform_motion
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
def bend_frames(serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, moving: bool) -> None:
    """e of all links, added to the coordinates that `erls.equations.erls.frames` left.

    ``moving``: with first and second derivatives, at the given accelerations.
    """
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        bend = read_bend(reals, integers, chain.bends + k * BEND)
        bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        _set_coordinates(bend.turns, state.q, bent.x)
        if moving:
            _set_coordinates(bend.turns, state.q_rate, bent.x_rate)
            _set_coordinates(bend.turns, state.q_acceleration, bent.x_acceleration)
        if link.parent < 0:
            clear(bent.e)
            clear(bent.e_rate)
            clear(bent.e_acceleration)
        else:
            before = read_bend_state(scratch, integers, chain.bend_states + link.parent * BEND_STATE)
            _lift(bend, before, bent, moving)
            transform_motion(motion.pose, bent.e, bent.e)
            for i in range(6):
                bent.carried[i] = bent.e[i]
            if moving:
                transform_motion(motion.pose, bent.e_rate, bent.e_rate)
                transform_motion(motion.pose, bent.e_acceleration, bent.e_acceleration)
                turn_along(bent.e, bent.e_rate, bent.e_acceleration, motion)
            if bend.armed:
                _turn_arm(bend, state, bent, motion.coordinate, moving)
        for i in range(6):
            state.q[i] += bent.e[i]
            if moving:
                state.q_rate[i] += bent.e_rate[i]
                state.q_acceleration[i] += bent.e_acceleration[i]


@part
def _set_coordinates(turns: int, q: Array, x: Array) -> None:
    for i in range(turns):
        x[i] = q[3 + i]
    for i in range(turns, len(x)):
        x[i] = q[6 + i - turns]


@part
def _lift(bend: Bend, before: BendState, bent: BendState, moving: bool) -> None:
    """e + ½ xᵀ P x of the parent's interface, and derivatives."""
    for i in range(6):
        bent.e[i], bent.e_rate[i], bent.e_acceleration[i] = before.e[i], before.e_rate[i], before.e_acceleration[i]
    if bend.bows:
        bent.bow[:, :] = 0.0
        add_stack(bend.bow, before.x, bent.bow)
        add_rows(bent.bow, before.x, 0.5, bent.e)
        if moving:
            bent.bow_rate[:, :] = 0.0
            add_stack(bend.bow, before.x_rate, bent.bow_rate)
            add_rows(bent.bow, before.x_rate, 1.0, bent.e_rate)
            add_rows(bent.bow, before.x_acceleration, 1.0, bent.e_acceleration)
            add_rows(bent.bow_rate, before.x_rate, 1.0, bent.e_acceleration)


@part
def set_arm(slide: Array, arm: Array, coordinate: Any, phi: Array, d: Array, b: Array) -> None:
    """d, and b = φ × d."""
    for i in range(3):
        d[i] = coordinate * slide[i] - arm[i]
    clear(b)
    add_cross(phi, d, 1.0, b)


@part
def _turn_arm(bend: Bend, state: LinkState, bent: BendState, coordinate: Array, moving: bool) -> None:
    """Add ½ φ × (φ × d), and derivatives."""
    phi, rate, acceleration = state.u[3:], state.u_rate[3:], state.u_acceleration[3:]
    d, b, once = bent.d, bent.b, bent.share[:3]
    set_arm(bend.slide, bend.arm, coordinate[0], phi, d, b)
    add_cross(phi, b, 0.5, bent.e)
    if moving:
        add_cross(rate, b, 0.5, bent.e_rate)
        add_cross(acceleration, b, 0.5, bent.e_acceleration)
        clear(once)  # ḃ
        add_cross(rate, d, 1.0, once)
        add_cross(phi, bend.slide, coordinate[1], once)
        add_cross(phi, once, 0.5, bent.e_rate)
        add_cross(rate, once, 1.0, bent.e_acceleration)
        clear(once)  # its derivative
        add_cross(acceleration, d, 1.0, once)
        add_cross(rate, bend.slide, 2 * coordinate[1], once)
        add_cross(phi, bend.slide, coordinate[2], once)
        add_cross(phi, once, 0.5, bent.e_acceleration)


@part
def curve_inertia(bend: Bend, state: LinkState, bent: BendState) -> None:
    """The second-order tensors of a link times its coordinates x, now with e: ``rows``, S and ½ qᵀ W q."""
    _set_coordinates(bend.turns, state.q, bent.x)
    bent.rows[:, :] = 0.0
    add_stack(bend.rows, bent.x, bent.rows)
    for i in range(3):
        bent.moment[i] = dot(bent.rows[i], bent.x) / 2
    for i in range(len(bent.spin)):
        bent.spin[i] = dot(bent.rows[6 + i], bent.x) / 2


@part
def correct_twist(bend: Bend, state: LinkState, bent: BendState) -> None:
    """``full`` = ν + M₀⁻¹ (C q̇ + H ν), and its derivative."""
    omega, alpha, added, added_rate = state.twist[3:], state.twist_rate[3:], bent.added, bent.added_rate
    curve_inertia(bend, state, bent)
    _set_coordinates(bend.turns, state.q_rate, bent.x_rate)
    _set_coordinates(bend.turns, state.q_acceleration, bent.x_acceleration)
    bent.rows_rate[:, :] = 0.0
    add_stack(bend.rows, bent.x_rate, bent.rows_rate)
    clear(added)
    clear(added_rate)
    add_rows(bent.rows, bent.x_rate, 1.0, added)
    add_rows(bent.rows, bent.x_acceleration, 1.0, added_rate)
    add_rows(bent.rows_rate, bent.x_rate, 1.0, added_rate)
    for i in range(3):
        bent.moment_rate[i] = added[i]
    add_cross(bent.moment, omega, -1.0, added)
    add_cross(bent.moment, alpha, -1.0, added_rate)
    add_cross(bent.moment_rate, omega, -1.0, added_rate)
    for a in range(len(bend.axes)):
        turn, turn_rate = dot3(bend.axes[a], omega), dot3(bend.axes[a], alpha)
        for c in range(3):
            i = 3 * a + c
            bent.spin_rate[i] = dot(bent.rows[6 + i], bent.x_rate)
            added[3 + c] += bent.spin[i] * turn
            added_rate[3 + c] += bent.spin[i] * turn_rate + bent.spin_rate[i] * turn
    for i in range(6):
        bent.full[i], bent.full_rate[i] = state.twist[i], state.twist_rate[i]
    add_rows(bend.compliance, added, 1.0, bent.full)
    add_rows(bend.compliance, added_rate, 1.0, bent.full_rate)


@part
def feel_curvature(bend: Bend, link: Link, state: LinkState, bent: BendState) -> None:
    """What second-order momenta add to the modal forces, the momentum and the wrench of a link."""
    share, share_rate, weights = bent.share, bent.share_rate, bent.weights
    omega, m = state.twist[3:], len(bent.x)
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
    forces = bent.spare[:m]
    clear(forces)
    for r in range(len(weights)):
        row, weight = bent.rows[r], weights[r]
        for i in range(m):
            forces[i] += weight * row[i]
    for j in range(m):
        odd, weight = bend.odd[j], bent.x_rate[j]
        for a in range(3):
            for i in range(m):
                forces[i] -= share[3 + a] * weight * odd[a * m + i]
    for i in range(bend.turns):
        state.modal[3 + i] += forces[i]
    for i in range(bend.turns, m):
        state.modal[6 + i - bend.turns] += forces[i]
    for i in range(6):
        for j in range(3):
            state.wrench[i] -= link.mass[j, i] * state.down[j]
    add_cross(bent.moment, state.down, -1.0, state.wrench[3:])
