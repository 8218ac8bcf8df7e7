"""The steps of generalized-α, of all systems: `erls.integrate.generalized_alpha` has the formulas.

A system gives them the functions of `erls.equations.stepped`. ``advance`` makes steps to given times
and leaves everything that the next call needs in `Course` and `Memory`. Multipliers λ follow the accelerations in one
array, conditions follow the equations of motion, and corrections solve

    [[M + α C + β K, Bᵀ], [B, 0]] [Δd; β Δλ] = [β r; Φ],   β = 1/β', α = γ'/β'

which stays well conditioned as the step tends to zero. Where a system has no factors of its own, dense ones are made.
"""

from __future__ import annotations

import math
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import (
    Array,
    IntArray,
    call_factor,
    call_mass_matrix,
    call_residual,
    call_solve,
    call_stiffness_and_damping,
)
from erls.equations.stepped import STEP_FUNCTIONS, StepFunctions, call_compose, call_settle
from erls.integrate.stepping.alpha_memory import (
    AUTO,
    BEFORE,
    DONE,
    ERROR,
    EVALUATIONS,
    EXTRAPOLATED,
    FACTORED,
    FACTORIZATIONS,
    FAILED,
    FROZEN,
    GOAL,
    INACCURATE,
    ITERATIONS,
    NOT_FINITE,
    RATE,
    REASON,
    REFUSED,
    SINGULAR,
    SIZE,
    SLOW,
    SPENT,
    STEPS,
    TIMID,
    UPDATE,
    USUAL,
    ZERO,
    Course,
    Memory,
    Settings,
    read_course,
    read_memory,
    read_settings,
)
from erls.maths import dense
from erls.maths.jit import ENABLED, kernel, part

_ADVANCE: Any = None
if ENABLED:
    from numba import types as _t

    _reals, _integers = contract.REALS, contract.INTEGERS
    _ADVANCE = _t.int64(
        STEP_FUNCTIONS,
        _reals,
        _integers,
        _reals,
        _reals,
        _integers,
        _reals,
        _reals,
        _reals,
        contract.MATRIX,
        _t.float64[:, :, ::1],
        contract.MATRIX,
    )

ONE_DIGIT = 1 / 16  # of the rounding of `Settings`, which is that of sixteen


@part
def predict(settings: Settings, memory: Memory) -> None:
    """Increment, velocity and acceleration of a step from what its acceleration is expected to be."""
    h, beta, gamma = settings.h, settings.beta, settings.gamma
    y_old, y_new = h * h * (0.5 - beta), h * h * beta
    v_old, v_new = h * (1 - gamma), h * gamma
    v, algorithmic, a, a1, guess = memory.v, memory.alg, memory.a, memory.a1, memory.guess
    increment, v1, n = memory.increment, memory.v1, len(v)
    share, pull, keep, kind = settings.share, settings.pull, settings.keep, settings.guess
    for i in range(len(a1)):
        a1[i] = 0.0 if kind == ZERO else a[i]
        if kind == EXTRAPOLATED and i < n:
            a1[i] += guess[i]
    for i in range(n):
        alg = algorithmic[i]
        alg1 = pull * a[i] + keep * alg + share * a1[i]
        increment[i] = h * v[i] + y_old * alg + y_new * alg1
        v1[i] = v[i] + v_old * alg + v_new * alg1


@part
def dense_factors(
    system: StepFunctions,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    y: Array,
    alpha: float,
    beta: float,
    memory: Memory,
) -> int:
    """Factors of M + α C + β K, scaled to metres; 0, or 1 + the number of a coordinate."""
    n, per = len(memory.v), memory.per_metre
    mass, stiffness, damping = memory.matrices[0], memory.matrices[1], memory.matrices[2]
    v = memory.v1
    call_stiffness_and_damping(system.stiffness_and_damping, reals, integers, scratch, t, y, v, stiffness, damping)
    call_mass_matrix(system.mass_matrix, reals, integers, scratch, t, y, mass)
    factors = memory.factors.reshape(n, n)
    for i in range(n):
        for j in range(n):
            factors[j, i] = per[i] * (mass[i, j] + alpha * damping[i, j] + beta * stiffness[i, j]) * per[j]
    return int(dense.factor(factors, memory.pivots))


@part
def correct(system: StepFunctions, reals: Array, integers: IntArray, settings: Settings, memory: Memory) -> float:
    """Solve for a correction, apply it, and return its size [m]; infinite where a square of it is."""
    n, beta = len(memory.v), 1 / settings.to_a
    right, correction, per = memory.right, memory.correction, memory.per_metre
    for i in range(n):
        correction[i] = beta * right[i]
    for k in range(n, len(correction)):
        correction[k] = right[k]
    if len(memory.pivots) > 0:
        for i in range(n):
            correction[i] *= per[i]
        dense.solve(memory.factors.reshape(n, n), memory.pivots, correction)
        for i in range(n):
            correction[i] *= per[i]
    else:
        call_solve(system.solve, reals, integers, memory.factors, correction)
    size, total = 0.0, 0.0
    for i in range(n):
        size = max(size, abs(memory.metres[i] * correction[i]))
        total += correction[i]
    for k in range(n, len(correction)):
        size = max(size, abs(memory.factors[k - n] * correction[k]))
        total += correction[k]
    # forces square what they are given: a size whose square overflows is as good as infinite
    if not math.isfinite(size * size + total * total):
        return math.inf
    to_a, to_v, a1, v1, increment, metres = (
        settings.to_a, settings.to_v, memory.a1, memory.v1, memory.increment, memory.metres
    )  # fmt: skip
    for i in range(len(correction)):
        move = correction[i]
        a1[i] -= to_a * move
        if i < n:
            increment[i] -= move
            v1[i] -= to_v * move
            correction[i] = metres[i] * move
        else:
            correction[i] = memory.factors[i - n] * move
    return size


@part
def blame(memory: Memory) -> None:
    """Into the correction, what is not finite: the residual, or where it is, the correction itself."""
    finite, n = True, len(memory.v)
    for i in range(len(memory.correction)):
        finite = finite and math.isfinite(memory.right[i])
    for i in range(len(memory.correction)):
        x = memory.correction[i] * (memory.metres[i] if i < n else memory.factors[i - n])
        memory.correction[i] = x * abs(x) if finite else memory.right[i]


@part
def is_balanced(settings: Settings, memory: Memory, largest: float) -> bool:
    """Whether forces balance against the size of their terms, and the conditions hold."""
    n, m, both, gap = len(memory.v), len(memory.a) - len(memory.v), 0.0, 0.0
    for i in range(n):
        force = memory.right[i] * memory.per_metre[i]
        both += force * force
    if not math.sqrt(both) <= settings.balance * (largest + memory.right[n + m + 1]):
        return False
    for i in range(m):
        gap = max(gap, abs(memory.right[n + i]) * memory.factors[m + i])
    return gap <= settings.balance * settings.reach


@part
def note(settings: Settings, progress: Course, iterations: int, rate: float) -> None:
    """How fast iteration was."""
    rates, counts = progress.rates, progress.counts
    rates[RATE] = min(rate, settings.slowest)
    counts[USUAL] = min(counts[USUAL], iterations)
    beyond = iterations - max(counts[USUAL], settings.fewest) - settings.tolerated
    if iterations == 1 or rate <= settings.fastest:  # the last iteration just confirmed
        beyond = min(beyond, 0.0)
    rates[SPENT] = max(0.0, rates[SPENT] + beyond)


@part
def judge(settings: Settings, progress: Course, memory: Memory) -> int:
    """Whether the local error of a step is too large, or so small that a larger step would do."""
    if settings.error_limit == 0.0:
        return DONE
    error = 0.0
    for i in range(len(memory.v)):
        error = max(error, memory.metres[i] * abs(memory.a1[i] - memory.a[i]))
    error *= settings.error_factor
    progress.rates[ERROR] = error
    if error > settings.error_limit:
        return INACCURATE
    return TIMID if settings.growth > 0.0 and error * settings.growth**3 < settings.error_limit else DONE


@part
def accept(settings: Settings, memory: Memory, start: Array, tried: Array) -> None:
    """Move on to the end of the step, and foretell the next change of the acceleration.

    It is extrapolated where that would have foretold it better; unresolved modes keep what they have.
    """
    share, pull, keep = settings.share, settings.pull, settings.keep
    for i in range(len(memory.v)):
        a, a1 = memory.a[i], memory.a1[i]
        memory.alg[i] = pull * a + keep * memory.alg[i] + share * a1
        change = a1 - a
        memory.guess[i] = change if abs(change - memory.change[i]) < abs(change) else 0.0
        memory.change[i] = change
        memory.v[i] = memory.v1[i]
    for i in range(len(memory.a)):
        memory.a[i] = memory.a1[i]
    for i in range(len(start)):
        start[i] = tried[i]


@kernel(_ADVANCE, counted=False)
def advance(
    system: StepFunctions,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    own: Array,
    places: IntArray,
    start: Array,
    tried: Array,
    times: Array,
    samples: Array,
    knots: Array,
    beside: Array,
) -> int:
    """Steps to ``times`` (k,), with a row of ``samples`` each at the head of ``scratch``; ``own`` and ``places`` hold
    `Settings`, `Course` and `Memory`, ``start`` the configuration, ``tried`` (c,) that of the step that is tried.

    What the system keeps of each goes into ``knots`` (k, 3, s), accelerations and multipliers into ``beside`` unless it
    has no columns. Iterations have converged when the remaining error, rate/(1 − rate) |Δ|, is estimated within
    tolerance, with the rate of earlier steps at first (E. Hairer & G. Wanner, Solving ODEs II, sec. IV.8), which counts
    for less the older it gets; or when the residual is small against its terms. Where rounding is what the tolerance
    allows, one more iteration brings the error to the last digit: what is left has a sign, and adds up over many steps.
    """
    use, progress = read_settings(own, places, places[0]), read_course(own, places, places[1])
    memory, rates, counts = read_memory(own, places, places[2]), progress.rates, progress.counts
    n, most = len(memory.v), use.iterations
    m = len(memory.a) - n
    counts[STEPS] = 0
    for row in range(len(times)):
        t = min(times[row], use.last)
        for i in range(samples.shape[1]):
            scratch[i] = samples[row, i]
        begin_fresh = counts[FACTORED] == 0 or use.matrix == UPDATE
        if use.matrix == AUTO and rates[SPENT] >= use.patience:
            begin_fresh = True
        converged = False
        while not converged:
            predict(use, memory)
            fresh, found = begin_fresh, 0
            rate = max(rates[RATE], use.fastest) ** 0.8
            before = earlier = largest = size = rounding = goal = steady = 0.0
            once_more = False
            rates[BEFORE] = 0.0
            for k in range(most + 1):
                extent = call_compose(
                    system.compose, reals, integers, scratch, memory.metres, start, memory.increment, tried
                )
                if k == 0:
                    rounding = use.rounding * extent
                    goal = use.tolerance + rounding
                    rates[GOAL] = goal
                call_residual(system.residual, reals, integers, scratch, t, tried, memory.v1, memory.a1, memory.right)
                counts[EVALUATIONS] += 1
                if use.balance >= 0.0:
                    force, reaction = memory.right[n + m], memory.right[n + m + 1]
                    if not math.isfinite(force + reaction):
                        for i in range(n + m):
                            memory.correction[i] = memory.right[i]
                        found = NOT_FINITE
                        break
                    largest = max(largest, force)
                    if k > 0 and is_balanced(use, memory, largest):
                        note(use, progress, k, rate)
                        converged = True
                        break
                if k == most:
                    found = SLOW
                    break
                if fresh:
                    alpha, beta = use.to_v / use.to_a, 1 / use.to_a
                    if len(memory.pivots) > 0:
                        status = dense_factors(system, reals, integers, scratch, t, tried, alpha, beta, memory)
                    else:
                        status = call_factor(
                            system.factor,
                            reals,
                            integers,
                            scratch,
                            t,
                            tried,
                            memory.v1,
                            alpha,
                            beta,
                            memory.factors,
                        )
                    counts[FACTORIZATIONS] += 1
                    counts[FACTORED] = 1 if status == 0 else 0
                    rates[RATE], rates[SPENT], counts[USUAL] = use.slowest, 0.0, most
                    if k == 0 and use.renewal == math.inf:  # otherwise a slow one is renewed within the step
                        rate = use.slowest**0.8
                    if status != 0:
                        for i in range(n + m):
                            memory.correction[i] = 1.0 if i == status - 1 else 0.0
                        found = SINGULAR
                        break
                size = correct(system, reals, integers, use, memory)
                counts[ITERATIONS] += 1
                if not math.isfinite(size):
                    blame(memory)
                    found = NOT_FINITE
                    break
                if k > 0:
                    rate = math.sqrt(size / earlier) if use.over == 2 and k > 1 else size / before
                rates[SIZE] = size
                close = size <= rounding or (rate < 1 and size * rate <= goal * (1 - rate))
                within = size <= rounding or size * rate <= (use.tolerance + ONE_DIGIT * rounding) * (1 - rate)
                if close and not (within or once_more or k + 1 == most):
                    once_more, steady = True, rate
                    fresh = use.matrix == UPDATE
                    earlier, before = before, size
                    rates[BEFORE] = before
                    continue
                if close or once_more:
                    call_compose(
                        system.compose, reals, integers, scratch, memory.metres, start, memory.increment, tried
                    )
                    if once_more:  # whose rate may be that of rounding
                        note(use, progress, k, steady)
                    else:
                        note(use, progress, k + 1, rate)
                    converged = True
                    break
                # a first correction may be small by luck; later ones must lead to the goal in time
                left = 0.0
                if k > 0:
                    left = math.log(goal * (1 - rate) / size) / math.log(rate) if 0 < rate < 1 else math.inf
                renewable = use.matrix == AUTO and use.renewal < math.inf and not fresh
                if (k >= use.over and rate > 2) or (k > 1 and left > most - k and not renewable):
                    found = SLOW
                    break
                fresh = use.matrix == UPDATE or (use.matrix == AUTO and k > 1 and left > use.renewal)
                earlier = before
                before = size
                rates[BEFORE] = before
            if not converged:
                counts[REASON] = found
                if begin_fresh or use.matrix == FROZEN:
                    return FAILED
                begin_fresh = True
        status = judge(use, progress, memory)
        if status == INACCURATE:
            return status
        v1, a1 = memory.v1, memory.a1
        if call_settle(system.settle, reals, integers, scratch, t, tried, v1, a1, knots[row]) != 0:
            return REFUSED
        accept(use, memory, start, tried)
        for i in range(beside.shape[1]):
            beside[row, i] = memory.a[i]
        counts[STEPS] = row + 1
        if status == TIMID:
            return status
    return DONE
