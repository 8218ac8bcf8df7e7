"""Steps of Lie-group generalized-α, many at once: the algorithm of `erls.integrate.stepping.generalized_alpha`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

from erls.equations.compiled_system import Array
from erls.equations.nodal.contract import ADVANCE, Knots, Model, Progress, Settings, State, Work
from erls.equations.nodal.motion import compose, set_twists
from erls.equations.nodal.outputs import knot
from erls.equations.nodal.sums import remember
from erls.maths import band
from erls.maths.jit import inlined, kernel

Forces: TypeAlias = Callable[[Model, Work, State, Array], None]
Factor: TypeAlias = Callable[[Model, Work, Array, float, float, float], int]

DONE, FAILED, INACCURATE, TIMID = 0, 1, 2, 3
"""Ends of a stretch: all steps made; Newton's method failed; the local error is too large; a larger step would do."""

SINGULAR, SLOW, INFINITE = 1, 2, 3
"""Reasons of a failure."""

RATE, BEFORE, SIZE, GOAL, ERROR, SPENT = range(6)
MATRIX, USUAL, EXCESS, EVALUATIONS, ITERATIONS, FACTORIZATIONS, REASON, STEPS = range(8)
AUTO, UPDATE, FROZEN = range(3)


@inlined
def _judge(state: State, work: Work, settings: Settings, progress: Progress, metres: Array) -> int:
    if settings.error_limit == 0.0:
        return DONE
    error = 0.0
    for i in range(len(work.a)):
        error = max(error, metres[i] * abs(work.a[i] - state.a[i]))
    error *= settings.error_factor
    progress.rates[ERROR] = error
    if error > settings.error_limit:
        return INACCURATE
    return TIMID if settings.growth > 0.0 and error * settings.growth**3 < settings.error_limit else DONE


@inlined
def _step(
    forces: Forces,
    factor: Factor,
    model: Model,
    state: State,
    work: Work,
    settings: Settings,
    progress: Progress,
    sample: Array,
) -> bool:
    """One step from ``state`` into ``work``; False when Newton's method fails even with a fresh matrix."""
    counts = progress.counts
    fresh = counts[MATRIX] == 0 or settings.mode == UPDATE
    if settings.mode == AUTO and progress.rates[SPENT] >= settings.patience:
        fresh = True
    while True:
        _predict(state, work, settings)
        if _iterate(forces, factor, model, state, work, settings, progress, sample, fresh):
            return True
        if fresh or settings.mode == FROZEN:
            return False
        fresh = True


@inlined
def _predict(state: State, work: Work, settings: Settings) -> None:
    h, beta, gamma = settings.h, settings.beta, settings.gamma
    for i in range(len(work.v)):
        guess = state.a[i] if settings.predict else 0.0
        new = settings.pull * state.a[i] + settings.keep * state.algorithmic[i] + settings.share * guess
        work.increment[i] = h * state.v[i] + h * h * ((0.5 - beta) * state.algorithmic[i] + beta * new)
        work.v[i] = state.v[i] + h * ((1 - gamma) * state.algorithmic[i] + gamma * new)
        work.a[i] = guess
    for i in range(len(work.multipliers)):
        work.multipliers[i] = state.multipliers[i] if settings.predict else 0.0


@inlined
def _iterate(
    forces: Forces,
    factor: Factor,
    model: Model,
    state: State,
    work: Work,
    settings: Settings,
    progress: Progress,
    sample: Array,
    fresh: bool,
) -> bool:
    rates, counts = progress.rates, progress.counts
    n, m = len(work.v), len(work.multipliers)
    rate = max(rates[RATE], settings.fastest) ** 0.8
    goal = settings.tolerance + settings.rounding
    before = earlier = largest = size = 0.0
    for k in range(settings.iterations + 1):
        compose(model, state.poses, work.increment, work.poses)
        forces(model, work, state, sample)
        counts[EVALUATIONS] += 1
        force = reaction = both = gap = 0.0
        for i in range(n):
            f, r = work.force[i] / model.metres[i], work.reaction[i] / model.metres[i]
            force += f * f
            reaction += r * r
            both += (f + r) * (f + r)
        if not math.isfinite(force + reaction):
            for i in range(n):
                work.correction[i] = work.force[i] + work.reaction[i]
            for i in range(m):
                work.correction[n + i] = work.violation[i]
            counts[REASON] = INFINITE
            return False
        largest = max(largest, math.sqrt(force))
        if k > 0 and math.sqrt(both) <= settings.balance * (largest + math.sqrt(reaction)):
            for i in range(m):
                gap = max(gap, abs(work.violation[i]) * work.left[n + i])
            if gap <= settings.balance * settings.reach:
                set_twists(model, work)
                _note(settings, progress, k, rate)
                return True
        if k == settings.iterations:
            break
        if fresh:
            found = factor(model, work, sample, settings.to_a, settings.to_v, settings.period)
            counts[FACTORIZATIONS] += 1
            counts[MATRIX], counts[USUAL], counts[EXCESS] = 1, settings.iterations, 0
            rates[RATE], rates[SPENT] = settings.slowest, 0.0
            if found:
                counts[MATRIX], counts[REASON] = 0, SINGULAR
                for i in range(n + m):
                    work.correction[i] = 0.0
                work.correction[found - 1] = 1.0
                return False
        size = _correct(model, work, settings)
        counts[ITERATIONS] += 1
        if not math.isfinite(size):
            counts[REASON] = INFINITE
            return False
        if k > 0:
            rate = size / before if k == 1 else math.sqrt(size / earlier)  # they rise and fall in turns
        if size <= settings.rounding or (rate < 1 and size * rate <= goal * (1 - rate)):
            _settle(model, state, work)
            _note(settings, progress, k + 1, rate)
            return True
        # a first correction may be small by luck; later ones must lead to the goal in time
        left = 0.0
        if k > 0:
            left = math.log(goal * (1 - rate) / size) / math.log(rate) if 0 < rate < 1 else math.inf
        stale = settings.mode == AUTO and not fresh
        if k > 1 and (rate > 2 or (left > settings.iterations - k and not stale)):
            break
        fresh = settings.mode == UPDATE or (settings.mode == AUTO and k > 1 and left > settings.patience)
        earlier = before
        before = size
    rates[BEFORE], rates[SIZE], rates[GOAL] = before, size, goal
    counts[REASON] = SLOW
    return False


@inlined
def _correct(model: Model, work: Work, settings: Settings) -> float:
    """Solve for a correction, apply it, and return its size [m]."""
    n = len(work.v)
    ordered = work.ordered
    for i in range(len(ordered)):
        unknown = model.order[i]
        right = work.force[unknown] + work.reaction[unknown] if unknown < n else work.violation[unknown - n]
        ordered[i] = work.left[unknown] * right
    band.solve(work.band, work.pivots, ordered)
    size: float = 0.0
    for i in range(len(ordered)):
        unknown = model.order[i]
        work.correction[unknown] = ordered[i]
        if not abs(ordered[i]) <= size:  # NaN too
            size = abs(ordered[i])
            if not math.isfinite(size):
                return size
        move = work.right[unknown] * ordered[i]
        if unknown < n:
            work.increment[unknown] -= move
            work.v[unknown] -= settings.to_v * move
            work.a[unknown] -= settings.to_a * move
        else:
            work.multipliers[unknown - n] -= move
    return size


@inlined
def _settle(model: Model, state: State, work: Work) -> None:
    """Bring everything in ``work`` to its last increment."""
    compose(model, state.poses, work.increment, work.poses)
    remember(model, work, state)
    set_twists(model, work)


@inlined
def _note(settings: Settings, progress: Progress, iterations: int, rate: float) -> None:
    """How fast iteration was."""
    rates, counts = progress.rates, progress.counts
    rates[RATE] = min(rate, settings.slowest)
    counts[USUAL] = min(counts[USUAL], iterations)
    rates[SPENT] = max(0.0, rates[SPENT] + iterations - max(counts[USUAL], 2) - settings.tolerated)


@inlined
def _accept(state: State, work: Work, settings: Settings) -> None:
    """The state that was tried becomes the state."""
    for i in range(len(work.v)):
        known = settings.pull * state.a[i] + settings.keep * state.algorithmic[i]
        state.algorithmic[i] = known + settings.share * work.a[i]
        state.a[i], state.v[i] = work.a[i], work.v[i]
    for i in range(len(work.multipliers)):
        state.multipliers[i] = work.multipliers[i]
    for i in range(len(work.turned)):
        state.turned[i] = work.turned[i]
    for k in range(len(work.wound)):
        for i in range(3):
            state.wound[k, i] = work.wound[k, i]
    for e in range(len(work.bent)):
        for i in range(6):
            state.bent[e, i] = work.bent[e, i]
    for node in range(len(work.poses)):
        for i in range(12):
            state.poses[node, i] = work.poses[node, i]


@inlined
def _store(model: Model, work: Work, knots: Knots, at: int) -> None:
    """Positions and rotation matrices with their derivatives, joint coordinates, rates of twists, multipliers."""
    knot(model, work, knots.states[at])
    for i in range(len(work.a)):
        knots.accelerations[at, i] = work.a[i]
    for i in range(len(work.multipliers)):
        knots.multipliers[at, i] = work.multipliers[i]



@kernel(ADVANCE, counted=False)
def advance(
    forces: Forces,
    factor: Factor,
    model: Model,
    state: State,
    work: Work,
    settings: Settings,
    progress: Progress,
    samples: Array,
    knots: Knots,
    first: int,
) -> int:
    """Steps to the times of ``samples``, one row each; knots go into rows from ``first`` on."""
    progress.counts[STEPS] = 0
    for k in range(len(samples)):
        if not _step(forces, factor, model, state, work, settings, progress, samples[k]):
            return FAILED
        status = _judge(state, work, settings, progress, model.metres)
        if status == INACCURATE:
            return status
        _accept(state, work, settings)
        _store(model, work, knots, first + k)
        progress.counts[STEPS] = k + 1
        if status == TIMID:
            return status
    return DONE
