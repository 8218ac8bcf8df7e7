"""Compiled loop of the adjoint method over the knots of a nodal run: `erls.sensitivity.nodal_kernels.walk` transposed.

With the derivatives of an output by (δq, δv, δv̇, a) at the end of a step and what it asks of δλ there, the multipliers
z of [[M + α C + β K T, Bᵀ], [B T, 0]]ᵀ give the derivative by what a parameter changes of forces and conditions, and
those by the state at the start of the step.
"""

from __future__ import annotations

from typing import Any

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    COMPLEX_MATRIX,
    Model,
    Work,
    read_factors,
    read_layout,
    read_model,
    read_work,
)
from erls.equations.nodal.matrix import factored
from erls.equations.nodal.tangents import EXACT, Exact, exact_blocks
from erls.maths import fronts
from erls.maths.band_transposed import solve_transposed
from erls.maths.coefficients import stumpff, tangent_coefficients
from erls.maths.jit import ENABLED, kernel, part
from erls.maths.motions import series_transposed, transposed
from erls.maths.rotations import exponential, value
from erls.maths.vectors import dot, put, three
from erls.maths.views import matrix_at
from erls.sensitivity.nodal_kernels import (
    ACCELERATION,
    ALGORITHMIC,
    BETA,
    GAMMA,
    KEEP,
    PLACE,
    PULL,
    RATE,
    SHARE,
    add_blocks,
    add_conditions,
    evaluate,
)

_BACK: Any = None
if ENABLED:
    from numba import types as _t

    from erls.equations.compiled_system import INTEGERS, MATRIX, REALS

    _stack = _t.float64[:, :, ::1]
    _BACK = _t.int64(
        EXACT,
        *(REALS, INTEGERS, REALS),
        *(REALS, COMPLEX_MATRIX, COMPLEX_MATRIX),
        *(REALS, REALS, REALS),
        *(MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX),
        *(_stack, _stack, _stack),
    )


@part
def _solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """`erls.equations.nodal.matrix.solve` with the transpose."""
    own = read_layout(reals, integers, integers[len(integers) - 1])
    model, room = read_model(reals, integers, own.model), read_factors(factors, integers, own.factors)
    order = model.order
    for i in range(len(order)):
        room.ordered[i] = room.right[order[i]] * b[order[i]]
    if model.band < 0:
        fronts.solve_transposed(room.entries, model.fronts, model.later, room.pivots, room.ordered)
    else:
        solve_transposed(matrix_at(room.entries, 0, len(order), 3 * model.band + 1), room.pivots, room.ordered)
    for i in range(len(order)):
        b[order[i]] = room.left[order[i]] * room.ordered[i]


@part
def _carried_back(work: Work, by: Array, whole: bool, out: Array) -> None:
    """T(d)ᵀ of derivatives by a change at the end of a step; of the whole motion of the step Ad(exp -d)ᵀ."""
    for node in range(len(work.poses)):
        at = 6 * node
        u, psi = three(work.increment, at), three(work.increment, at + 3)
        c = stumpff(dot(psi, psi))
        n, m = three(by, at), three(by, at + 3)
        if whole:
            moved = transposed(value(c[1], c[2], psi, u), exponential(psi, c[0], c[1]), n, m)
        else:
            f, g = tangent_coefficients(c)
            moved = series_transposed(f, g, u, psi, n, m)
        put(out, at, moved[0])
        put(out, at + 3, moved[1])


@part
def _step_back(
    model: Model,
    work: Work,
    rule: Array,
    h: float,
    reals: Array,
    integers: IntArray,
    factors: Array,
    seed: Array,
    by: Array,
    memory: Array,
    out: Array,
) -> None:
    """Derivatives ``by`` (4, n) at the end of a step become those at its start; ``out`` (n + m,) gets multipliers."""
    n, m = len(work.v), len(work.multipliers)
    beta, gamma, share = rule[BETA], rule[GAMMA], rule[SHARE]
    to_v, to_a = gamma / (h * beta), 1.0 / (h * h * beta * share)
    moved, place, ahead = memory[0], memory[1], memory[2]
    for i in range(n):
        by[PLACE, i] += seed[i]
        by[RATE, i] += seed[n + i]
        by[ACCELERATION, i] += seed[2 * n + i]
    _carried_back(work, by[PLACE], False, moved)
    for i in range(n):
        out[i] = moved[i] + to_v * by[RATE, i] + to_a * (by[ACCELERATION, i] + share * by[ALGORITHMIC, i])
    for k in range(m):
        out[n + k] = to_a * seed[3 * n + k]
    _solve(reals, integers, factors, out)
    for i in range(n):
        out[i] *= -1.0 / to_a
    for k in range(n, n + m):
        out[k] = -out[k]
    rate = by[RATE]
    for i in range(n):
        place[i] = by[PLACE, i]
    add_blocks(model, work, 1, True, out, rate)
    add_blocks(model, work, 2, True, out, place)
    add_conditions(model, work, True, out, place)
    _carried_back(work, place, True, by[PLACE])
    _carried_back(work, place, False, ahead)
    for i in range(n):
        later = by[ALGORITHMIC, i] + h * h * beta * ahead[i] + h * gamma * rate[i]
        old = h * h * (0.5 - beta) * ahead[i] + h * (1.0 - gamma) * rate[i] + rule[KEEP] * later
        by[RATE, i] = rate[i] + h * ahead[i]
        by[ACCELERATION, i] = rule[PULL] * later
        by[ALGORITHMIC, i] = old


@kernel(_BACK, counted=False)
def walk_back(
    exact: Exact,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    factors: Array,
    poses: Array,
    motion: Array,
    rule: Array,
    sizes: Array,
    ratios: Array,
    samples: Array,
    increments: Array,
    q: Array,
    v: Array,
    a: Array,
    memory: Array,
    seeds: Array,
    state: Array,
    out: Array,
) -> int:
    """Transposed steps from the last knot of a stretch back; 0, or 1 + the row at which a matrix was singular.

    Parameters
    ----------
    exact, reals, integers, scratch, factors, poses, motion, rule, sizes, ratios, samples, increments, q, v, a
        As of `erls.sensitivity.nodal_kernels.walk`.
    memory : (4, n + m + 2) array
    seeds : (k, c, 3 n + m) array
        Derivatives of c outputs by δq, δv, δv̇ and δλ at the knots.
    state : (c, 4, n) array
        By the state at the end of the stretch, what seeds there ask left out; that at its start afterwards.
    out : (k, c, n + m) array
        Multipliers of ∂R/∂p and ∂Φ/∂p.
    """
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    n = len(work.v)
    for row in range(len(q) - 1, -1, -1):
        h = sizes[row]
        to_v, to_a = rule[GAMMA] / (h * rule[BETA]), 1.0 / (h * h * rule[BETA] * rule[SHARE])
        evaluate(reals, integers, scratch, samples[row], q[row], v[row], a[row], memory[3])
        exact_blocks(exact, reals, integers, scratch, poses, motion)
        for i in range(n):
            work.increment[i] = increments[row, i]
        if factored(reals, integers, scratch, to_v / to_a, 1.0 / to_a, factors) != 0:
            return row + 1
        for k in range(len(state)):
            by = state[k]
            _step_back(model, work, rule, h, reals, integers, factors, seeds[row, k], by, memory, out[row, k])
            if ratios[row] != 1.0:
                for i in range(n):
                    rest = ratios[row] * by[ALGORITHMIC, i]
                    by[ACCELERATION, i] += by[ALGORITHMIC, i] - rest
                    by[ALGORITHMIC, i] = rest
    return 0
