"""Adaptive steps of Lobatto IIIA collocation over a compiled system; `erls.integrators.lobatto` has the formulas.

``advance`` makes as many steps as there is room for knots, or until the leg ends or fails, and leaves everything that
the next call needs in its arguments: numbers in ``known``, counts in ``counts``, the stages of the present and of the
last step, each (stages + 1, 3, n) with y, v, a at the nodes of a step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from erls.kernels import contract
from erls.kernels.contract import Array, IntArray
from erls.kernels.jit import ENABLED, helper, kernel
from erls.kernels.stepping.dense import add_product, factor_complex, factor_real, solve_complex, solve_real

# known: the leg, settings of a run, then what steps leave behind
START, END, FIRST, LAST = 0, 1, 2, 3
LARGEST, SMALLEST, TOLERANCE, GOAL, ROUNDING = 4, 5, 6, 7, 8
T, H, BEFORE, RATE, ERROR, SIZE, NEXT = range(9, 16)  # BEFORE: the last step; NEXT: the one to try
KNOWN = 16
# counts
FACTORED, USUAL, EXCESS, REASON, HISTORY, SUSPECT, DIAGONAL = range(7)  # DIAGONAL: stiffness and damping
MAX_ITERATIONS, REFRESH_COST = 7, 8
RHS_CALLS, ITERATIONS, FACTORIZATIONS, REJECTED, CALM = range(9, 14)  # CALM: steps since one was rejected
COUNTS = 14
SINGULAR, NOT_FINITE, SLOW, INACCURATE = 1, 2, 3, 4  # reasons
# blocks of coefficients (4, 4), of `erls.integrators.lobatto`; the last one has the rows below it
RATES, PLACES, INTO_RE, INTO_IM, BACK_RE, BACK_IM, FORETELL, ROWS = range(8)
NODES, DIFFERENCE, LAMBDA_RE, LAMBDA_IM = range(4)
# blocks of matrices (n, n), transposed
MASS, DAMPING, STIFFNESS, FILTER, SOLVERS = range(5)
# rows of vectors (n,); the residuals of the stages are followed by the changes of their accelerations
METRES, PART_RE, PART_IM, RESIDUALS = range(4)

SLOWEST, FASTEST = 0.9, 1e-3  # bounds on a convergence rate carried over from earlier steps
GROWTH, SHRINK, SAFETY = 2.0, 0.2, 0.9  # of steps
PATIENCE = 8  # steps without growth after one that was rejected
KEPT, WORTH = 0.95, 1.2  # bounds on a change of the step that is not worth new factors

_ADVANCE: Any = None
if ENABLED:
    from numba import types as _t

    _CUBE = _t.float64[:, :, ::1]
    _ADVANCE = _t.int64(
        contract.pointer(contract.RESIDUAL),
        contract.pointer(contract.MASS_MATRIX),
        contract.pointer(contract.STIFFNESS_AND_DAMPING),
        contract.REALS,
        contract.INTEGERS,
        contract.REALS,
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
def foretell(
    known: Array, counts: IntArray, coefficients: Array, stages: Array, last: Array, matrices: Array, vectors: Array
) -> None:
    """Stages from the polynomial through the last ones, made to fulfil the linear part of the equations.

    What is extrapolated is M a + C v + K y: smooth also where vibrations are not resolved.
    """
    m, n = stages.shape[0] - 1, stages.shape[2]
    nodes, basis = coefficients[ROWS, NODES], coefficients[FORETELL]
    h = known[H]
    for i in range(1, m + 1):
        x = 1.0 + nodes[i] * h / known[BEFORE]
        for j in range(m + 1):
            weight = 1.0
            for k in range(m + 1):
                if k != j:
                    weight *= (x - nodes[k]) / (nodes[j] - nodes[k])
            basis[i, j] = weight if counts[HISTORY] else (1.0 if j == m else 0.0)
    for i in range(1, m + 1):
        for q in range(n):
            stages[i, 2, q] = stages[0, 2, q]
    combine(h, coefficients, stages)
    difference = vectors[PART_RE]
    for i in range(1, m + 1):
        out = vectors[RESIDUALS + i - 1]
        out[:] = 0.0
        for part in range(3):
            difference[:] = stages[i, 2 - part]
            for j in range(m + 1):
                weight, before = basis[i, j], last[j, 2 - part]
                for q in range(n):
                    difference[q] -= weight * before[q]
            if part > 0 and counts[DIAGONAL]:
                matrix = matrices[part]
                for q in range(n):
                    out[q] += matrix[q, q] * difference[q]
            else:
                add_product(matrices[part], difference, out)
    correct(h, coefficients, stages, matrices, vectors)


@helper
def combine(h: float, coefficients: Array, stages: Array) -> None:
    """Positions and velocities of the stages from their accelerations."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    nodes, rates, places = coefficients[ROWS, NODES], coefficients[RATES], coefficients[PLACES]
    y, v = stages[0, 0], stages[0, 1]
    for i in range(1, m + 1):
        step = h * nodes[i]
        y_out, v_out = stages[i, 0], stages[i, 1]
        for q in range(n):
            y_out[q], v_out[q] = y[q] + step * v[q], v[q]
        for j in range(m + 1):
            to_y, to_v, a = h * h * places[i, j], h * rates[i, j], stages[j, 2]
            for q in range(n):
                y_out[q] += to_y * a[q]
                v_out[q] += to_v * a[q]


@helper
def correct(h: float, coefficients: Array, stages: Array, matrices: Array, vectors: Array) -> float:
    """One iteration from the residuals of the stages; the largest change of a position, and of h v [metres]."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    re, im = vectors[PART_RE], vectors[PART_IM]
    into_re, into_im = coefficients[INTO_RE], coefficients[INTO_IM]
    back_re, back_im = coefficients[BACK_RE], coefficients[BACK_IM]
    changes = vectors[RESIDUALS + m :]
    changes[:m] = 0.0
    for k in range((matrices.shape[0] - SOLVERS) // 2):
        re[:] = 0.0
        im[:] = 0.0
        for j in range(m):
            p, q, out = into_re[k, j], into_im[k, j], vectors[RESIDUALS + j]
            for i in range(n):
                re[i] += p * out[i]
                im[i] += q * out[i]
        if coefficients[ROWS, LAMBDA_IM, k] == 0.0:
            solve_real(matrices[SOLVERS + 2 * k], re)
        else:
            solve_complex(matrices[SOLVERS + 2 * k], matrices[SOLVERS + 2 * k + 1], re, im)
        for j in range(m):
            p, q, change = back_re[j, k], back_im[j, k], changes[j]
            for i in range(n):
                change[i] -= p * re[i] - q * im[i]
    rates, places, metres = coefficients[RATES], coefficients[PLACES], vectors[METRES]
    largest = 0.0
    for i in range(1, m + 1):
        re[:] = 0.0
        im[:] = 0.0
        for j in range(1, m + 1):
            to_y, to_v, change = h * h * places[i, j], h * rates[i, j], changes[j - 1]
            for q in range(n):
                re[q] += to_y * change[q]
                im[q] += to_v * change[q]
        y, v, a, change = stages[i, 0], stages[i, 1], stages[i, 2], changes[i - 1]
        total = 0.0
        for q in range(n):
            y[q] += re[q]
            v[q] += im[q]
            a[q] += change[q]
            largest = max(largest, metres[q] * max(abs(re[q]), h * abs(im[q])))
            total += re[q] + im[q] + change[q]
        if not math.isfinite(total):
            return math.inf
    return largest


@helper
def factor(h: float, coefficients: Array, matrices: Array) -> int:
    """Factors for steps of ``h``; 0, or 1 + the coordinate at which elimination broke down."""
    n = matrices.shape[1]
    mass, damping, stiffness, real = matrices[MASS], matrices[DAMPING], matrices[STIFFNESS], matrices[FILTER]
    for i in range(n):
        for j in range(n):
            real[i, j] = mass[i, j] + h * damping[i, j] + h * h * stiffness[i, j]
    status = factor_real(real)
    for k in range((matrices.shape[0] - SOLVERS) // 2):
        p, q = h * coefficients[ROWS, LAMBDA_RE, k], h * coefficients[ROWS, LAMBDA_IM, k]
        pp, qq = p * p - q * q, 2 * p * q
        re, im = matrices[SOLVERS + 2 * k], matrices[SOLVERS + 2 * k + 1]
        for i in range(n):
            for j in range(n):
                re[i, j] = mass[i, j] + p * damping[i, j] + pp * stiffness[i, j]
                im[i, j] = q * damping[i, j] + qq * stiffness[i, j]
        status = max(status, factor_real(re) if q == 0.0 else factor_complex(re, im))
    return status


@helper
def is_diagonal(matrix: Array) -> bool:
    """Whether all entries off the diagonal are zero."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            if matrix[i, j] != 0.0 or matrix[j, i] != 0.0:
                return False
    return True


@helper
def halfway(h: float, stages: Array) -> None:
    """Place half a step ahead, into the first stage."""
    for q in range(stages.shape[2]):
        stages[1, 0, q] = stages[0, 0, q] + h / 2 * stages[0, 1, q]


@helper
def transpose(matrix: Array) -> None:
    """In place."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j], matrix[j, i] = matrix[j, i], matrix[i, j]


@helper
def judge(h: float, coefficients: Array, stages: Array, matrices: Array, vectors: Array) -> float:
    """Estimated error of a step [metres]: (M + h C + h² K)⁻¹ M h² times the highest difference of the accelerations."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    weights, metres = coefficients[ROWS, DIFFERENCE], vectors[METRES]
    difference, error = vectors[PART_RE], vectors[PART_IM]
    for q in range(n):
        total = 0.0
        for j in range(m + 1):
            total += weights[j] * stages[j, 2, q]
        difference[q] = h * h * total
        error[q] = 0.0
    add_product(matrices[MASS], difference, error)
    solve_real(matrices[FILTER], error)
    largest = 0.0
    for q in range(n):
        largest = max(largest, metres[q] * abs(error[q]))
    return largest


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
        knots[made] = stages[i]
        made += 1
    last[:] = stages
    stages[0] = last[m]
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


@kernel(_ADVANCE)
def advance(
    residual: Callable[..., None],
    mass_matrix: Callable[..., None],
    stiffness_and_damping: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
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
                mass_matrix(reals, integers, scratch, at, stages[1, 0], matrices[MASS])
                stiffness_and_damping(
                    reals, integers, scratch, at, stages[1, 0], stages[0, 1], matrices[STIFFNESS], matrices[DAMPING]
                )
                transpose(matrices[MASS])
                transpose(matrices[STIFFNESS])
                transpose(matrices[DAMPING])
                diagonal = is_diagonal(matrices[STIFFNESS]) and is_diagonal(matrices[DAMPING])
                counts[DIAGONAL] = 1 if diagonal else 0
                status = factor(h, coefficients, matrices)
                counts[FACTORIZATIONS] += 1
                known[RATE], counts[USUAL], counts[EXCESS] = SLOWEST, counts[MAX_ITERATIONS], 0
                factored = h
                if status != 0:
                    counts[SUSPECT] = status - 1
                    break
            foretell(known, counts, coefficients, stages, last, matrices, vectors)
            rounding = known[ROUNDING] * farthest(stages, vectors[METRES])
            goal, before, earlier, verdict = known[GOAL] + rounding, 0.0, 0.0, 0
            for k in range(1, counts[MAX_ITERATIONS] + 1):
                for i in range(1, m + 1):
                    at = min(max(t + h * nodes[i], known[FIRST]), known[LAST])
                    y, v, a = stages[i, 0], stages[i, 1], stages[i, 2]
                    residual(reals, integers, scratch, at, y, v, a, vectors[RESIDUALS + i - 1])
                    counts[RHS_CALLS] += 1
                counts[ITERATIONS] += 1
                size = correct(h, coefficients, stages, matrices, vectors)
                if not math.isfinite(size):
                    verdict = -2
                    break
                known[SIZE] = size
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
            error = judge(h, coefficients, stages, matrices, vectors) / known[TOLERANCE]
            scale = min(GROWTH, max(SHRINK, SAFETY * max(error, 1e-12) ** (-1.0 / (m + 2))))
            if error > 1.0:
                counts[SUSPECT] = largest_entry(vectors[PART_IM], vectors[METRES])
                known[ERROR] = error
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
