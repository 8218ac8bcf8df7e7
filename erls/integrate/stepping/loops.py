"""Steps of generalized-α on coordinates tied by loops, many at once: the algorithm of `erls.integrate.lie_steps`.

Numbers lie in ``known``, counts in ``counts``, vectors (n,) in rows of ``state``, (n + r,) in those of ``unknowns``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops import layout as at
from erls.equations.loops.closure import CLOSURE
from erls.maths import dense
from erls.maths.jit import ENABLED, kernel, part

DONE, FAILED, OPEN = 0, 1, 2
"""Ends of a stretch: all steps made; Newton's method failed; a loop has come apart."""
SINGULAR, SLOW, INFINITE = 1, 2, 3
"""Reasons of a failure."""

# known: formulas of a step, limits of iterations, then what iterations leave to each other
H, BETA, GAMMA, SHARE, PULL, KEEP, TO_V, TO_A, PERIOD, TOLERANCE = range(10)
ROUNDING, REACH, BALANCE, SLOWEST, FASTEST, PATIENCE, TOLERATED, GAP, LAST = range(10, 19)
RATE, BEFORE, SIZE, GOAL, SPENT = range(19, 24)
KNOWN = 24
FACTORED, USUAL, EVALUATIONS, ITERATIONS, FACTORIZATIONS, REASON, STEPS, MAX_ITERATIONS = range(8)
COUNTS = 8
# rows of state: a knot, with its algorithmic acceleration, the one that is tried, forces and those of the loops
Y, V, ACC, ALG, Y1, V1, ACC1, FORCE, REACTION = range(9)
STATE = 9
# rows of unknowns: corrections [m], scales of equations and unknowns; multipliers and violations, in the first r
CORRECTION, LEFT, RIGHT, LAMBDA, LAMBDA1, VIOLATED = range(6)
UNKNOWNS = 6

ADVANCE: Any = None
if ENABLED:
    from numba import types as _t

    ADVANCE = _t.int64(
        contract.pointer(CLOSURE),
        contract.pointer(contract.RESIDUAL),
        contract.pointer(contract.STIFFNESS_AND_DAMPING),
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
        contract.REALS,
        contract.INTEGERS,
        contract.MATRIX,
        contract.MATRIX,
        contract.MATRIX,
        contract.INTEGERS,
        contract.REALS,
        _t.float64[:, :, ::1],
        contract.MATRIX,
    )


@part
def predict(known: Array, state: Array, multipliers: Array) -> None:
    """The end of a step with neither acceleration nor multipliers."""
    h, beta, gamma = known[H], known[BETA], known[GAMMA]
    for i in range(state.shape[1]):
        alg = state[ALG, i]
        new = known[PULL] * state[ACC, i] + known[KEEP] * alg
        state[Y1, i] = state[Y, i] + h * state[V, i] + h * h * ((0.5 - beta) * alg + beta * new)
        state[V1, i] = state[V, i] + h * ((1 - gamma) * alg + gamma * new)
        state[ACC1, i] = 0.0
    for k in range(len(multipliers)):
        multipliers[k] = 0.0


@part
def evaluate(
    forces: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    state: Array,
    multipliers: Array,
) -> tuple[float, float, float]:
    """FORCE and REACTION of the state that is tried; squares of their norms, and of their sum's [N²]."""
    n, r = state.shape[1], at.place(integers, at.KEPT)
    out, reaction = state[FORCE], state[REACTION]
    forces(reals, integers, scratch, t, state[Y1], state[V1], state[ACC1], out)
    gradient = scratch[at.span(integers, at.GRADIENT, r * n)].reshape(r, n)
    metres = reals[at.span(integers, at.METRES, n)]
    for i in range(n):
        reaction[i] = 0.0
    for k in range(r):
        row, multiplier = gradient[k], multipliers[k]
        for i in range(n):
            reaction[i] += row[i] * multiplier
    force = back = both = 0.0
    for i in range(n):
        x, y = out[i] / metres[i], reaction[i] / metres[i]
        force += x * x
        back += y * y
        both += (x + y) * (x + y)
    return force, back, both


@part
def refresh(
    matrices: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    known: Array,
    counts: IntArray,
    state: Array,
    unknowns: Array,
    matrix: Array,
    pivots: IntArray,
) -> bool:
    """Factor the scaled iteration matrix at the state that was evaluated; False when it is singular."""
    n, r = state.shape[1], at.place(integers, at.KEPT)
    metres, gradient = reals[at.span(integers, at.METRES, n)], scratch[at.span(integers, at.GRADIENT, r * n)]
    mass = scratch[at.span(integers, at.MASS, n * n)].reshape(n, n)
    stiffness = scratch[at.span(integers, at.FACTOR, n * n)].reshape(n, n)
    damping = scratch[at.span(integers, at.DAMPING, n * n)].reshape(n, n)
    matrices(reals, integers, scratch, t, state[Y1], state[V1], stiffness, damping)
    left, right = unknowns[LEFT], unknowns[RIGHT]
    heaviest = 0.0
    for i in range(n):
        heaviest = max(heaviest, mass[i, i] / (metres[i] * metres[i]))
    unit = known[PERIOD] * known[PERIOD] / (heaviest if heaviest > 0.0 else 1.0)
    for i in range(n):
        left[i], right[i] = unit / metres[i], 1 / metres[i]
    for k in range(r):
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(gradient[k * n + i]) / metres[i])
        scale = 1 / largest if largest > 0.0 else 1.0
        left[n + k], right[n + k] = scale, scale / unit
    for i in range(n):
        for j in range(n):
            entry = known[TO_A] * mass[i, j] + known[TO_V] * damping[i, j] + stiffness[i, j]
            matrix[j, i] = left[i] * entry * right[j]
    for k in range(r):
        for i in range(n):
            matrix[n + k, i] = left[i] * gradient[k * n + i] * right[n + k]
            matrix[i, n + k] = left[n + k] * gradient[k * n + i] * right[i]
        for j in range(r):
            matrix[n + k, n + j] = 0.0
    status = dense.factor(matrix, pivots)
    counts[FACTORIZATIONS] += 1
    counts[FACTORED] = 1 if status == 0 else 0
    known[RATE], counts[USUAL], known[SPENT] = known[SLOWEST], counts[MAX_ITERATIONS], 0.0
    if status != 0:
        counts[REASON] = SINGULAR
        for i in range(n + r):
            unknowns[CORRECTION, i] = 1.0 if i == status - 1 else 0.0
    return status == 0


@part
def violation_of(integers: IntArray, scratch: Array, out: Array) -> None:
    """Φ of the conditions in use."""
    start = at.place(integers, at.VIOLATION)
    for condition in range(at.place(integers, at.CONDITIONS)):
        k = at.place_of(integers, condition)
        if k >= 0:
            out[k] = scratch[start + condition]


@part
def correct(known: Array, state: Array, unknowns: Array, matrix: Array, pivots: IntArray) -> float:
    """Solve for a correction, apply it, and return its size [m]."""
    n = state.shape[1]
    correction, left, right = unknowns[CORRECTION], unknowns[LEFT], unknowns[RIGHT]
    for i in range(n):
        correction[i] = left[i] * (state[FORCE, i] + state[REACTION, i])
    for k in range(n, len(correction)):
        correction[k] = left[k] * unknowns[VIOLATED, k - n]
    dense.solve(matrix, pivots, correction)
    size = total = 0.0
    for i in range(len(correction)):
        size = max(size, abs(correction[i]))
        total += correction[i]
    if not math.isfinite(size + total):
        return math.inf
    for i in range(n):
        move = right[i] * correction[i]
        state[Y1, i] -= move
        state[V1, i] -= known[TO_V] * move
        state[ACC1, i] -= known[TO_A] * move
    for k in range(n, len(correction)):
        unknowns[LAMBDA1, k - n] -= right[k] * correction[k]
    return size


@part
def note(known: Array, counts: IntArray, iterations: int, rate: float) -> None:
    """How fast iteration was."""
    known[RATE] = min(rate, known[SLOWEST])
    counts[USUAL] = min(counts[USUAL], iterations)
    known[SPENT] = max(0.0, known[SPENT] + iterations - max(counts[USUAL], 2) - known[TOLERATED])


@part
def iterate(
    forces: Callable[..., None],
    matrices: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    known: Array,
    counts: IntArray,
    state: Array,
    unknowns: Array,
    matrix: Array,
    pivots: IntArray,
    fresh: bool,
) -> bool:
    """Newton or chord iteration; False when it does not converge."""
    n, r = state.shape[1], at.place(integers, at.KEPT)
    multipliers, violation = unknowns[LAMBDA1, :r], unknowns[VIOLATED, :r]
    rate = max(known[RATE], known[FASTEST]) ** 0.8
    goal = known[TOLERANCE] + known[ROUNDING]
    before = earlier = largest = size = 0.0
    for k in range(counts[MAX_ITERATIONS] + 1):
        force, reaction, both = evaluate(forces, reals, integers, scratch, t, state, multipliers)
        counts[EVALUATIONS] += 1
        violation_of(integers, scratch, violation)
        if not math.isfinite(force + reaction):
            for i in range(n):
                unknowns[CORRECTION, i] = state[FORCE, i] + state[REACTION, i]
            for i in range(r):
                unknowns[CORRECTION, n + i] = violation[i]
            counts[REASON] = INFINITE
            return False
        largest = max(largest, math.sqrt(force))
        if k > 0 and math.sqrt(both) <= known[BALANCE] * (largest + math.sqrt(reaction)):
            gap = 0.0
            for i in range(r):
                gap = max(gap, abs(violation[i]) * unknowns[LEFT, n + i])
            if gap <= known[BALANCE] * known[REACH]:
                note(known, counts, k, rate)
                return True
        if k == counts[MAX_ITERATIONS]:
            break
        if fresh and not refresh(
            matrices, reals, integers, scratch, t, known, counts, state, unknowns, matrix, pivots
        ):
            return False
        size = correct(known, state, unknowns, matrix, pivots)
        counts[ITERATIONS] += 1
        if not math.isfinite(size):
            counts[REASON] = INFINITE
            return False
        if k > 0:
            rate = size / before if k == 1 else math.sqrt(size / earlier)  # they rise and fall in turns
        if size <= known[ROUNDING] or (rate < 1 and size * rate <= goal * (1 - rate)):
            note(known, counts, k + 1, rate)
            return True
        # a first correction may be small by luck; later ones must lead to the goal in time
        left = 0.0
        if k > 0:
            left = math.log(goal * (1 - rate) / size) / math.log(rate) if 0 < rate < 1 else math.inf
        if k > 1 and (rate > 2 or (left > counts[MAX_ITERATIONS] - k and fresh)):
            break
        fresh = k > 1 and left > known[PATIENCE]
        earlier = before
        before = size
    known[BEFORE], known[SIZE], known[GOAL] = before, size, goal
    counts[REASON] = SLOW
    return False


@part
def is_open(reals: Array, integers: IntArray, scratch: Array, limit: float) -> bool:
    """Whether a condition, in use or left out, is violated by more than ``limit`` [m]."""
    start = at.place(integers, at.VIOLATION)
    for condition in range(at.place(integers, at.CONDITIONS)):
        if abs(scratch[start + condition]) * at.row_scale(reals, integers, condition) > limit:
            return True
    return False


@kernel(ADVANCE, counted=False)
def advance(
    closure: Callable[..., None],
    forces: Callable[..., None],
    matrices: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    known: Array,
    counts: IntArray,
    state: Array,
    unknowns: Array,
    matrix: Array,
    pivots: IntArray,
    times: Array,
    knots: Array,
    multipliers: Array,
) -> int:
    """Steps to ``times``; y, v, a of each into ``knots`` (k, 3, n), its ``multipliers`` (k, r)."""
    n, r = state.shape[1], multipliers.shape[1]
    counts[STEPS] = 0
    for k in range(len(times)):
        t = min(times[k], known[LAST])
        fresh = counts[FACTORED] == 0 or known[SPENT] >= known[PATIENCE]
        while True:
            predict(known, state, unknowns[LAMBDA1, :r])
            if iterate(
                forces, matrices, reals, integers, scratch, t, known, counts, state, unknowns, matrix, pivots, fresh
            ):
                break
            if fresh:
                return FAILED
            fresh = True
        closure(reals, integers, scratch, t, state[Y1], state[V1])
        if is_open(reals, integers, scratch, known[GAP]):
            return OPEN
        for i in range(n):
            alg = known[PULL] * state[ACC, i] + known[KEEP] * state[ALG, i]
            state[ALG, i] = alg + known[SHARE] * state[ACC1, i]
            state[Y, i], state[V, i], state[ACC, i] = state[Y1, i], state[V1, i], state[ACC1, i]
            knots[k, 0, i], knots[k, 1, i], knots[k, 2, i] = state[Y, i], state[V, i], state[ACC, i]
        for i in range(r):
            unknowns[LAMBDA, i] = multipliers[k, i] = unknowns[LAMBDA1, i]
        counts[STEPS] = k + 1
    return DONE
