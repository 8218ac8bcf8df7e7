"""A chain with closed loops as the functions of `erls.equations.compiled_system`."""

from __future__ import annotations

import math

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops import layout as at
from erls.equations.loops.closure import closure
from erls.equations.loops.solve import let_along, multipliers_of, spread_rows
from erls.equations.loops.tree import forces, masses, matrices
from erls.maths.dense import backward, dot, forward
from erls.maths.jit import kernel


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M (a - ÿ) with the accelerations ÿ of the closed chain; NaN where it locks or has no mass."""
    forces(reals, integers, scratch, t, y, v, scratch[0:0], out)
    n, r = len(y), at.place(integers, at.KEPT)
    mass = scratch[at.span(integers, at.MASS, n * n)].reshape(n, n)
    masses(reals, integers, scratch, t, y, mass)
    if spread_rows(integers, scratch, n) != 0:
        for i in range(n):
            out[i] = math.nan
        return
    reduced = scratch[at.span(integers, at.REDUCED, n)]
    multipliers = scratch[at.span(integers, at.MULTIPLIERS, r)]
    factor = scratch[at.span(integers, at.FACTOR, n * n)].reshape(n, n)
    gradient = scratch[at.span(integers, at.GRADIENT, r * n)].reshape(r, n)
    for i in range(n):
        reduced[i] = -out[i]
    forward(factor, reduced)
    multipliers_of(reals, integers, scratch, reduced, multipliers)
    for i in range(n):
        out[i] += dot(mass[i], a)
    for k in range(r):
        for i in range(n):
            out[i] += gradient[k, i] * multipliers[k]


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M of the chain and of rotors in closing joints."""
    if at.place(integers, at.ROTORS):
        closure(reals, integers, scratch, t, y, y)  # the rates do not matter
    masses(reals, integers, scratch, t, y, out)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """Accelerations with decay of what loops are open by; NaN where they lock."""
    forces(reals, integers, scratch, t, y, v, scratch[0:0], out)
    n, r = len(y), at.place(integers, at.KEPT)
    masses(reals, integers, scratch, t, y, scratch[at.span(integers, at.MASS, n * n)].reshape(n, n))
    status = spread_rows(integers, scratch, n)
    if status > 0:
        return status
    if status < 0:
        for i in range(n):
            out[i] = math.nan
        return 0
    multipliers = scratch[at.span(integers, at.MULTIPLIERS, r)]
    factor = scratch[at.span(integers, at.FACTOR, n * n)].reshape(n, n)
    spread = scratch[at.span(integers, at.SPREAD, r * n)].reshape(r, n)
    for i in range(n):
        out[i] = -out[i]
    forward(factor, out)
    multipliers_of(reals, integers, scratch, out, multipliers)
    for k in range(r):
        for i in range(n):
            out[i] -= spread[k, i] * multipliers[k]
    backward(factor, out)
    return 0


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Of the chain, less what the loops' forces take of them, and the decay; not symmetric."""
    closure(reals, integers, scratch, t, y, v)
    matrices(reals, integers, scratch, t, y, v, k, c)
    n = len(y)
    r, decay = at.place(integers, at.KEPT), reals[at.place(integers, at.NUMBERS) + at.DECAY]
    if spread_rows(integers, scratch, n) != 0:
        for i in range(n):
            k[i, i] = c[i, i] = math.nan
        return
    factor = scratch[at.span(integers, at.FACTOR, n * n)].reshape(n, n)
    spread = scratch[at.span(integers, at.SPREAD, r * n)].reshape(r, n)
    flexible = scratch[at.span(integers, at.FLEXIBLE, r * r)].reshape(r, r)
    gradient = scratch[at.span(integers, at.GRADIENT, r * n)].reshape(r, n)
    # loads (r, n) = (ZᵀZ)⁻¹ Φ_y into MASS, rows of M⁻¹ Φ_yᵀ into SPREAD
    loads = scratch[at.span(integers, at.MASS, n * n)].reshape(n, n)
    column = scratch[at.span(integers, at.REDUCED, r)]
    for j in range(n):
        for i in range(r):
            column[i] = gradient[i, j]
        forward(flexible, column)
        backward(flexible, column)
        for i in range(r):
            loads[i, j] = column[i]
    for i in range(r):
        backward(factor, spread[i])
    carried = scratch[at.span(integers, at.FACTOR, r * n)].reshape(r, n)
    let_along(spread, loads, gradient, decay * decay, k, carried)
    let_along(spread, loads, gradient, 2 * decay, c, carried)
