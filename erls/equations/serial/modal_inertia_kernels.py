"""Forces and mass of T₃ = q̇·k + ½ kᵀ σ⁻¹ k of one link, `erls.equations.serial.modal_inertia`, with k = K(q) q̇.

q are coordinates that leave the frame of the link where it is, so that K is square.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from erls.equations.serial.modal_inertia import ModalInertia
from erls.maths.jit import part
from erls.maths.products import add_columns, add_rows, clear, dot
from erls.maths.records import Matrix, reader, room, table_size
from erls.maths.so3 import Array


class Warp(NamedTuple):
    """Constants of a link with e elastic coordinates; empty without modal inertia.

    Attributes
    ----------
    table : (e, e e) array
        K for each coordinate that it is multiplied with, rows (e, e) over q̇.
    skew : (e, e e) array
        K_cab - K_cba for each a, likewise.
    per_mass : (e, e) array
        σ⁻¹.
    """

    table: Matrix
    skew: Matrix
    per_mass: Matrix


class WarpState(NamedTuple):
    """Its working memory: q (e,), where it is kept; K(q) and K(q̇), and the same of ``skew``, (e, e); q̇ + σ⁻¹ k, its
    derivative, k̇, (e,).
    """

    q: Annotated[Array, "e"]
    warp: Annotated[Array, "e e"]
    warp_rate: Annotated[Array, "e e"]
    twisted: Annotated[Array, "e e"]
    pushed: Annotated[Array, "e"]
    pushed_rate: Annotated[Array, "e"]
    lag: Annotated[Array, "e"]


def warp_record(modal: ModalInertia | None) -> Warp:
    """That of a link in its elastic coordinates."""
    if modal is None:
        return Warp(*np.zeros((3, 0, 0)))
    e = modal.size
    table = modal.tensor.transpose(1, 0, 2).reshape(e, e * e)
    skew = table - modal.tensor.transpose(2, 0, 1).reshape(e, e * e)
    return Warp(table, skew, np.asarray(modal.per_mass, dtype=float))


def warp_state(e: int) -> WarpState:
    """Memory for a link with so many elastic coordinates; 0 without modal inertia."""
    return room(WarpState, e=e)


read_warp, read_warp_state = reader(Warp), reader(WarpState)
WARP, WARP_STATE = table_size(Warp), table_size(WarpState)


@part
def _add_table(table: Array, x: Array, out: Array) -> None:
    flat = out.reshape(out.size)
    clear(flat)
    add_columns(table, x, 1.0, flat)


@part
def set_warp(warp: Warp, state: WarpState, q: Array) -> None:
    """K(q)."""
    _add_table(warp.table, q, state.warp)


@part
def set_warp_rates(warp: Warp, state: WarpState, q: Array, rates: Array) -> None:
    """K(q) and K(q̇) at once: reading the table is most of it."""
    now, rate = state.warp.reshape(state.warp.size), state.warp_rate.reshape(state.warp.size)
    clear(now)
    clear(rate)
    for j in range(len(q)):
        row, x, y = warp.table[j], q[j], rates[j]
        for i in range(len(row)):
            now[i] += x * row[i]
            rate[i] += y * row[i]


@part
def warp_energy(warp: Warp, state: WarpState, rates: Array) -> Any:
    """T₃, after `set_warp`."""
    lag = state.lag
    clear(lag)
    add_rows(state.warp, rates, 1.0, lag)
    total = dot(lag, rates)
    for i in range(len(lag)):
        total += lag[i] * dot(warp.per_mass[i], lag) / 2
    return total


@part
def warp_forces(warp: Warp, state: WarpState, rates: Array, moved: Array, forces: Array) -> None:
    """Add d/dt ∂T₃/∂q̇ - ∂T₃/∂q, after `set_warp_rates`; ``moved`` is q̈, empty for zero."""
    e, lag = len(rates), state.lag
    _add_table(warp.skew, rates, state.twisted)
    for i in range(e):
        state.pushed[i], lag[i] = rates[i], 0.0
        state.pushed_rate[i] = 0.0
    add_rows(state.warp, rates, 1.0, lag)  # k
    add_rows(warp.per_mass, lag, 1.0, state.pushed)
    clear(lag)  # of which the derivative comes next
    add_rows(state.warp_rate, rates, 1.0, lag)
    if len(moved) > 0:
        add_rows(state.warp, moved, 1.0, lag)
        for i in range(e):
            state.pushed_rate[i] = moved[i]
    add_rows(warp.per_mass, lag, 1.0, state.pushed_rate)
    add_columns(state.warp, state.pushed_rate, 1.0, forces)
    add_columns(state.twisted, state.pushed, 1.0, forces)
    for i in range(e):
        forces[i] += lag[i]


@part
def warp_rows(warp: Warp, state: WarpState, change: Array, partner: Array) -> None:
    """E = K and F = 2 + σ⁻¹ K of `erls.equations.serial.segments`, after `set_warp`."""
    e = state.warp.shape[0]
    for i in range(e):
        for j in range(e):
            change[i, j] = state.warp[i, j]
        clear(partner[i])
        partner[i, i] = 2.0
        add_columns(state.warp, warp.per_mass[i], 1.0, partner[i])
