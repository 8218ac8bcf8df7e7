"""Adaptive steps of Lobatto IIIA collocation over a compiled system; `erls.integrate.lobatto` has the formulas.

``advance`` makes as many steps as there is room for knots, or until the leg ends or fails, and leaves everything that
the next call needs in its arguments: numbers in ``known``, counts in ``counts``, the stages of the present and of the
last step, each (stages + 1, 3, n) with y, v, a at the nodes of a step.
"""

from __future__ import annotations

import math
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import (
    Array,
    Functions,
    IntArray,
    call_residual,
)
from erls.integrate.stepping.stages import (
    BEFORE,
    CALM,
    DAMPING,
    DIAGONAL,
    END,
    EXCESS,
    FACTORED,
    FACTORIZATIONS,
    FASTEST,
    FIRST,
    GOAL,
    GROWTH,
    HISTORY,
    INACCURATE,
    ITERATIONS,
    KEPT,
    LARGEST,
    LAST,
    MAX_ITERATIONS,
    METRES,
    NEXT,
    NODES,
    NOT_FINITE,
    PART_IM,
    PATIENCE,
    RATE,
    REASON,
    REFRESH_COST,
    REJECTED,
    RESIDUALS,
    RHS_CALLS,
    ROUNDING,
    ROWS,
    SAFETY,
    SHRINK,
    SINGULAR,
    SLOW,
    SLOWEST,
    SMALLEST,
    STIFFNESS,
    SUSPECT,
    TOLERANCE,
    USUAL,
    WORTH,
    H,
    T,
    correct,
    evaluate,
    factorize,
    foretell,
    halfway,
    is_diagonal,
    judge,
)
from erls.maths.jit import ENABLED, helper, kernel

_ADVANCE: Any = None
if ENABLED:
    from numba import types as _t

    _CUBE = _t.float64[:, :, ::1]
    _ADVANCE = _t.int64(
        contract.FUNCTIONS,
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
        contract.MATRIX,
        _t.complex128[:, ::1],
        _t.int64[:, ::1],
        contract.COMPLEX,
        contract.REALS,
        contract.INTEGERS,
        _CUBE,
        _CUBE,
        _CUBE,
        _CUBE,
        contract.MATRIX,
        contract.REALS,
        _CUBE,
    )


@helper
def farthest(stages: Array, metres: Array) -> float:
    """Largest position in metres at the start of a step, for its rounding."""
    largest = 0.0
    for q in range(stages.shape[2]):
        largest = max(largest, metres[q] * abs(stages[0, 0, q]))
    return largest


@helper
def choose_step(known: Array) -> None:
    """The next step that ends on, or leaves enough room to, the end of the leg."""
    left = known[END] - known[T]
    h = min(known[NEXT], known[LARGEST])
    if KEPT * known[BEFORE] <= h < WORTH * known[BEFORE]:
        h = known[BEFORE]  # keeps its factors
    known[H] = left if left <= h * (1 + 1e-9) else (left / 2 if left < 2 * h else h)


@helper
def progress(
    known: Array, counts: IntArray, k: int, size: float, before: float, earlier: float, goal: float, rounding: float
) -> int:
    """After iteration ``k``: 1 done, 0 go on, -1 give up (E. Hairer & G. Wanner, Solving ODEs II, sec. IV.8)."""
    if k == 1:
        rate = max(known[RATE], FASTEST) ** 0.8
    elif k == 2:
        rate = size / before
    else:
        rate = math.sqrt(size / earlier)
    if size <= rounding or (rate < 1 and size * rate <= goal * (1 - rate)):
        known[RATE] = min(rate, SLOWEST)
        counts[USUAL] = min(counts[USUAL], k)
        if k > 1 and rate > FASTEST:  # otherwise the last iteration just confirmed
            counts[EXCESS] += k - counts[USUAL]
        return 1
    left = counts[MAX_ITERATIONS] - k
    # a correction may grow once, where coordinates follow one another; over two iterations they must lead to the goal
    slow = k > 2 and (rate >= 1 or size * rate**left > goal)
    return -1 if slow or left == 0 else 0


@helper
def find_suspect(values: Array, nothing: int) -> int:
    """Number of the first entry that is not finite, or ``nothing``."""
    for q in range(len(values)):
        if not math.isfinite(values[q]):
            return q
    return nothing


@helper
def largest_entry(values: Array, metres: Array) -> int:
    """Number of the entry that is largest in metres."""
    found, largest = 0, -1.0
    for q in range(len(values)):
        if metres[q] * abs(values[q]) > largest:
            found, largest = q, metres[q] * abs(values[q])
    return found


@helper
def accept(
    known: Array, counts: IntArray, nodes: Array, stages: Array, last: Array, times: Array, knots: Array, made: int
) -> int:
    """Store the knots of a step and move on to its end; how many knots there are now."""
    m = stages.shape[0] - 1
    t, h = known[T], known[H]
    end = known[END] if h >= known[END] - t else t + h
    for i in range(1, m + 1):
        times[made] = end if i == m else t + h * nodes[i]
        for kind in range(3):
            for q in range(stages.shape[2]):
                knots[made, kind, q] = stages[i, kind, q]
        made += 1
    for kind in range(3):
        for q in range(stages.shape[2]):
            for i in range(m + 1):
                last[i, kind, q] = stages[i, kind, q]
            stages[0, kind, q] = last[m, kind, q]
    known[T], known[BEFORE] = end, h
    counts[HISTORY] = 1
    return made


@helper
def retry(known: Array, counts: IntArray, reason: int, share: float) -> bool:
    """Try a smaller step; False when it would be too small."""
    counts[REASON] = reason
    counts[REJECTED] += 1
    counts[CALM] = 0
    known[NEXT] = known[H] * share
    known[RATE] = SLOWEST
    return bool(known[NEXT] >= known[SMALLEST])


@kernel(_ADVANCE, counted=False)
def advance(
    system: Functions,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    own: Array,
    own_complex: Any,
    pivots: IntArray,
    mixed: Any,
    known: Array,
    counts: IntArray,
    coefficients: Array,
    stages: Array,
    last: Array,
    matrices: Array,
    vectors: Array,
    times: Array,
    knots: Array,
) -> int:
    """Steps until ``times`` (k,) and ``knots`` (k, 3, n) are full or the leg ends.

    Returns
    -------
    int
        Number of knots made; -1 - that number when no step is small enough to go on.
    """
    made, m, nodes = 0, stages.shape[0] - 1, coefficients[ROWS, NODES]
    way = system.solve, system.solve_complex, reals, integers, own, own_complex, pivots, mixed
    factored = known[BEFORE] if counts[FACTORED] else 0.0  # the step of the present factors
    while made + m <= len(times) and known[T] < known[END]:
        choose_step(known)
        t, h = known[T], known[H]
        fresh = factored != h or counts[EXCESS] >= counts[REFRESH_COST]
        status = verdict = 0
        while True:
            if fresh:
                at = min(max(t + h / 2, known[FIRST]), known[LAST])
                halfway(h, stages)
                y, v, stiffness, damping = stages[1, 0], stages[0, 1], matrices[STIFFNESS], matrices[DAMPING]
                evaluate(system, reals, integers, scratch, at, y, v, matrices)
                status = factorize(
                    system,
                    reals,
                    integers,
                    scratch,
                    at,
                    y,
                    v,
                    h,
                    coefficients,
                    matrices,
                    own,
                    own_complex,
                    pivots,
                )
                diagonal = is_diagonal(stiffness) and is_diagonal(damping)
                counts[DIAGONAL] = 1 if diagonal else 0
                counts[FACTORIZATIONS] += 1
                known[RATE], counts[USUAL], counts[EXCESS] = SLOWEST, counts[MAX_ITERATIONS], 0
                factored = h
                if status != 0:
                    counts[SUSPECT] = status - 1
                    break
            foretell(known, counts, coefficients, stages, last, matrices, vectors, way)
            rounding = known[ROUNDING] * farthest(stages, vectors[METRES])
            goal, before, earlier, verdict = known[GOAL] + rounding, 0.0, 0.0, 0
            for k in range(1, counts[MAX_ITERATIONS] + 1):
                for i in range(1, m + 1):
                    at = min(max(t + h * nodes[i], known[FIRST]), known[LAST])
                    y, v, a = stages[i, 0], stages[i, 1], stages[i, 2]
                    out = vectors[RESIDUALS + i - 1]
                    call_residual(system.residual, reals, integers, scratch, at, y, v, a, out)
                    counts[RHS_CALLS] += 1
                counts[ITERATIONS] += 1
                size = correct(h, coefficients, stages, matrices, vectors, way)
                if not math.isfinite(size):
                    verdict = -2
                    break
                verdict = progress(known, counts, k, size, before, earlier, goal, rounding)
                if verdict != 0:
                    break
                before, earlier = size, before
            if verdict == 1 or fresh:
                break
            fresh = True
        if status != 0:
            going = retry(known, counts, SINGULAR, 0.25)
        elif verdict == -2:
            counts[SUSPECT] = -1
            for i in range(m):
                counts[SUSPECT] = find_suspect(vectors[RESIDUALS + i], counts[SUSPECT])
            going = retry(known, counts, NOT_FINITE, 0.25)
        elif verdict != 1:
            counts[SUSPECT] = largest_entry(vectors[RESIDUALS + m], vectors[METRES])
            going = retry(known, counts, SLOW, 0.5)
        else:
            error = judge(h, coefficients, stages, matrices, vectors, way) / known[TOLERANCE]
            scale = min(GROWTH, max(SHRINK, SAFETY * max(error, 1e-12) ** (-1.0 / (m + 2))))
            if error > 1.0:
                counts[SUSPECT] = largest_entry(vectors[PART_IM], vectors[METRES])
                going = retry(known, counts, INACCURATE, min(scale, 0.8))
            else:
                counts[CALM] += 1
                known[NEXT] = h * (scale if counts[CALM] > PATIENCE else min(scale, 1.0))
                made = accept(known, counts, nodes, stages, last, times, knots, made)
                going = True
        if not going:
            return -1 - made
        counts[FACTORED] = 1 if factored == known[BEFORE] else 0
    return made
