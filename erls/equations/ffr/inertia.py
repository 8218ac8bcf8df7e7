"""Inertia forces, weight and elastic forces of one link in its floating frame, with the effects that are on.

With η the elastic coordinates, B the modes they stand for and ν = [v; ω] the twist of the floating frame, in its axes,
the nodal velocities give, for any mass matrix,

    T = ½ νᵀ M(η) ν + νᵀ C(η) η̇ + ½ η̇ᵀ M_e η̇,
    M(η) = M₀ + M₁ η + ηᵀ M₂ η,   C(η) = C₀ + C₁ η

(O. Wallrapp, Mech. Struct. & Mach. 22 (1994) 283-304: mdCM, J, Ct, Cr, Me; A. A. Shabana, Dynamics of Multibody
Systems, ch. 5). M₁ fills the rows and columns of ω, M₂ its block, C₁ its rows. The forces are the Boltzmann-Hamel
equations of T. Of these forces five parts may be left out (`erls.mechanism.effects`):

- ``centrifugal_load``: -½ νᵀ M₁ ν on η;
- ``coriolis``: what C₁ does on η by η̇ and ω;
- ``inertia_first_order``: what C₁ does on η by ω̇, and all of M₁ and C₁ in the frame's wrench;
- ``inertia_second_order``: all of M₂ in the frame's wrench;
- ``spin_softening``: -ωᵀ M₂ η ω on η.

With one axis of rotation the moment about that axis is complete, and no joint feels the others.
"""

from __future__ import annotations

from erls.equations.ffr.records import (
    BENT_STATE,
    BODY,
    BODY_STATE,
    Body,
    BodyState,
    Frames,
    call_bent_forces,
    call_correct_twist,
    read_bent_state,
    read_body,
    read_body_state,
)
from erls.equations.serial.elastic import elastic_force
from erls.equations.serial.records import Modes
from erls.maths.jit import part
from erls.maths.products import add_columns, add_rows, add_symmetric, clear, dot
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, add_force_cross, dot3, dot6
from fe_import.model import IntArray


@part
def turn_inertia(body: Body, state: BodyState, q: Array) -> None:
    """C₁ η for each axis."""
    for a in range(body.axes.shape[0]):
        turned = state.turned[a]
        clear(turned)
        add_columns(body.turned[a], q, 1.0, turned)


@part
def square_inertia(square: Array, a: int, b: int, q: Array, squared: Array) -> None:
    """M₂ η of a pair of axes a <= b."""
    clear(squared)
    add_symmetric(square[a if a == b else a + b + 2], q, 0, squared)


@part
def _first_order(body: Body, state: BodyState, q: Array, rates: Array, moved: Array, forces: Array) -> None:
    """What M₁ η and C₁ η add to the frame's wrench and momentum and, by ω̇, to the elastic forces."""
    half, half_rate = state.spare[:6], state.spare[6:]
    turn_inertia(body, state, q)
    for a in range(body.axes.shape[0]):
        axis, turned, turned_rate = body.axes[a], state.turned[a], state.turned_rate[a]
        omega, alpha = dot3(axis, state.twist[3:]), dot3(axis, state.twist_rate[3:])
        clear(turned_rate)
        clear(half)
        clear(half_rate)
        add_columns(body.turned[a], rates, 1.0, turned_rate)
        add_rows(body.half[a], q, 1.0, half)
        add_rows(body.half[a], rates, 1.0, half_rate)
        spin, spin_rate = dot(turned, rates), dot(turned_rate, rates)
        if len(moved) > 0:
            spin_rate += dot(turned, moved)
        spin += dot6(half, state.twist)
        spin_rate += dot6(half, state.twist_rate) + dot6(half_rate, state.twist)
        for i in range(6):
            state.momentum[i] += omega * half[i]
            state.wrench[i] += alpha * half[i] + omega * half_rate[i]
        for i in range(3):
            state.momentum[3 + i] += spin * axis[i]
            state.wrench[3 + i] += spin_rate * axis[i]
        for i in range(len(forces)):
            forces[i] += alpha * turned[i]


@part
def _second_order(
    frames: Frames, body: Body, state: BodyState, q: Array, rates: Array, forces: Array
) -> None:
    """What M₂ adds to the frame's wrench and momentum, and to the elastic forces: spin softening."""
    twist, twist_rate, momentum, wrench = state.twist, state.twist_rate, state.momentum, state.wrench
    for a in range(body.axes.shape[0]):
        for b in range(a, body.axes.shape[0]):
            square_inertia(body.square, a, b, q, state.squared)
            one, other = body.axes[a], body.axes[b]
            omega_a, omega_b = dot3(one, twist[3:]), dot3(other, twist[3:])
            if frames.softening:
                factor = omega_a * omega_b * (1.0 if a == b else 2.0)
                for i in range(len(forces)):
                    forces[i] -= factor * state.squared[i]
            if frames.second_order:
                moment, rate = dot(state.squared, q), 2.0 * dot(state.squared, rates)
                about_a = moment * dot3(other, twist_rate[3:]) + rate * omega_b
                about_b = moment * dot3(one, twist_rate[3:]) + rate * omega_a
                for i in range(3):
                    momentum[3 + i] += moment * omega_b * one[i]
                    wrench[3 + i] += about_a * one[i]
                    if a != b:
                        momentum[3 + i] += moment * omega_a * other[i]
                        wrench[3 + i] += about_b * other[i]


@part
def _spin_forces(frames: Frames, body: Body, state: BodyState, rates: Array, forces: Array) -> None:
    """Coriolis forces on η by its own rates, and centrifugal ones."""
    for a in range(body.axes.shape[0]):
        omega = dot3(body.axes[a], state.twist[3:])
        if frames.coriolis:
            add_columns(body.gyroscopic[a], rates, omega, forces)
        if frames.centrifugal:
            add_columns(body.half[a], state.twist, -omega, forces)


@part
def _weigh(frames: Frames, body: Body, state: BodyState, q: Array, integers: IntArray, scratch: Array, k: int) -> None:
    """Take the weight of link k from the wrench."""
    moment, gravity, wrench = state.moment, state.gravity, state.wrench
    for i in range(3):
        moment[i] = body.moment[i]
        wrench[i] -= body.mass * gravity[i]
    add_rows(body.coupling[:3], q, 1.0, moment)
    if body.bent:
        bent = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
        for i in range(3):
            moment[i] += bent.moment[i]
    add_cross(moment, gravity, -1.0, wrench[3:])


@part
def link_forces(
    frames: Frames, reals: Array, integers: IntArray, scratch: Array, k: int, modes: Modes, q: Array, rates: Array,
    moved: Array, forces: Array,
) -> None:  # fmt: skip
    """Wrench of link k on its frame, and ``forces`` (e,) on its η; all as inertia less what acts.

    ``moved`` is η̈, empty for zero.
    """
    body = read_body(reals, integers, frames.bodies + k * BODY)
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    if body.bent:
        call_correct_twist(frames.correct_twist, k, reals, integers, scratch, rates, moved)
    clear(state.momentum)
    clear(state.wrench)
    add_rows(body.rigid, state.twist, 1.0, state.momentum)
    add_rows(body.rigid, state.twist_rate, 1.0, state.wrench)
    add_rows(body.coupling, rates, 1.0, state.momentum)
    if len(moved) > 0:
        add_rows(body.coupling, moved, 1.0, state.wrench)
    if len(forces) > 0:
        for i in range(len(forces)):
            forces[i] = elastic_force(modes.stiffness[i], q[i], modes.rest[i]) + modes.damping[i] * rates[i]
        pull = state.spare[:6]  # of the frame, less the weight
        for i in range(3):
            pull[i], pull[3 + i] = state.twist_rate[i] - state.gravity[i], state.twist_rate[3 + i]
        add_columns(body.coupling, pull, 1.0, forces)
        if len(moved) > 0:
            add_columns(modes.mass, moved, 1.0, forces)
        if frames.first_order:
            _first_order(body, state, q, rates, moved, forces)
        if frames.second_order or frames.softening:
            _second_order(frames, body, state, q, rates, forces)
        if frames.coriolis or frames.centrifugal:
            _spin_forces(frames, body, state, rates, forces)
    if body.bent:
        call_bent_forces(frames.bent_forces, k, reals, integers, scratch, rates, moved, forces)
    add_force_cross(state.twist, state.momentum, state.wrench)
    if frames.weight:
        _weigh(frames, body, state, q, integers, scratch, k)


@part
def inertia_blocks(frames: Frames, body: Body, state: BodyState, q: Array) -> None:
    """M(η) and C(η)."""
    inertia, coupling, half = state.inertia, state.coupling, state.spare[:6]
    for i in range(6):
        for j in range(6):
            inertia[i, j] = body.rigid[i, j]
        for j in range(len(q)):
            coupling[i, j] = body.coupling[i, j]
    if len(q) == 0:
        return
    if frames.first_order:
        turn_inertia(body, state, q)
        for a in range(body.axes.shape[0]):
            axis = body.axes[a]
            clear(half)
            add_rows(body.half[a], q, 1.0, half)
            for r in range(3):
                for i in range(6):
                    inertia[3 + r, i] += axis[r] * half[i]
                    inertia[i, 3 + r] += axis[r] * half[i]
                for j in range(len(q)):
                    coupling[3 + r, j] += axis[r] * state.turned[a, j]
    if frames.second_order:
        for a in range(body.axes.shape[0]):
            for b in range(a, body.axes.shape[0]):
                square_inertia(body.square, a, b, q, state.squared)
                moment = dot(state.squared, q) * (0.5 if a == b else 1.0)
                for i in range(3):
                    for j in range(3):
                        turn = moment * body.axes[a, i] * body.axes[b, j]
                        inertia[3 + i, 3 + j] += turn
                        inertia[3 + j, 3 + i] += turn
