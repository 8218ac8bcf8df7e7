"""A chain with closed loops as steps of generalized-α take it (`erls.equations.stepped`): coordinates that add, tied by
the conditions in use.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, Factoring, IntArray
from erls.equations.loops.compiled import CompiledLoops
from erls.equations.loops.nearest import largest_gap
from erls.equations.loops.records import (
    call_forces,
    call_matrices,
    read_loop_room,
    read_loops,
)
from erls.equations.stepped import COMPOSE, SETTLE, Stepped
from erls.maths import dense
from erls.maths.jit import kernel


@kernel(COMPOSE, counted=False)
def compose(
    reals: Array, integers: IntArray, scratch: Array, metres: Array, start: Array, increment: Array, out: Array
) -> float:
    """Add; what loops carry is exact to the rounding of the largest lever, however far coordinates have gone."""
    largest = 1.0
    for i in range(len(out)):
        out[i] = start[i] + increment[i]
        largest = max(largest, metres[i])
    return largest


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """[M a - f + Φ_yᵀ λ; Φ], and the norms of both terms; ``a`` holds [a; λ]."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    n, r = len(v), loops.kept
    call_forces(loops.forces, reals, integers, scratch, t, y, v, a[:n], out[:n])
    gradient, reaction, metres = room.gradient, room.reduced, loops.metres
    for i in range(n):
        reaction[i] = 0.0
    for k in range(r):
        row, multiplier = gradient[k], a[n + k]
        for i in range(n):
            reaction[i] += row[i] * multiplier
    force = back = 0.0
    for i in range(n):
        x, y_back = out[i] / metres[i], reaction[i] / metres[i]
        force += x * x
        back += y_back * y_back
        out[i] += reaction[i]
    for condition in range(loops.conditions):
        k = loops.used[condition]
        if k >= 0:
            out[n + k] = room.violation[condition]
    out[n + r], out[n + r + 1] = np.sqrt(force), np.sqrt(back)


@kernel(contract.FACTOR, counted=False)
def factor(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    y: Array,
    v: Array,
    alpha: float,
    beta: float,
    factors: Array,
) -> int:
    """LU factors of [[M + α C + β K, Φ_yᵀ], [Φ_y, 0]], scaled as in `erls.maths.saddle`.

    ``factors`` holds the scales of multipliers and of conditions, the unit of mass, row exchanges, and the matrix.
    """
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    n, r = len(v), loops.kept
    metres, gradient, mass, stiffness, damping = loops.metres, room.gradient, room.mass, room.factor, room.damping
    call_matrices(loops.matrices, reals, integers, scratch, t, y, v, stiffness, damping)
    heaviest = 0.0
    for i in range(n):
        heaviest = max(heaviest, mass[i, i] / (metres[i] * metres[i]))
    heaviest = heaviest if heaviest > 0.0 else 1.0
    factors[2 * r] = heaviest
    first = 2 * r + 1
    whole = factors[first + n + r : first + (n + r) * (n + r + 1)].reshape(n + r, n + r)
    for i in range(n):
        for j in range(n):
            entry = mass[i, j] + alpha * damping[i, j] + beta * stiffness[i, j]
            whole[j, i] = entry / (heaviest * metres[i] * metres[j])
    for k in range(r):
        row, largest = gradient[k], 0.0
        for i in range(n):
            largest = max(largest, abs(row[i]) / metres[i])
        scale = 1.0 / largest if largest > 0.0 else 1.0
        factors[k], factors[r + k] = 1.0 / (scale * heaviest), scale
        for i in range(n):
            whole[n + k, i] = whole[i, n + k] = scale * row[i] / metres[i]
        for j in range(r):
            whole[n + k, n + j] = 0.0
    return int(dense.factor(whole, factors[first : first + n + r]))


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """Replace [b; Φ] by [x; β λ]."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    r = loops.kept
    n, first = len(b) - r, 2 * r + 1
    metres, heaviest = loops.metres, factors[2 * r]
    whole = factors[first + n + r : first + (n + r) * (n + r + 1)].reshape(n + r, n + r)
    for i in range(n):
        b[i] /= heaviest * metres[i]
    for k in range(r):
        b[n + k] *= factors[r + k]
    dense.solve(whole, factors[first : first + n + r], b)
    for i in range(n):
        b[i] /= metres[i]
    for k in range(r):
        b[n + k] /= factors[k]


@kernel(SETTLE, counted=False)
def settle(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, knot: Array
) -> int:
    """A knot; 1 where a condition, in use or left out, was violated too much when it was looked at last."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    if largest_gap(loops.scales, loops.used, room.violation, True) > loops.open:
        return 1
    for i in range(len(y)):
        knot[0, i], knot[1, i], knot[2, i] = y[i], v[i], a[i]
    return 0


def stepped(chain: CompiledLoops, refuse: Callable[[float, Any, Array], None]) -> Stepped:
    """A chain in compiled form; ``refuse`` raises where a loop has come apart."""
    n, r = chain.size, chain.kept
    return Stepped(
        n,
        r,
        n,
        True,
        chain.reals,
        chain.integers,
        chain.scratch,
        compose,
        residual,
        settle,
        chain.mass_matrix,
        chain.stiffness_and_damping,
        Factoring(2 * r + 1 + (n + r) * (n + r + 1), factor, solve, factor, solve),
        lambda y: y,
        lambda y: y.copy(),
        refuse=refuse,
    )
