"""A tree with closed loops as the functions of `erls.equations.compiled_system`."""

from __future__ import annotations

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops.records import (
    call_closure,
    call_forces,
    call_masses,
    call_matrices,
    read_loop_room,
    read_loops,
)
from erls.equations.loops.solve import let_along, multipliers_of, spread_rows
from erls.maths.dense import backward, dot, forward
from erls.maths.jit import kernel


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M (a - ÿ) with the accelerations ÿ of the closed chain; NaN where it locks or has no mass."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    call_forces(loops.forces, reals, integers, scratch, t, y, v, scratch[0:0], out)
    call_masses(loops.masses, reals, integers, scratch, t, y, room.mass)
    n = len(y)
    if spread_rows(room.mass, room.factor, room.gradient, room.spread, room.flexible) != 0:
        for i in range(n):
            out[i] = np.nan
        return
    reduced, multipliers = room.reduced, room.multipliers
    for i in range(n):
        reduced[i] = -out[i]
    forward(room.factor, reduced)
    multipliers_of(loops, room, reduced, multipliers)
    for i in range(n):
        out[i] += dot(room.mass[i], a)
    for k in range(loops.kept):
        for i in range(n):
            out[i] += room.gradient[k, i] * multipliers[k]


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M of the chain and of rotors in closing joints."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    if loops.rotors:
        call_closure(loops.closure, reals, integers, scratch, t, y, y[: len(out)])  # the rates do not matter
    call_masses(loops.masses, reals, integers, scratch, t, y, out)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """Accelerations with decay of what loops are open by; NaN where they lock."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    call_forces(loops.forces, reals, integers, scratch, t, y, v, scratch[0:0], out)
    call_masses(loops.masses, reals, integers, scratch, t, y, room.mass)
    n = len(y)
    status = spread_rows(room.mass, room.factor, room.gradient, room.spread, room.flexible)
    if status > 0:
        return int(status)
    if status < 0:
        for i in range(n):
            out[i] = np.nan
        return 0
    for i in range(n):
        out[i] = -out[i]
    forward(room.factor, out)
    multipliers_of(loops, room, out, room.multipliers)
    for k in range(loops.kept):
        for i in range(n):
            out[i] -= room.spread[k, i] * room.multipliers[k]
    backward(room.factor, out)
    return 0


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Of the chain, less what the loops' forces take of them, and the decay; not symmetric."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    call_closure(loops.closure, reals, integers, scratch, t, y, v)
    call_matrices(loops.matrices, reals, integers, scratch, t, y, v, k, c)
    n, r, decay = len(y), loops.kept, loops.decay
    if spread_rows(room.mass, room.factor, room.gradient, room.spread, room.flexible) != 0:
        for i in range(n):
            k[i, i] = c[i, i] = np.nan
        return
    # loads (r, n) = (ZᵀZ)⁻¹ Φ_y, and rows of M⁻¹ Φ_yᵀ in place of Zᵀ
    column = room.wrong
    for j in range(n):
        for i in range(r):
            column[i] = room.gradient[i, j]
        forward(room.flexible, column)
        backward(room.flexible, column)
        for i in range(r):
            room.loads[i, j] = column[i]
    for i in range(r):
        backward(room.factor, room.spread[i])
    let_along(room.spread, room.loads, room.gradient, decay * decay, k, room.carried)
    let_along(room.spread, room.loads, room.gradient, 2 * decay, c, room.carried)
