"""Steps of the error equation along a computed motion (`erls.integrate.global_error` has the formulas).

Numbers lie in ``known``; ``stages`` and ``motion`` (stages + 1, 3, n) hold e, ė, ë and P, Ṗ, P̈ at the nodes of a step;
``coefficients``, ``matrices``, ``vectors`` and the factors are those of `erls.integrate.stepping.stages`. Beside the
factors for its eigenvalues ``own_complex`` holds those of the low-pass filter.
"""

from __future__ import annotations

import math
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, Functions, IntArray, call_factor_complex, call_residual
from erls.integrate.stepping.low_pass import TURN_IM, TURN_RE, factor_filter, smooth
from erls.integrate.stepping.newton_form import differences, interpolate
from erls.integrate.stepping.stages import (
    DAMPING,
    MASS,
    METRES,
    NODES,
    PLACES,
    RESIDUALS,
    ROWS,
    STIFFNESS,
    combine,
    correct,
    evaluate,
    factorize,
    pairs,
)
from erls.maths import dense
from erls.maths.jit import ENABLED, guide, helper, kernel

# known: times between which forces may be asked for, where iterations stop, the largest error so far, what the filter
# keeps (steps over τ), what is too far, and how much of a change the next iteration leaves
FIRST, LAST, SHARE, LARGEST, CUT, BOUND, RATE = range(7)
KNOWN = 7
# counts: evaluations of residuals, steps of the run in one of the error, ends of steps through which the motion is
# interpolated
EVALUATIONS, MERGED, ENDS = range(3)
COUNTS = 3
CONDITIONS = 12  # of interpolation, at the most: rows of a table
MOST_ITERATIONS = 12
FASTEST, SLOWEST = 1e-3, 0.5  # bounds on what an iteration leaves
NEAR = 0.3  # of the error so far: what the last of many iterations may change in a step of the run
FORGOTTEN = 0.7  # of that, from one step to the next

_FOLLOW: Any = None
if ENABLED:
    from numba import types as _t

    _CUBE = _t.float64[:, :, ::1]
    _FOLLOW = _t.int64(
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
        contract.MATRIX,
        contract.REALS,
        _CUBE,
        contract.INTEGERS,
        _CUBE,
    )


@helper
def linear_part(matrices: Array, states: Array, out: Array) -> None:
    """Add M ë + C ė + K e to ``out``."""
    dense.add_product(matrices[MASS], states[2], out)
    dense.add_product(matrices[DAMPING], states[1], out)
    dense.add_product(matrices[STIFFNESS], states[0], out)


@helper
def extent(stages: Array, metres: Array) -> float:
    """Largest error of a position at the nodes [m]; infinite where it is not finite."""
    largest, total = 0.0, 0.0
    for i in range(1, stages.shape[0]):
        for q in range(stages.shape[2]):
            largest = max(largest, metres[q] * abs(stages[i, 0, q]))
            total += stages[i, 0, q]
    return largest if math.isfinite(total) else math.inf


@helper
def moved(h: float, coefficients: Array, changes: Array, metres: Array) -> float:
    """Largest change of a position [m] from changes (m, n) of the accelerations at the nodes: rates of what the steps
    do not resolve say nothing.
    """
    m, largest = changes.shape[0], 0.0
    for i in range(1, m + 1):
        for q in range(changes.shape[1]):
            total = 0.0
            for j in range(1, m + 1):
                total += coefficients[PLACES, i, j] * changes[j - 1, q]
            largest = max(largest, h * h * metres[q] * abs(total))
    return largest


@helper
def foretell(h: float, coefficients: Array, stages: Array, matrices: Array, vectors: Array, way: Any) -> None:
    """Stages from ë and M ë + C ė + K e as at the start of the step."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    start = vectors[RESIDUALS + 2 * m]
    for q in range(n):
        start[q] = 0.0
        for i in range(1, m + 1):
            stages[i, 2, q] = stages[0, 2, q]
    linear_part(matrices, stages[0], start)
    combine(h, coefficients, stages)
    for i in range(1, m + 1):
        out = vectors[RESIDUALS + i - 1]
        for q in range(n):
            out[q] = -start[q]
        linear_part(matrices, stages[i], out)
    correct(h, coefficients, stages, matrices, vectors, way)


@guide
def settle(
    system: Functions,
    scratch: Array,
    begin: float,
    h: float,
    known: Array,
    counts: IntArray,
    coefficients: Array,
    stages: Array,
    motion: Array,
    matrices: Array,
    vectors: Array,
    way: Any,
    loose: bool,
) -> bool:
    """Iterate on the stages of a step; whether they settle, or ``loose``, come near to it.

    What the filter holds back of the first residuals stays out of balance.
    """
    m, n = stages.shape[0] - 1, stages.shape[2]
    reals, integers = way[2], way[3]
    before, rate, largest = math.inf, known[RATE], known[LARGEST]
    for k in range(MOST_ITERATIONS):
        for i in range(1, m + 1):
            time = min(max(begin + h * coefficients[ROWS, NODES, i], known[FIRST]), known[LAST])
            y, v, a = motion[0, 0], motion[0, 1], motion[0, 2]
            for q in range(n):
                y[q] = motion[i, 0, q] + stages[i, 0, q]
                v[q] = motion[i, 1, q] + stages[i, 1, q]
                a[q] = motion[i, 2, q] + stages[i, 2, q]
            out, held = vectors[RESIDUALS + i - 1], vectors[RESIDUALS + 2 * m + i]
            call_residual(system.residual, reals, integers, scratch, time, y, v, a, out)
            counts[EVALUATIONS] += 1
            if k == 0:
                for q in range(n):
                    held[q] = out[q]
                smooth(out, matrices, vectors, way, pairs(m))
                for q in range(n):
                    held[q] -= out[q]
            else:
                for q in range(n):
                    out[q] -= held[q]
        limit = correct(h, coefficients, stages, matrices, vectors, way)
        size = moved(h, coefficients, vectors[RESIDUALS + m : RESIDUALS + 2 * m], vectors[METRES])
        far = extent(stages, vectors[METRES])
        if not (math.isfinite(limit) and size < known[BOUND] and far < known[BOUND]):
            before = math.inf
            break
        if k > 0:
            rate = max(size / before, FASTEST) if before > 0.0 else FASTEST
        if k > 1 and rate >= 1.0 and size > largest:
            before = math.inf
            break
        known[LARGEST] = max(largest, far)
        if size * rate <= known[SHARE] * known[LARGEST] * max(1.0 - rate, FASTEST):
            if k > 0:  # one step may settle quickly by chance
                known[RATE] = min(max(rate, FORGOTTEN * known[RATE]), SLOWEST)
            return True
        before = size
    if loose and before <= NEAR * known[LARGEST]:
        return True
    known[LARGEST] = largest
    return False


@kernel(_FOLLOW, counted=False)
def follow(
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
    motion: Array,
    matrices: Array,
    vectors: Array,
    table: Array,
    t: Array,
    knots: Array,
    ends: IntArray,
    found: Array,
) -> int:
    """The error at some of the ends of steps of a leg.

    Parameters
    ----------
    t : (k,) array
        Ends of the steps of the leg.
    knots : (k, 3, n) array
        y, v, a there.
    ends : (k,) array
        Gets the numbers of those that bound the steps of the error, from the second on.
    found : (k, 2, n) array
        Gets e and ė there, from the second on; ``stages`` holds those at the first.

    Returns
    -------
    int
        Number of steps made; -1 - that number where the next one cannot be followed.
    """
    n, last, made, merged = stages.shape[2], len(t) - 1, 0, counts[MERGED]
    way = system.solve, system.solve_complex, reals, integers, own, own_complex, pivots, mixed
    group = min(counts[ENDS], last + 1)
    given = max(1, min(3, CONDITIONS // group))
    tabled = -1
    while ends[made] < last:
        begin = ends[made]
        left = last - begin
        end = last if left <= merged + merged // 2 else begin + merged
        h, middle = t[end] - t[begin], (begin + end) // 2
        y, v = motion[0, 0], motion[0, 1]
        for q in range(n):
            y[q], v[q] = knots[middle, 0, q], knots[middle, 1, q]
            if middle == begin:
                y[q] += h / 2 * v[q] + h * h / 8 * knots[middle, 2, q]
                v[q] += h / 2 * knots[middle, 2, q]
        at = t[middle] if middle > begin else t[begin] + h / 2
        at = min(max(at, known[FIRST]), known[LAST])
        evaluate(system, reals, integers, scratch, at, y, v, matrices)
        status = factorize(
            system, reals, integers, scratch, at, y, v, h, coefficients, matrices, own, own_complex, pivots
        )
        square = (TURN_RE + 1j * TURN_IM) * (h / known[CUT]) ** 2
        filtered = pairs(stages.shape[0] - 1)
        if status == 0 and pivots.shape[1] > 0:
            status = factor_filter(matrices, square, own_complex[filtered].reshape(n, n), pivots[filtered + 1])
        elif status == 0:
            status = call_factor_complex(
                system.factor_complex, reals, integers, scratch, at, y, v, 0j, square, own_complex[filtered]
            )
        if status != 0:
            break
        foretell(h, coefficients, stages, matrices, vectors, way)
        for i in range(1, stages.shape[0]):
            time = t[begin] + h * coefficients[ROWS, NODES, i]
            here = begin
            while here < last and t[here + 1] <= time:
                here += 1
            first = max(min(here - group // 2 + 1, last + 1 - group), 0)
            if first != tabled:
                differences(t, knots, first, group, given, table)
                tabled = first
            interpolate(t, first, group, given, table, time, motion[i])
        one = end == begin + 1
        if settle(
            system, scratch, t[begin], h, known, counts, coefficients, stages, motion, matrices, vectors, way, one
        ):
            made += 1
            ends[made] = end
            for kind in range(3):
                for q in range(n):
                    stages[0, kind, q] = stages[-1, kind, q]
                    if kind < 2:
                        found[made, kind, q] = stages[-1, kind, q]
            merged = min(2 * merged, counts[MERGED])
        elif not one:
            merged = max((end - begin) // 2, 1)
            known[RATE] = SLOWEST
        else:
            break
    return made if ends[made] == last else -1 - made
