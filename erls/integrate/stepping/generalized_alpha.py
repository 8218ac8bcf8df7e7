"""The steps of generalized-α over a compiled system: the algorithm of `erls.integrate.generalized_alpha`.

``advance`` makes as many steps as there is room for knots, or until the leg ends or fails, and leaves everything that
the next call needs in its arguments: numbers in ``known``, counts in ``counts``, vectors in the rows of ``state``. A
system's own way of solving serves where it has one, with its factors in ``own``; otherwise that is empty, and dense
factors are made in ``matrices``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.maths.jit import ENABLED, kernel, part

# known: settings of a run, then the formulas of a step (see set_step), then what the last iteration found
START, SPAN, LAST, END = 0, 1, 2, 3  # of the leg; its last time for forces
ALPHA_M, ALPHA_F, GAMMA, BETA, ASKED = 4, 5, 6, 7, 8
H, TOLERANCE, TO_V, TO_A, SHARE, PULL, KEEP, Y_OLD, Y_NEW, V_OLD, V_NEW = range(9, 20)
RATE, BEFORE, SIZE, GOAL = 20, 21, 22, 23
SLOWEST, FASTEST, ROUNDING = 24, 25, 26  # bounds on rates; rounding of coordinates
KNOWN = 27
# counts; the first three of time units: reached, of the leg, in an unhalved step
AT, TOTAL, UNIT, HALVINGS, SERVED, FACTORED, USUAL, EXCESS = range(8)
MAX_HALVINGS, MAX_ITERATIONS, REFRESH_COST = 8, 9, 10
RHS_CALLS, ITERATIONS, FACTORIZATIONS, REJECTED = 11, 12, 13, 14
REASON = 15
COUNTS = 16
SINGULAR, NOT_FINITE, SLOW = 1, 2, 3  # reasons
# rows of state
Y, V, ACC, ALG, CHANGE, GUESS, Y1, V1, ACC1, RESIDUAL, CORRECTION, METRES, PER_METRE = range(13)
STATE = 13

_ADVANCE: Any = None
if ENABLED:
    from numba import types as _t

    _ADVANCE = _t.int64(
        contract.pointer(contract.RESIDUAL),
        contract.pointer(contract.MASS_MATRIX),
        contract.pointer(contract.STIFFNESS_AND_DAMPING),
        contract.pointer(contract.FACTOR),
        contract.pointer(contract.SOLVE),
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
        contract.REALS,
        contract.REALS,
        contract.INTEGERS,
        contract.MATRIX,
        _t.float64[:, :, ::1],
        contract.INTEGERS,
        contract.REALS,
        _t.float64[:, :, ::1],
    )


@part
def set_step(known: Array, counts: IntArray, h: float) -> None:
    """Formulas for steps of ``h``; a step that differs only by rounding keeps the matrix."""
    if abs(h - known[H]) > 1e-6 * h:
        counts[FACTORED] = 0
    gamma, beta = known[GAMMA], known[BETA]
    known[H] = h
    known[TOLERANCE] = known[ASKED] * min(1.0, max(h / 1e-3, 0.01)) ** 3
    share = (1 - known[ALPHA_F]) / (1 - known[ALPHA_M])
    known[TO_V], known[TO_A] = gamma / (h * beta), 1 / (h * h * beta * share)
    known[SHARE], known[PULL] = share, known[ALPHA_F] / (1 - known[ALPHA_M])
    known[KEEP] = -known[ALPHA_M] / (1 - known[ALPHA_M])
    known[Y_OLD], known[Y_NEW] = h * h * (0.5 - beta), h * h * beta
    known[V_OLD], known[V_NEW] = h * (1 - gamma), h * gamma


@part
def change_step(known: Array, counts: IntArray, state: Array) -> None:
    """Set the step of the present halvings, with a₀ moved along and nothing to foretell the next ÿ from."""
    before = known[H]
    count = counts[TOTAL] // counts[UNIT]
    set_step(known, counts, known[SPAN] / count / (1 << counts[HALVINGS]))
    ratio = known[H] / before
    for i in range(state.shape[1]):
        state[ALG, i] = state[ACC, i] + (state[ALG, i] - state[ACC, i]) * ratio
        state[CHANGE, i] = state[GUESS, i] = 0.0


@part
def factor(a: Array, pivots: IntArray) -> int:
    """LU factors, with row exchanges, of a matrix whose columns are the rows of ``a``; status as of dgetrf."""
    n = a.shape[0]
    status = 0
    for k in range(n):
        column = a[k]
        row, largest = k, abs(column[k])
        for i in range(k + 1, n):
            if abs(column[i]) > largest:
                row, largest = i, abs(column[i])
        pivots[k] = row
        if largest == 0.0:  # what is not finite shows in the solution
            if status == 0:
                status = k + 1
            continue
        if row != k:
            for j in range(n):
                a[j, k], a[j, row] = a[j, row], a[j, k]
        inverse = 1.0 / column[k]
        for i in range(k + 1, n):
            column[i] *= inverse
        for j in range(k + 1, n):
            other = a[j]
            weight = other[k]
            for i in range(k + 1, n):
                other[i] -= weight * column[i]
    return status


@part
def back_solve(a: Array, pivots: IntArray, b: Array) -> None:
    """Replace ``b`` by the solution, with what `factor` left."""
    n = a.shape[0]
    for k in range(n):
        row = pivots[k]
        b[k], b[row] = b[row], b[k]
    for k in range(n):
        column, weight = a[k], b[k]
        for i in range(k + 1, n):
            b[i] -= weight * column[i]
    for k in range(n - 1, -1, -1):
        column = a[k]
        weight = b[k] / column[k]
        b[k] = weight
        for i in range(k):
            b[i] -= weight * column[i]


@part
def predict(known: Array, state: Array) -> None:
    """Y1, V1, ACC1 from the guess of the change of ÿ."""
    h, y_old, y_new, v_old, v_new = known[H], known[Y_OLD], known[Y_NEW], known[V_OLD], known[V_NEW]
    for i in range(state.shape[1]):
        acc, alg = state[ACC, i], state[ALG, i]
        acc1 = acc + state[GUESS, i]
        alg1 = known[PULL] * acc + known[KEEP] * alg + known[SHARE] * acc1
        state[ACC1, i] = acc1
        state[Y1, i] = state[Y, i] + h * state[V, i] + y_old * alg + y_new * alg1
        state[V1, i] = state[V, i] + v_old * alg + v_new * alg1


@part
def refresh(
    mass_matrix: Callable[..., None],
    stiffness_and_damping: Callable[..., None],
    own_factor: Callable[..., int],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    own: Array,
    t: float,
    known: Array,
    counts: IntArray,
    state: Array,
    matrices: Array,
    pivots: IntArray,
) -> bool:
    """Factor S at Y1, V1, scaled to newtons per metre, or S / β' in the system's own way; False when it is singular."""
    n = state.shape[1]
    if len(own) > 0:
        alpha, beta = known[TO_V] / known[TO_A], 1 / known[TO_A]
        info = own_factor(reals, integers, scratch, t, state[Y1], state[V1], alpha, beta, own)
    else:
        matrix, stiffness, damping, factors = matrices[0], matrices[1], matrices[2], matrices[3]
        stiffness_and_damping(reals, integers, scratch, t, state[Y1], state[V1], stiffness, damping)
        mass_matrix(reals, integers, scratch, t, state[Y1], matrix)
        per = state[PER_METRE]
        for i in range(n):
            for j in range(n):
                entry = known[TO_A] * matrix[i, j] + known[TO_V] * damping[i, j] + stiffness[i, j]
                factors[j, i] = per[i] * entry * per[j]
        info = factor(factors, pivots)
    counts[FACTORIZATIONS] += 1
    counts[FACTORED] = 1 if info == 0 else 0
    known[RATE], counts[USUAL], counts[EXCESS] = known[SLOWEST], counts[MAX_ITERATIONS], 0
    if info != 0:
        counts[REASON] = SINGULAR
        for i in range(n):
            state[CORRECTION, i] = 1.0 if i == info - 1 else 0.0
    return info == 0


@part
def iterate(
    residual: Callable[..., None],
    own_solve: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    own: Array,
    t: float,
    known: Array,
    counts: IntArray,
    state: Array,
    matrices: Array,
    pivots: IntArray,
) -> bool:
    """Chord iteration on Y1, V1, ACC1; True when the remaining error is estimated within tolerance."""
    n = state.shape[1]
    y, v, acc = state[Y1], state[V1], state[ACC1]
    metres, per_metre, out, correction = state[METRES], state[PER_METRE], state[RESIDUAL], state[CORRECTION]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(metres[i] * y[i]))
    rounding = known[ROUNDING] * largest
    goal = known[TOLERANCE] + rounding
    known[GOAL] = goal
    rate, before, size = max(known[RATE], known[FASTEST]) ** 0.8, 0.0, 0.0
    known[BEFORE] = 0.0
    for k in range(1, counts[MAX_ITERATIONS] + 1):
        counts[RHS_CALLS] += 1
        counts[ITERATIONS] += 1
        residual(reals, integers, scratch, t, y, v, acc, out)
        if len(own) > 0:
            for i in range(n):
                correction[i] = out[i] / known[TO_A]
            own_solve(reals, integers, own, correction)
            for i in range(n):
                correction[i] *= metres[i]
        else:
            for i in range(n):
                correction[i] = out[i] * per_metre[i]
            back_solve(matrices[3], pivots, correction)
        size, total = 0.0, 0.0
        for i in range(n):
            size = max(size, abs(correction[i]))
            total += correction[i]
        # forces square what they are given: a size whose square overflows is as good as infinite
        if not math.isfinite(size * size + total * total):
            finite = True
            for i in range(n):
                finite = finite and math.isfinite(out[i])
            for i in range(n):
                correction[i] = correction[i] * abs(correction[i]) if finite else out[i]
            counts[REASON] = NOT_FINITE
            return False
        for i in range(n):
            move = correction[i] * per_metre[i]
            y[i] -= move
            v[i] -= known[TO_V] * move
            acc[i] -= known[TO_A] * move
        if k > 1:
            rate = size / before
        if size <= rounding or (rate < 1 and size * rate <= goal * (1 - rate)):
            known[RATE] = min(rate, known[SLOWEST])
            counts[USUAL] = min(counts[USUAL], k)
            if k > 1 and rate > known[FASTEST]:  # otherwise the last iteration just confirmed
                counts[EXCESS] += k - counts[USUAL]
            return True
        left = counts[MAX_ITERATIONS] - k
        # a first correction may be small by luck; later ones must lead to the goal in time
        if rate > 2 or (k > 2 and (rate >= 1 or size * rate ** (left + 1) > goal * (1 - rate))):
            break
        known[BEFORE] = before = size
    known[SIZE] = size
    counts[REASON] = SLOW
    return False


@part
def solve(
    residual: Callable[..., None],
    mass_matrix: Callable[..., None],
    stiffness_and_damping: Callable[..., None],
    own_factor: Callable[..., int],
    own_solve: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    own: Array,
    t: float,
    known: Array,
    counts: IntArray,
    state: Array,
    matrices: Array,
    pivots: IntArray,
) -> bool:
    """One step to ``t``, into Y1, V1, ACC1; False when Newton's method fails even with a fresh matrix."""
    fresh = counts[FACTORED] == 0 or counts[EXCESS] >= counts[REFRESH_COST]
    while True:
        predict(known, state)
        if fresh and not refresh(
            mass_matrix,
            stiffness_and_damping,
            own_factor,
            reals,
            integers,
            scratch,
            own,
            t,
            known,
            counts,
            state,
            matrices,
            pivots,
        ):
            return False
        if iterate(residual, own_solve, reals, integers, scratch, own, t, known, counts, state, matrices, pivots):
            return True
        if fresh:
            return False
        fresh = True


@part
def accept(known: Array, state: Array) -> None:
    """Move on to the end of the step, and foretell the next change of ÿ.

    Extrapolate ÿ where that would have foretold it better; unresolved modes keep ÿ₀.
    """
    for i in range(state.shape[1]):
        acc, acc1 = state[ACC, i], state[ACC1, i]
        state[ALG, i] = known[PULL] * acc + known[KEEP] * state[ALG, i] + known[SHARE] * acc1
        change = acc1 - acc
        state[GUESS, i] = change if abs(change - state[CHANGE, i]) < abs(change) else 0.0
        state[CHANGE, i] = change
        state[Y, i], state[V, i], state[ACC, i] = state[Y1, i], state[V1, i], acc1


@kernel(_ADVANCE, counted=False)
def advance(
    residual: Callable[..., None],
    mass_matrix: Callable[..., None],
    stiffness_and_damping: Callable[..., None],
    own_factor: Callable[..., int],
    own_solve: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    own: Array,
    known: Array,
    counts: IntArray,
    state: Array,
    matrices: Array,
    pivots: IntArray,
    times: Array,
    knots: Array,
) -> int:
    """Steps until ``times`` (k,) and ``knots`` (k, 3, n) are full or the leg ends.

    Returns
    -------
    int
        Number of knots made; -1 - that number when the step after them fails at the smallest size.
    """
    made, n = 0, state.shape[1]
    if counts[AT] == 0:
        set_step(known, counts, known[SPAN] / (counts[TOTAL] // counts[UNIT]))
    while made < len(times) and counts[AT] < counts[TOTAL]:
        target = counts[AT] + (counts[UNIT] >> counts[HALVINGS])
        t = known[END] if target == counts[TOTAL] else known[START] + known[SPAN] * (target / counts[TOTAL])
        if not solve(
            residual,
            mass_matrix,
            stiffness_and_damping,
            own_factor,
            own_solve,
            reals,
            integers,
            scratch,
            own,
            min(t, known[LAST]),
            known,
            counts,
            state,
            matrices,
            pivots,
        ):
            counts[REJECTED] += 1
            counts[HALVINGS] += 1
            counts[SERVED] = 0
            if counts[HALVINGS] > counts[MAX_HALVINGS]:
                known[LAST] = t
                return -1 - made
            change_step(known, counts, state)
            continue
        accept(known, state)
        counts[AT] = target
        counts[SERVED] += 1
        times[made] = t
        for i in range(n):
            knots[made, 0, i], knots[made, 1, i], knots[made, 2, i] = state[Y, i], state[V, i], state[ACC, i]
        made += 1
        halvings = counts[HALVINGS]
        if halvings > 0 and counts[SERVED] >= 4 and target % (counts[UNIT] >> (halvings - 1)) == 0:
            counts[HALVINGS] -= 1
            counts[SERVED] = 0
            change_step(known, counts, state)
    return made
