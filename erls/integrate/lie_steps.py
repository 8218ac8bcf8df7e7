"""Steps of Lie-group generalized-α for any `erls.integrate.constrained.ConstrainedSystem`."""

from __future__ import annotations

import math

import numpy as np

from erls.equations.consistency import consistent_acceleration, consistent_velocity
from erls.equations.constrained_system import Configuration, ConstrainedState, ConstrainedSystem
from erls.equations.system import metre_scales
from erls.errors import SimulationError
from erls.integrate.base import Leg
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.constrained_run import ConstrainedRecorder
from erls.integrate.driver import not_finite
from erls.integrate.lie_formulas import (
    DONE,
    FAILED,
    FASTEST_TRUSTED,
    GROWTH,
    INACCURATE,
    MAX_ITERATIONS,
    REFRESH_COST,
    ROUNDING,
    SINGULAR,
    SLOWEST_KNOWN,
    TIMID,
    TOLERATED,
    Formulas,
    Limit,
    newton_failure,
    too_slow,
)
from erls.maths.saddle import Saddle, Scales
from erls.maths.so3 import Array


class NumpySteps:
    """State, formulas and iteration matrix of one run, as `erls.integrate.lie_formulas.Steps`."""

    def __init__(self, system: ConstrainedSystem, options: ConstrainedOptions, recorder: ConstrainedRecorder) -> None:
        self.system, self.options = system, options
        self.recorder, self.work = recorder, recorder.work
        self.metres = metre_scales(system)
        self.reach = float(self.metres.max(initial=1.0))
        self.formulas = Formulas.of(options, 1.0)
        self.h, self.error = 0.0, 0.0
        self.saddle: Saddle | None = None
        self.rate, self.usual, self.excess = SLOWEST_KNOWN, MAX_ITERATIONS, 0
        self.suspect, self.reason = np.zeros(1), ""  # (n + m,) what made the last iteration fail, and how
        self.state: ConstrainedState
        self.algorithmic: Array

    def begin(self, leg: Leg, q: Configuration, v: Array) -> None:
        """Acceleration and multipliers at the start of a leg."""
        self.state = start_of_leg(self.system, leg, q, v, self.recorder)
        self.algorithmic = self.state.a

    def set_step(self, h: float) -> None:
        """Formulas for steps of ``h``; a step that differs only by rounding keeps the matrix."""
        if abs(h - self.h) > 1e-6 * h:
            self.saddle = None
        if self.h:
            self.algorithmic = self.state.a + (self.algorithmic - self.state.a) * (h / self.h)
        self.h, self.formulas = h, Formulas.of(self.options, h)

    def stretch(self, times: Array, last: float, limit: Limit) -> tuple[int, int]:
        """One step after another."""
        for made, t in enumerate(times.tolist()):
            found = self.solve(min(t, last), self.state, self.algorithmic)
            if found is None:
                return made, FAILED
            if limit.error:
                change = np.abs((found[0].a - self.state.a) * self.metres)
                self.error = float(change.max(initial=0.0)) * self.formulas.error
                if self.error > limit.error:
                    return made, INACCURATE
            self.state, self.algorithmic = found
            if self.options.project_velocity:
                self.work.factorizations += 1
                v = consistent_velocity(self.system, min(t, last), self.state.q, self.state.v)
                self.state = self.state._replace(v=v)
            self.recorder.add(t, self.state)
            self.recorder.accept(t)
            if limit.can_grow and self.error * GROWTH**3 < limit.error:
                return made + 1, TIMID
        return len(times), DONE

    def end(self) -> tuple[Configuration, Array]:
        """Configuration and velocity."""
        return self.state.q, self.state.v

    def failure(self, t: float) -> SimulationError:
        """Why the step to ``t`` failed."""
        return newton_failure(self.system, self.options, t, self.h, self.suspect, self.reason)

    def refresh(self, t: float, state: ConstrainedState, increment: Array) -> bool:
        """Factor the iteration matrix at this state; False when it is singular."""
        q, v, a, multipliers = state
        system = self.system
        stiffness, damping = system.stiffness_and_damping(t, q, v, a, multipliers)
        mass, rows, tangent = system.mass_matrix(t, q), system.constraint_matrix(t, q), system.tangent(increment)
        turned, rows_turned = (stiffness, rows) if tangent is None else (stiffness @ tangent, rows @ tangent)
        block = self.formulas.to_a * mass + self.formulas.to_v * damping + turned
        self.saddle = Saddle(block, rows.T, rows_turned, Scales(self.metres, mass, rows), self.formulas.period)
        self.work.factorizations += 1
        self.rate, self.usual, self.excess = SLOWEST_KNOWN, MAX_ITERATIONS, 0
        if self.saddle.singular is None:
            return True
        self.suspect, self.reason = np.zeros(len(v) + len(multipliers)), SINGULAR
        self.suspect[self.saddle.singular] = 1.0
        self.saddle = None
        return False

    def solve(self, t: float, before: ConstrainedState, algorithmic: Array) -> tuple[ConstrainedState, Array] | None:
        """One step: the state at ``t`` and a₁, or None when Newton's method fails even with a fresh matrix."""
        mode = self.options.iteration_matrix
        use = self.formulas
        known = use.pull * before.a + use.keep * algorithmic  # part of a₁ that the iteration leaves alone
        h, beta, gamma = use.h, use.beta, use.gamma
        guess = 0 * before.a, 0 * before.multipliers
        if self.options.start_from == "last":
            guess = before.a, before.multipliers
        first = known + use.share * guess[0]
        increment = h * before.v + h * h * ((0.5 - beta) * algorithmic + beta * first)
        v = before.v + h * ((1 - gamma) * algorithmic + gamma * first)
        fresh = self.saddle is None or mode == "update" or (mode == "auto" and self.excess >= REFRESH_COST)
        while True:
            found = self.iterate(t, before.q, increment.copy(), v.copy(), guess, fresh)
            if found is not None:
                return found, known + use.share * found.a
            if fresh or mode == "frozen":
                return None
            fresh = True

    def iterate(
        self, t: float, q0: Configuration, d: Array, v: Array, guess: tuple[Array, Array], fresh: bool
    ) -> ConstrainedState | None:
        """Newton or chord iteration; None when it does not converge.

        It has converged when the residual is small against its terms, or when the remaining error is estimated within
        tolerance: rate/(1 − rate) |Δ|, with the rate of earlier steps at first (Hairer & Wanner, Solving ODEs II,
        sec. IV.8), which counts for less the older it gets.
        """
        system, mode = self.system, self.options.iteration_matrix
        a, multipliers = guess
        rate, before, earlier, largest = max(self.rate, FASTEST_TRUSTED) ** 0.8, 0.0, 0.0, 0.0
        rounding = ROUNDING * self.reach
        goal = self.formulas.tolerance + rounding
        for k in range(MAX_ITERATIONS + 1):
            q = system.compose(q0, d)
            state = ConstrainedState(q, v, a, multipliers)
            self.work.rhs_calls += 1
            residual, violation = system.residual(t, q, v, a), system.constraint(t, q)
            reaction = system.constraint_matrix(t, q).T @ multipliers
            sizes = [float(np.linalg.norm(part / self.metres)) for part in (residual, reaction, residual + reaction)]
            if not math.isfinite(sum(sizes)):
                self.suspect = np.concatenate([residual + reaction, violation])
                return None
            largest = max(largest, sizes[0])
            if k > 0 and self.balanced(sizes[2], largest + sizes[1], violation):
                return self.accepted(state, k, rate)
            if k == MAX_ITERATIONS:
                break
            if fresh and not self.refresh(t, state, d):
                return None
            assert self.saddle is not None
            right = self.saddle.scaled(residual + reaction, violation)
            self.work.newton_iterations += 1
            correction = self.saddle.solve(right)
            size = float(np.abs(correction).max())
            if not math.isfinite(size):
                self.suspect = correction
                return None
            move, change = self.saddle.unscaled(correction)
            d = d - move
            v = v - self.formulas.to_v * move
            a = a - self.formulas.to_a * move
            multipliers = multipliers - change
            if k > 0:
                rate = size / before if k == 1 else math.sqrt(size / earlier)  # they rise and fall in turns
            if size <= rounding or (rate < 1 and size * rate <= goal * (1 - rate)):
                q = system.compose(q0, d)
                return self.accepted(ConstrainedState(q, v, a, multipliers), k + 1, rate)
            # a first correction may be small by luck; later ones must lead to the goal in time
            left = iterations_left(size, goal * (1 - rate), rate) if k > 0 else 0.0
            stale = mode == "auto" and not fresh
            if k > 1 and (rate > 2 or (left > MAX_ITERATIONS - k and not stale)):
                break
            fresh = mode == "update" or (mode == "auto" and k > 1 and left > REFRESH_COST)
            before, earlier = size, before
        self.suspect = correction
        self.reason = too_slow(before, size, goal)
        return None

    def balanced(self, residual: float, terms: float, violation: Array) -> bool:
        """Whether forces balance against the size of their terms, and the joints are closed."""
        small = self.options.residual_tolerance
        if residual > small * terms or self.saddle is None:
            return False
        gap = float(np.abs(violation * self.saddle.scales.constraint).max(initial=0.0))
        return gap <= small * self.reach

    def accepted(self, state: ConstrainedState, iterations: int, rate: float) -> ConstrainedState:
        """Note how fast iteration was."""
        self.rate = min(rate, SLOWEST_KNOWN)
        self.usual = min(self.usual, iterations)
        self.excess = max(0, self.excess + iterations - max(self.usual, 2) - TOLERATED)
        return state


def start_of_leg(
    system: ConstrainedSystem, leg: Leg, q: Configuration, v: Array, recorder: ConstrainedRecorder
) -> ConstrainedState:
    """Acceleration and multipliers at the start of a leg, which becomes a knot."""
    recorder.work.rhs_calls += 1
    recorder.work.factorizations += 1
    a, multipliers = consistent_acceleration(system, leg.first, q, v)
    if not np.isfinite(a).all():
        raise not_finite(leg.start, a)
    state = ConstrainedState(q, v, a, multipliers)
    recorder.begin_with(leg.start, state)
    return state


def iterations_left(size: float, goal: float, rate: float) -> float:
    """Iterations from a correction of ``size`` down to ``goal``."""
    return math.log(goal / size) / math.log(rate) if 0 < rate < 1 else math.inf
