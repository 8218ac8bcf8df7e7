"""Second-order displacements ½ ηᵀ Ψ η of a link: geometric stiffening, and modal inertia.

Beside the blocks of T = ½ νᵀ M ν + νᵀ C η̇ + ½ η̇ᵀ M_e η̇ the second-order displacement has, with the tensors of
`fe_import.second_order.data` in the elastic coordinates,

    C₂(η) = [S_ab η; ηᵀ P],   H(η) = [0, -S̃; 0, ½ ηᵀ W η],   S = ½ ηᵀ S_ab η

(O. Wallrapp and R. Schwertassek, Int. J. Numer. Methods Eng. 32 (1991) 1833-1850). Added to C and M as C₂ and H + Hᵀ
they could make the mass matrix indefinite where elastic motion cancels that of the frame. The frame's twist is
corrected instead, ν' = ν + M₀⁻¹ (C₂ η̇ + H ν), which gives the same to second order in η and stays positive. The forces
on η and on the frame are those of Lagrange and of Boltzmann and Hamel in the uncorrected twist.

Modal inertia, derived in `erls.equations.serial.modal_inertia`, adds T₃ = η̇·k + ½ kᵀ σ⁻¹ k with k = K(η) η̇.
"""

from __future__ import annotations

from erls.equations.ffr.records import (
    BEND_LINK,
    BENT_BODY,
    BENT_FORCES,
    BENT_STATE,
    BODY,
    BODY_STATE,
    CORRECT_ARRIVAL,
    CORRECT_TWIST,
    BentBody,
    BentState,
    BodyState,
    Frames,
    read_bent_body,
    read_bent_state,
    read_body,
    read_body_state,
    read_frames,
)
from erls.equations.serial.modal_inertia_kernels import (
    WARP,
    WARP_STATE,
    read_warp,
    read_warp_state,
    set_warp_rates,
    warp_forces,
)
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import add_columns, add_rows, clear, copy
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross
from fe_import.model import IntArray


@part
def _frames(reals: Array, integers: IntArray) -> Frames:
    return read_frames(reals, integers, read_serial(reals, integers, integers[0]).own)


@kernel(BEND_LINK, counted=False)
def bend_link(k: int, reals: Array, integers: IntArray, scratch: Array, q: Array) -> None:
    """C₂, W η, S and ½ ηᵀ W η of link k."""
    frames = _frames(reals, integers)
    bent = read_bent_body(reals, integers, frames.bent_bodies + k * BENT_BODY)
    state = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
    e = len(q)
    rows, spun = state.bending.reshape(6 * e), state.spun.reshape(9 * e)
    clear(rows)
    clear(spun)
    add_columns(bent.bend, q, 1.0, rows)
    add_columns(bent.spin, q, 1.0, spun)
    square = state.square.reshape(9)
    clear(state.moment)
    clear(square)
    add_rows(state.bending[:3], q, 0.5, state.moment)
    add_rows(state.spun, q, 0.5, square)
    if read_body(reals, integers, frames.bodies + k * BODY).warped:
        copy(q, read_warp_state(scratch, integers, frames.warp_states + k * WARP_STATE).q)


@part
def _bend_rates(bent: BentBody, state: BentState, rates: Array) -> None:
    """Derivatives of what `bend_link` gives; of W η only that of ½ ηᵀ W η."""
    e = len(rates)
    rows = state.bending_rate.reshape(6 * e)
    clear(rows)
    add_columns(bent.bend, rates, 1.0, rows)
    square = state.square_rate.reshape(9)
    clear(state.moment_rate)
    clear(square)
    add_rows(state.bending[:3], rates, 1.0, state.moment_rate)
    add_rows(state.spun, rates, 1.0, square)


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


@kernel(CORRECT_TWIST, counted=False)
def correct_twist(
    k: int, reals: Array, integers: IntArray, scratch: Array, rates: Array, moved: Array
) -> None:
    """Corrected twist of link k and its rate in the place of the frame's own; ``moved`` is η̈, empty for zero."""
    frames = _frames(reals, integers)
    bent = read_bent_body(reals, integers, frames.bent_bodies + k * BENT_BODY)
    bending = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    _bend_rates(bent, bending, rates)
    more, more_rate = state.spare[:6], state.spare[6:]
    for i in range(6):
        bending.twist[i], bending.twist_rate[i] = state.twist[i], state.twist_rate[i]
        more[i] = more_rate[i] = 0.0
    add_rows(bending.bending, rates, 1.0, more)
    add_rows(bending.bending_rate, rates, 1.0, more_rate)
    if len(moved) > 0:
        add_rows(bending.bending, moved, 1.0, more_rate)
    _add_block(bending.moment, bending.square, bending.twist, more)
    _add_block(bending.moment, bending.square, bending.twist_rate, more_rate)
    _add_block(bending.moment_rate, bending.square_rate, bending.twist, more_rate)
    add_rows(bent.per_mass, more, 1.0, state.twist)
    add_rows(bent.per_mass, more_rate, 1.0, state.twist_rate)


@part
def _put_back(bent: BentBody, bending: BentState, state: BodyState, rates: Array, forces: Array) -> None:
    """Wrench and momentum of the corrected twist become those of the frame's own, which is put back; forces on η."""
    share, share_rate, pull = bending.share, bending.share_rate, bending.spare
    for i in range(6):
        state.twist[i], state.twist_rate[i] = bending.twist[i], bending.twist_rate[i]
    clear(share)
    clear(share_rate)
    add_rows(bent.per_mass, state.momentum, 1.0, share)
    add_rows(bent.per_mass, state.wrench, 1.0, share_rate)
    _add_block_back(bending.moment, bending.square, share, state.momentum)
    _add_block_back(bending.moment_rate, bending.square_rate, share, state.wrench)
    _add_block_back(bending.moment, bending.square, share_rate, state.wrench)
    # on η: d/dt (C₂ᵀ λ) less the gradient of λ·(C₂ η̇ + H ν) at fixed λ = M₀⁻¹ p, and the weight of ½ ηᵀ S_ab η
    for i in range(3):
        pull[i], pull[3 + i] = share_rate[i] - state.gravity[i], share_rate[3 + i]
    add_cross(share[:3], state.twist[3:], -1.0, pull[:3])
    add_columns(bending.bending, pull, 1.0, forces)
    skewed = bending.skewed.reshape(bending.skewed.size)
    clear(skewed)
    add_columns(bent.skew, rates, 1.0, skewed)
    add_columns(bending.skewed, share[3:], 1.0, forces)
    for i in range(3):
        add_columns(bending.spun[3 * i : 3 * i + 3], state.twist[3:], -share[3 + i], forces)


@kernel(BENT_FORCES, counted=False)
def bent_forces(
    k: int, reals: Array, integers: IntArray, scratch: Array, rates: Array, moved: Array, forces: Array
) -> None:
    """Wrench, momentum and forces on η of link k from those of its corrected twist; modal inertia."""
    frames = _frames(reals, integers)
    bent = read_bent_body(reals, integers, frames.bent_bodies + k * BENT_BODY)
    bending = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
    _put_back(bent, bending, read_body_state(scratch, integers, frames.body_states + k * BODY_STATE), rates, forces)
    if read_body(reals, integers, frames.bodies + k * BODY).warped:
        warp = read_warp(reals, integers, frames.warps + k * WARP)
        warp_state = read_warp_state(scratch, integers, frames.warp_states + k * WARP_STATE)
        set_warp_rates(warp, warp_state, warp_state.q, rates)
        warp_forces(warp, warp_state, rates, moved, forces)


@kernel(CORRECT_ARRIVAL, counted=False)
def correct_arrival(k: int, reals: Array, integers: IntArray, scratch: Array, floats: int) -> None:
    """Z and W of the corrected twist of link k."""
    frames = _frames(reals, integers)
    bent = read_bent_body(reals, integers, frames.bent_bodies + k * BENT_BODY)
    bending = read_bent_state(scratch, integers, frames.bent_states + k * BENT_STATE)
    state = read_body_state(scratch, integers, frames.body_states + k * BODY_STATE)
    factor, x, y = bending.factor, state.spare[:6], state.spare[6:]
    for j in range(6):
        for i in range(6):
            x[i], y[i] = (1.0 if i == j else 0.0), 0.0
        _add_block(bending.moment, bending.square, x, y)
        add_rows(bent.per_mass, y, 1.0, x)
        for i in range(6):
            factor[i, j] = x[i]
    for i in range(6):
        row, line = bending.carried[i], bending.arrival[i]
        clear(row)
        clear(line)
        add_columns(bending.bending, bent.per_mass[i], 1.0, row)
        add_columns(state.arrival, factor[i], 1.0, line)
        if floats:
            add_columns(state.carried, factor[i], 1.0, row)
