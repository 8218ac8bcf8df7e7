"""The steps of the error equation over two compiled systems; `erls.auto.error_motion` has the equation.

Generalized-α with a frozen iteration matrix, from knot to knot of the computed motion. Numbers lie in ``known``,
vectors in the rows of ``state`` (those of the whole system) and of ``lesser_state`` (of the system that was run).
"""

from __future__ import annotations

import math
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import (
    Array,
    Functions,
    IntArray,
    call_mass_matrix,
    call_residual,
    call_stiffness_and_damping,
)
from erls.maths import dense
from erls.maths.jit import ENABLED, helper, kernel

# known: formulas of generalized-α, what iterations may leave, then what steps leave behind
ALPHA_M, ALPHA_F, GAMMA, BETA, ACCURACY, DURATION = range(6)
H, FACTORED, LARGEST = range(6, 9)
KNOWN = 9
# rows of state: the error e, ė, ë and generalized-α's own acceleration; those tried; the motion itself; scratch
E, RATE, ACC, ALG, E1, RATE1, ACC1, Y, V, A, TRIED_Y, TRIED_V, TRIED_A, LEFT, OUT, METRES = range(16)
STATE = 16
LESSER_STATE = 4  # y, v, a, what is out of balance
_ITERATIONS, _SLOW = 15, 6
_PART, _ROUNDING = 0.05, 1e-14

_FOLLOW: Any = None
if ENABLED:
    from numba import types as _t

    _CUBE = _t.float64[:, :, ::1]
    _FOLLOW = _t.int64(
        contract.FUNCTIONS,
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
        _t.int64,
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
        _CUBE,
        contract.REALS,
        contract.MATRIX,
        contract.MATRIX,
        _CUBE,
        contract.INTEGERS,
        _CUBE,
    )


@helper
def factor_matrix(a: Array, pivots: IntArray) -> int:
    """LU factors of a matrix whose columns are the rows of ``a``; 0, or the number of a pivot that is zero."""
    return int(dense.factor(a, pivots))


@helper
def solve_matrix(a: Array, pivots: IntArray, b: Array) -> None:
    """Replace ``b`` by the solution."""
    dense.solve(a, pivots, b)


@helper
def predict(state: Array, known: Array, h: float) -> None:
    """E1, RATE1, ACC1 with ë as it was."""
    share = (1 - known[ALPHA_F]) / (1 - known[ALPHA_M])
    pull, keep = known[ALPHA_F] / (1 - known[ALPHA_M]), -known[ALPHA_M] / (1 - known[ALPHA_M])
    beta, gamma = known[BETA], known[GAMMA]
    for i in range(state.shape[1]):
        acc, alg = state[ACC, i], state[ALG, i]
        new = pull * acc + keep * alg + share * acc
        state[ACC1, i] = acc
        state[E1, i] = state[E, i] + h * state[RATE, i] + h * h * ((0.5 - beta) * alg + beta * new)
        state[RATE1, i] = state[RATE, i] + h * ((1 - gamma) * alg + gamma * new)


@helper
def try_state(state: Array) -> None:
    """The motion with the error that is tried."""
    for i in range(state.shape[1]):
        state[TRIED_Y, i] = state[Y, i] + state[E1, i]
        state[TRIED_V, i] = state[V, i] + state[RATE1, i]
        state[TRIED_A, i] = state[A, i] + state[ACC1, i]


@helper
def iteration_matrix(matrices: Array, to_v: float, to_a: float) -> None:
    """S in the last of the matrices, transposed."""
    n = matrices.shape[1]
    for i in range(n):
        for j in range(n):
            matrices[3, j, i] = to_a * matrices[0, i, j] + to_v * matrices[1, i, j] + matrices[2, i, j]


@helper
def correct(state: Array, known: Array, to_v: float, to_a: float) -> float:
    """Take the correction in OUT off what is tried; its size [m]."""
    size, total = 0.0, 0.0
    for i in range(state.shape[1]):
        move = state[OUT, i]
        total += move
        size = max(size, abs(state[METRES, i] * move))
        state[E1, i] -= move
        state[RATE1, i] -= to_v * move
        state[ACC1, i] -= to_a * move
    return size if math.isfinite(total) else math.inf


@helper
def largest(state: Array, row: int) -> float:
    """Of a row, in metres."""
    result = 0.0
    for i in range(state.shape[1]):
        result = max(result, abs(state[METRES, i] * state[row, i]))
    return result


@kernel(_FOLLOW, counted=False)
def follow(
    system: Functions,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    lesser: int,
    lesser_reals: Array,
    lesser_integers: IntArray,
    lesser_scratch: Array,
    kept: IntArray,
    times: Array,
    knots: Array,
    known: Array,
    state: Array,
    lesser_state: Array,
    matrices: Array,
    pivots: IntArray,
    found: Array,
) -> int:
    """Follow the error over a leg, from e, ė, ë at its first knot.

    Parameters
    ----------
    system, reals, integers, scratch
        The whole system.
    lesser, lesser_reals, lesser_integers, lesser_scratch
        Residual of the system that was run, by address as those of the whole.
    kept : (m,) array
        Places of its coordinates in the whole system.
    times, knots : (k,), (k, 3, m) arrays
        Its motion y, v, a.
    found : (k, 2, n) array
        Gets e and ė.

    Returns
    -------
    int
        Number of knots reached; minus the number of the first one where the iteration fails.
    """
    n, m = state.shape[1], len(kept)
    share = (1 - known[ALPHA_F]) / (1 - known[ALPHA_M])
    pull, keep = known[ALPHA_F] / (1 - known[ALPHA_M]), -known[ALPHA_M] / (1 - known[ALPHA_M])
    state[Y, :] = 0.0
    state[V, :] = 0.0
    state[A, :] = 0.0
    for i in range(n):
        found[0, 0, i], found[0, 1, i] = state[E, i], state[RATE, i]
    for k in range(1, len(times)):
        t, h = times[k], times[k] - times[k - 1]
        if abs(h - known[H]) > 1e-6 * h:
            ratio = h / known[H] if known[H] > 0 else 1.0
            for i in range(n):
                state[ALG, i] = state[ACC, i] + (state[ALG, i] - state[ACC, i]) * ratio
            known[H], known[FACTORED] = h, 0.0
        to_v, to_a = known[GAMMA] / (h * known[BETA]), 1 / (h * h * known[BETA] * share)
        for i in range(m):
            for row in range(3):
                lesser_state[row, i] = knots[k, row, i]
                state[Y + row, kept[i]] = knots[k, row, i]
        state[LEFT, :] = 0.0
        if m > 0:
            call_residual(
                lesser,
                lesser_reals,
                lesser_integers,
                lesser_scratch,
                t,
                lesser_state[0],
                lesser_state[1],
                lesser_state[2],
                lesser_state[3],
            )
            for i in range(m):
                state[LEFT, kept[i]] = lesser_state[3, i]
        # what iterations leave in e is an acceleration, 1/h² of it, that moves joints over the whole run
        goal = _PART * (h / known[DURATION]) ** 2 * max(known[ACCURACY], known[LARGEST])
        goal = max(goal, _ROUNDING * largest(state, Y))
        fresh, done = known[FACTORED] == 0.0, False
        for _ in range(2):  # at last with fresh factors
            predict(state, known, h)
            try_state(state)
            if fresh:
                y, v, stiffness, damping = state[TRIED_Y], state[TRIED_V], matrices[2], matrices[1]
                call_mass_matrix(system.mass_matrix, reals, integers, scratch, t, y, matrices[0])
                call_stiffness_and_damping(
                    system.stiffness_and_damping, reals, integers, scratch, t, y, v, stiffness, damping
                )
                iteration_matrix(matrices, to_v, to_a)
                factor_matrix(matrices[3], pivots)  # what is singular shows in the corrections
                known[FACTORED] = 1.0
            before = math.inf
            for count in range(_ITERATIONS):
                y, v, a = state[TRIED_Y], state[TRIED_V], state[TRIED_A]
                call_residual(system.residual, reals, integers, scratch, t, y, v, a, state[OUT])
                for i in range(n):
                    state[OUT, i] -= state[LEFT, i]
                solve_matrix(matrices[3], pivots, state[OUT])
                size = correct(state, known, to_v, to_a)
                if not size < 2 * before:
                    break
                try_state(state)
                if (size * min(1.0, size / before) if count > 0 else size) <= goal:
                    done = True
                    if count >= _SLOW:
                        known[FACTORED] = 0.0
                    break
                before = size
            if done or fresh:
                break
            fresh = True
        if not done:
            return -k
        for i in range(n):
            acc, new = state[ACC, i], state[ACC1, i]
            state[ALG, i] = pull * acc + keep * state[ALG, i] + share * new
            state[E, i], state[RATE, i], state[ACC, i] = state[E1, i], state[RATE1, i], new
            found[k, 0, i], found[k, 1, i] = state[E, i], state[RATE, i]
        known[LARGEST] = max(known[LARGEST], largest(state, E))
    return len(times)
