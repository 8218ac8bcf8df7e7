"""Compiled loops over the knots of a nodal run: configurations, forces at other constants, and linearized steps.

A step of Lie-group generalized-α (`erls.integrate.lie_generalized_alpha`), its size held, makes of small changes δq of
the last knot, in the axes of each node, and of its increment d

    δq₁ = Ad(exp -d) δq₀ + T(d) δd,    δd = δd₀ + δv̇₁/β',    δv₁ = δv₀ + γ'/β' δv̇₁

with what (δv, δv̇, δa) of the last knot give to δd₀ and δv₀; and at its end

    M δv̇₁ + C δv₁ + K δq₁ + Bᵀ δλ₁ + ∂R/∂p = 0,    B δq₁ + ∂Φ/∂p = 0.
"""

from __future__ import annotations

from typing import Any

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    COMPLEX_MATRIX,
    Model,
    Work,
    call_knot,
    call_remember,
    call_turn_actuators,
    read_before,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.equations.nodal.matrix import factored, solve
from erls.equations.nodal.motion import compose
from erls.equations.nodal.step import keep, residual
from erls.equations.nodal.tangents import EXACT, Exact, exact_blocks
from erls.maths.coefficients import stumpff, tangent_coefficients
from erls.maths.jit import ENABLED, kernel, part
from erls.maths.motions import pair_plus, series, transformed
from erls.maths.rotations import exponential, value
from erls.maths.vectors import dot, put, three

BETA, GAMMA, SHARE, PULL, KEEP = range(5)
"""Coefficients of steps, as in `erls.integrate.alpha_rules.Formulas`."""
PLACE, RATE, ACCELERATION, ALGORITHMIC = range(4)
"""Rows of small changes: of q, v, v̇ and of the algorithmic acceleration a."""

_CONFIGURATIONS: Any = None
_RESIDUALS: Any = None
_STORED: Any = None
_WALK: Any = None
if ENABLED:
    from numba import types as _t

    from erls.equations.compiled_system import INTEGERS, MATRIX, REALS

    _stack = _t.float64[:, :, ::1]
    _memory = REALS, INTEGERS, REALS
    _CONFIGURATIONS = _t.void(*_memory, MATRIX, REALS, MATRIX)
    _RESIDUALS = _t.void(*_memory, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX)
    _STORED = _t.void(*_memory, MATRIX, MATRIX, MATRIX, MATRIX, _stack)
    _WALK = _t.int64(
        EXACT,
        *_memory,
        *(REALS, COMPLEX_MATRIX, COMPLEX_MATRIX),
        *(REALS, REALS, REALS),
        *(MATRIX, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX),
        *(_stack, _stack, _stack),
    )


@part
def evaluate(
    reals: Array, integers: IntArray, scratch: Array, samples: Array, q: Array, v: Array, a: Array, out: Array
) -> None:
    """Forces out of balance of a knot, near its own configuration; working memory holds it."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    before = read_before(scratch, integers, known.before).numbers
    for i in range(len(samples)):
        scratch[i] = samples[i]
    for i in range(len(q)):
        before[i] = q[i]
    residual(reals, integers, scratch, 0.0, q, v, a, out)


@kernel(_CONFIGURATIONS, counted=False)
def configurations(
    reals: Array, integers: IntArray, scratch: Array, poses: Array, last: Array, out: Array
) -> None:
    """Knots (k, c) in flat memory, from poses (k, 12 nodes) and the configuration before the first of them."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    work = read_work(scratch, integers, known.work)
    for row in range(len(poses)):
        for node in range(len(work.poses)):
            for i in range(12):
                work.poses[node, i] = poses[row, 12 * node + i]
        call_remember(known.remember, reals, integers, scratch, last)
        there = read_state(last, integers, known.state)
        for node in range(len(work.poses)):
            for i in range(12):
                there.poses[node, i] = work.poses[node, i]
        keep(work, there)
        for i in range(len(last)):
            out[row, i] = last[i]


@kernel(_RESIDUALS, counted=False)
def residuals(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    samples: Array,
    q: Array,
    v: Array,
    a: Array,
    out: Array,
) -> None:
    """(k, n + m + 2) what `erls.equations.nodal.step.residual` says of knots."""
    for row in range(len(q)):
        evaluate(reals, integers, scratch, samples[row], q[row], v[row], a[row], out[row])


@kernel(_STORED, counted=False)
def stored(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    q: Array,
    increments: Array,
    v: Array,
    a: Array,
    out: Array,
) -> None:
    """(k, 3, s) what a run keeps of knots displaced by increments (k, n)."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for row in range(len(q)):
        for i in range(len(work.v)):
            work.v[i], work.a[i], work.increment[i] = v[row, i], a[row, i], increments[row, i]
        compose(model, read_state(q[row], integers, known.state).poses, work.increment, work.poses)
        if known.turn_actuators >= 0:
            call_turn_actuators(known.turn_actuators, reals, integers, scratch, q[row])
        call_knot(known.knot, reals, integers, scratch, out[row])


@part
def add_blocks(model: Model, work: Work, kind: int, back: bool, x: Array, out: Array) -> None:
    """out += the sum of all blocks of a kind times a change of the nodes; ``back``: its transpose times forces."""
    for e in range(len(model.pairs)):
        block = work.blocks[e, kind]
        for side in range(2):
            row = 6 * model.pairs[e, side]
            if row < 0:
                continue
            for other in range(2):
                column = 6 * model.pairs[e, other]
                if column < 0:
                    continue
                for i in range(6):
                    for j in range(6):
                        entry = block[6 * side + i, 6 * other + j]
                        if back:
                            out[column + j] += entry * x[row + i]
                        else:
                            out[row + i] += entry * x[column + j]


@part
def add_conditions(model: Model, work: Work, back: bool, x: Array, out: Array) -> None:
    """out[n:] += B times a change of the nodes; ``back``: out += Bᵀ times x[n:]."""
    n = len(work.force)
    for j in range(len(model.joint_nodes)):
        for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
            for side in range(2):
                column = 6 * model.joint_nodes[j, side]
                if column >= 0:
                    for i in range(6):
                        entry = work.gradient[row, 6 * side + i]
                        if back:
                            out[column + i] += entry * x[n + row]
                        else:
                            out[n + row] += entry * x[column + i]


@part
def _carried(work: Work, start: Array, change: Array, out: Array) -> None:
    """Ad(exp -d) of a change at the start of a step, and T(d) of one of the increment d; the former may be none."""
    for node in range(len(work.poses)):
        at = 6 * node
        u, psi = three(work.increment, at), three(work.increment, at + 3)
        c = stumpff(dot(psi, psi))
        f, g = tangent_coefficients(c)
        moved = series(f, g, u, psi, three(change, at), three(change, at + 3))
        if len(start) > 0:
            place, turn = value(c[1], c[2], psi, u), exponential(psi, c[0], c[1])
            moved = pair_plus(moved, transformed(place, turn, three(start, at), three(start, at + 3)))
        put(out, at, moved[0])
        put(out, at + 3, moved[1])


@part
def _step(
    model: Model,
    work: Work,
    rule: Array,
    h: float,
    reals: Array,
    integers: IntArray,
    factors: Array,
    slopes: Array,
    change: Array,
    memory: Array,
    right: Array,
) -> None:
    """Small changes (4, n) of one parameter over a step, in place; ``right`` gets β'⁻¹ times those of multipliers."""
    n, m = len(work.v), len(work.multipliers)
    beta, gamma, share = rule[BETA], rule[GAMMA], rule[SHARE]
    to_v, to_a = gamma / (h * beta), 1.0 / (h * h * beta * share)
    later, ahead, rate, place = memory[0], memory[1], memory[2], memory[3]
    for i in range(n):
        old = change[ALGORITHMIC, i]
        later[i] = rule[PULL] * change[ACCELERATION, i] + rule[KEEP] * old
        ahead[i] = h * change[RATE, i] + h * h * ((0.5 - beta) * old + beta * later[i])
        rate[i] = change[RATE, i] + h * ((1.0 - gamma) * old + gamma * later[i])
    _carried(work, change[PLACE], ahead, place)
    for i in range(n + m):
        right[i] = slopes[i]
    add_blocks(model, work, 1, False, rate, right)
    add_blocks(model, work, 2, False, place, right)
    add_conditions(model, work, False, place, right)
    for i in range(n):
        right[i] *= -1.0 / to_a
    for k in range(n, n + m):
        right[k] = -right[k]
    solve(reals, integers, factors, right)
    _carried(work, right[:0], right, ahead)
    for i in range(n):
        change[PLACE, i] = place[i] + ahead[i]
        change[RATE, i] = rate[i] + to_v * right[i]
        change[ACCELERATION, i] = to_a * right[i]
        change[ALGORITHMIC, i] = later[i] + share * change[ACCELERATION, i]
    for k in range(n, n + m):
        right[k] *= to_a


@kernel(_WALK, counted=False)
def walk(
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
    slopes: Array,
    state: Array,
    out: Array,
) -> int:
    """Linearized steps to the knots of a stretch of a leg; how many were made before a matrix was singular.

    Parameters
    ----------
    exact, reals, integers, scratch
        Of the system.
    factors, poses, motion, memory
        Memory: of factors, of `erls.equations.nodal.tangents`, and (5, n + m + 2).
    rule : (5,) array
        Coefficients, in the order above.
    sizes, ratios : (k,) arrays
        Steps [s], and by how much each is larger than the one before: with it goes what a differs from v̇ by.
    samples, increments, q, v, a : (k, ...) arrays
        Of the knots; increments (k, n) lead to them.
    slopes : (k, p, n + m) array
        ∂R/∂p and ∂Φ/∂p.
    state : (p, 4, n) array
        Small changes at the last knot, in the order above; those at the end of the stretch afterwards.
    out : (k, p, 3 n + m) array
        δq, δv, δv̇ and δλ.
    """
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    n, m, right = len(work.v), len(work.multipliers), memory[4]
    for row in range(len(q)):
        h = sizes[row]
        to_v, to_a = rule[GAMMA] / (h * rule[BETA]), 1.0 / (h * h * rule[BETA] * rule[SHARE])
        evaluate(reals, integers, scratch, samples[row], q[row], v[row], a[row], right)
        exact_blocks(exact, reals, integers, scratch, poses, motion)
        for i in range(n):
            work.increment[i] = increments[row, i]
        if factored(reals, integers, scratch, to_v / to_a, 1.0 / to_a, factors) != 0:
            return row
        for p in range(len(state)):
            change, found = state[p], out[row, p]
            if ratios[row] != 1.0:
                for i in range(n):
                    rest = change[ALGORITHMIC, i] - change[ACCELERATION, i]
                    change[ALGORITHMIC, i] = change[ACCELERATION, i] + ratios[row] * rest
            _step(model, work, rule, h, reals, integers, factors, slopes[row, p], change, memory, right)
            for i in range(n):
                found[i], found[n + i], found[2 * n + i] = change[PLACE, i], change[RATE, i], change[ACCELERATION, i]
            for k in range(m):
                found[3 * n + k] = right[n + k]
    return len(q)
