"""Lie-group generalized-α for constrained systems: implicit, second order, with numerical damping.

O. Brüls and A. Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002; M. Arnold and O. Brüls, Multibody Syst. Dyn. 18
(2007) 185–202. At every knot M v̇ = f − Bᵀλ and Φ = 0 hold, and with the algorithmic acceleration a,

    (1 − α_m) a₁ + α_m a₀ = (1 − α_f) v̇₁ + α_f v̇₀,
    q₁ = q₀ ∘ exp(d),  d = h v₀ + h² ((½ − β) a₀ + β a₁),  v₁ = v₀ + h ((1 − γ) a₀ + γ a₁)

with the coefficients of `erls.integrators.generalized_alpha`. Corrections of d and λ solve

    [[β' M + γ' C + K T, Bᵀ], [B T, 0]],   β' = (1 − α_m)/(h² β (1 − α_f)),  γ' = γ/(h β),

scaled as in `erls.integrators.saddle`. A step starts from v̇₁ = 0 and λ₁ = 0. A run starts with a₀ = v̇₀: that is wrong
by O(h), once; multipliers, of first order there, are of second order when it has decayed.
"""

from __future__ import annotations

import math

import numpy as np

from erls.errors import Cause, SimulationError
from erls.integrators.base import Array, Leg, Observer, legs, metre_scales
from erls.integrators.consistency import (
    consistent_acceleration,
    consistent_start,
    consistent_velocity,
    refuse_redundant,
)
from erls.integrators.constrained import (
    Configuration,
    ConstrainedOptions,
    ConstrainedSolution,
    ConstrainedState,
    ConstrainedSystem,
)
from erls.integrators.constrained_run import ConstrainedRecorder
from erls.integrators.driver import not_finite
from erls.integrators.saddle import Saddle, Scales

MAX_HALVINGS = 12
MAX_ITERATIONS = 10
REFRESH_COST = 4  # of a fresh iteration matrix, in residuals
_ROUNDING = 16 * np.finfo(float).eps
_SLOWEST_KNOWN, _FASTEST_TRUSTED = 0.9, 1e-3  # bounds on a convergence rate carried over from earlier steps


def lie_generalized_alpha(
    system: ConstrainedSystem,
    times: tuple[float, float],
    q: Configuration,
    v: Array,
    options: ConstrainedOptions,
    observer: Observer | None = None,
) -> ConstrainedSolution:
    """Integrate with fixed steps ``options.step`` (default: a thousandth of the run, at most 1 ms).

    Steps are equal inside a leg and end on breakpoints. Where Newton's method fails they are halved for a while.
    """
    walk = legs(system, times) or [Leg(times[0], times[1], times[0], times[1])]
    step = options.step or min((times[1] - times[0]) / 1000, 1e-3) or 1e-3
    failure: SimulationError | None = None
    given = ConstrainedState(q, np.array(v, dtype=float), np.zeros(system.size), np.zeros(system.constraints))
    recorder = ConstrainedRecorder(system, times[0], given, observer)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found and reported
        try:
            refuse_redundant(system, walk[0].first, q)
            q, v = consistent_start(system, walk[0].first, q, given.v, recorder.warnings)
            stepper = _Stepper(system, options, step, recorder)
            for leg in walk:
                a, multipliers = stepper.begin(leg, q, v)
                state = ConstrainedState(q, v, a, multipliers)
                recorder.add(leg.start, state)
                if leg.end > leg.start:
                    q, v = stepper.advance(leg, state)
        except KeyboardInterrupt:
            failure = SimulationError(
                Cause.INTERRUPTED, "the run was interrupted", remedy="the motion up to this time was kept"
            )
        except SimulationError as error:
            failure = error
    if recorder.time is None:  # failed at once; a solution always has a knot
        recorder.add(times[0], given)
    if failure is not None and not failure.where:
        failure.where = f"t = {recorder.time:.9g} s"
    return recorder.solution(failure)


class _Stepper:
    """State, formulas and iteration matrix of one run."""

    def __init__(
        self, system: ConstrainedSystem, options: ConstrainedOptions, step: float, recorder: ConstrainedRecorder
    ) -> None:
        self.system, self.options, self.step = system, options, step
        self.recorder, self.work = recorder, recorder.work
        rho = options.spectral_radius
        self.alpha_m, self.alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        self.gamma = 0.5 + self.alpha_f - self.alpha_m
        self.beta = 0.25 * (self.gamma + 0.5) ** 2
        self.metres = metre_scales(system)
        self.reach = float(self.metres.max(initial=1.0))
        self.h = 0.0
        self.saddle: Saddle | None = None
        self.rate, self.usual, self.excess = _SLOWEST_KNOWN, MAX_ITERATIONS, 0
        self.suspect, self.reason = np.zeros(1), ""  # (n + m,) what made the last iteration fail, and how

    def begin(self, leg: Leg, q: Configuration, v: Array) -> tuple[Array, Array]:
        """Acceleration and multipliers at the start of a leg."""
        self.work.rhs_calls += 1
        self.work.factorizations += 1
        a, multipliers = consistent_acceleration(self.system, leg.first, q, v)
        if not np.isfinite(a).all():
            raise not_finite(leg.start, a)
        return a, multipliers

    def set_step(self, h: float) -> None:
        """Formulas for steps of ``h``; a step that differs only by rounding keeps the matrix."""
        if abs(h - self.h) > 1e-6 * h:
            self.saddle = None
        self.h = h
        # an error e in q is one of e β' in v̇: let it fall with h³, like the truncation error of a step
        self.tolerance = self.options.newton_tolerance * min(1.0, h / 1e-3) ** 3
        share = (1 - self.alpha_f) / (1 - self.alpha_m)  # of v̇₁ in a₁
        self.period = h * math.sqrt(self.beta * share)
        self.to_v, self.to_a = self.gamma / (h * self.beta), 1 / (h * h * self.beta * share)
        self.share, self.pull, self.keep = share, self.alpha_f / (1 - self.alpha_m), -self.alpha_m / (1 - self.alpha_m)

    def advance(self, leg: Leg, state: ConstrainedState) -> tuple[Configuration, Array]:
        """Equal steps over a leg, each of 2^MAX_HALVINGS units of time, so that halved steps meet its end."""
        unit = 1 << MAX_HALVINGS
        count = max(1, math.ceil((leg.end - leg.start) / self.step * (1 - 1e-9)))
        total, at, halvings, served = count * unit, 0, 0, 0
        span = leg.end - leg.start
        algorithmic = state.a
        self.set_step(span / count)
        while at < total:
            target = at + (unit >> halvings)
            t = leg.end if target == total else leg.start + span * (target / total)
            found = self.solve(min(t, leg.last), state, algorithmic)
            if found is None:
                self.work.rejected_steps += 1
                halvings, served = halvings + 1, 0
                if halvings > MAX_HALVINGS or self.options.iteration_matrix == "frozen":
                    raise self.failure(t)
                algorithmic = self.change_step(span / count / (1 << halvings), state.a, algorithmic)
                continue
            state, algorithmic = found
            if self.options.project_velocity:
                self.work.factorizations += 1
                state = state._replace(v=consistent_velocity(self.system, min(t, leg.last), state.q, state.v))
            at, served = target, served + 1
            self.recorder.add(t, state)
            self.recorder.accept(t)
            if halvings and served >= 4 and at % (unit >> (halvings - 1)) == 0:
                halvings, served = halvings - 1, 0
                algorithmic = self.change_step(span / count / (1 << halvings), state.a, algorithmic)
        return state.q, state.v

    def change_step(self, h: float, acceleration: Array, algorithmic: Array) -> Array:
        """Set ``h`` and return a₀ for it: a₀ stands for v̇ at t₀ + (α_m − α_f) h, which moves with h."""
        algorithmic = acceleration + (algorithmic - acceleration) * (h / self.h)
        self.set_step(h)
        return algorithmic

    def refresh(self, t: float, state: ConstrainedState, increment: Array) -> bool:
        """Factor the iteration matrix at this state; False when it is singular."""
        q, v, a, multipliers = state
        system = self.system
        stiffness, damping = system.stiffness_and_damping(t, q, v, a, multipliers)
        mass, rows, tangent = system.mass_matrix(t, q), system.constraint_matrix(t, q), system.tangent(increment)
        turned, rows_turned = (stiffness, rows) if tangent is None else (stiffness @ tangent, rows @ tangent)
        block = self.to_a * mass + self.to_v * damping + turned
        self.saddle = Saddle(block, rows.T, rows_turned, Scales(self.metres, mass, rows), self.period)
        self.work.factorizations += 1
        self.rate, self.usual, self.excess = _SLOWEST_KNOWN, MAX_ITERATIONS, 0
        if self.saddle.singular is None:
            return True
        self.suspect, self.reason = np.zeros(len(v) + len(multipliers)), "the iteration matrix is singular"
        self.suspect[self.saddle.singular] = 1.0
        self.saddle = None
        return False

    def solve(self, t: float, before: ConstrainedState, algorithmic: Array) -> tuple[ConstrainedState, Array] | None:
        """One step: the state at ``t`` and a₁, or None when Newton's method fails even with a fresh matrix."""
        mode = self.options.iteration_matrix
        known = self.pull * before.a + self.keep * algorithmic  # part of a₁ that the iteration leaves alone
        h, beta, gamma = self.h, self.beta, self.gamma
        increment = h * before.v + h * h * ((0.5 - beta) * algorithmic + beta * known)
        v = before.v + h * ((1 - gamma) * algorithmic + gamma * known)
        fresh = self.saddle is None or mode == "update" or (mode == "auto" and self.excess >= REFRESH_COST)
        while True:
            found = self.iterate(t, before.q, increment.copy(), v.copy(), fresh)
            if found is not None:
                return found, known + self.share * found.a
            if fresh or mode == "frozen":
                return None
            fresh = True

    def iterate(self, t: float, q0: Configuration, d: Array, v: Array, fresh: bool) -> ConstrainedState | None:
        """Newton or chord iteration from v̇ = 0, λ = 0; None when it does not converge.

        It has converged when the residual is small against its terms, or when the remaining error is estimated within
        tolerance: rate/(1 − rate) |Δ|, with the rate of earlier steps at first (Hairer & Wanner, Solving ODEs II,
        sec. IV.8), which counts for less the older it gets.
        """
        system, mode = self.system, self.options.iteration_matrix
        a, multipliers = np.zeros(len(d)), np.zeros(system.constraints)
        rate, before, largest = max(self.rate, _FASTEST_TRUSTED) ** 0.8, 0.0, 0.0
        rounding = _ROUNDING * self.reach
        goal = self.tolerance + rounding
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
            v = v - self.to_v * move
            a = a - self.to_a * move
            multipliers = multipliers - change
            if k > 0:
                rate = size / before
            if size <= rounding or (rate < 1 and size * rate <= goal * (1 - rate)):
                q = system.compose(q0, d)
                return self.accepted(ConstrainedState(q, v, a, multipliers), k + 1, rate)
            # a first correction may be small by luck; later ones must lead to the goal in time
            left = _iterations(size, goal * (1 - rate), rate) if k > 0 else 0.0
            stale = mode == "auto" and not fresh
            if rate > 2 or (k > 1 and left > MAX_ITERATIONS - k and not stale):
                break
            fresh = mode == "update" or (mode == "auto" and left > REFRESH_COST)
            before = size
        self.suspect = correction
        self.reason = f"corrections of {before:.3g} m and {size:.3g} m do not shrink to {goal:.3g} m"
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
        self.rate = min(rate, _SLOWEST_KNOWN)
        self.usual = min(self.usual, iterations)
        if iterations > 1 and rate > _FASTEST_TRUSTED:  # otherwise the last iteration just confirmed
            self.excess += iterations - self.usual
        return state

    def failure(self, t: float) -> SimulationError:
        """The step to ``t`` failed at the smallest step."""
        if not np.isfinite(self.suspect).all():
            return not_finite(t, self.suspect)
        worst, n = int(np.abs(self.suspect).argmax()), self.system.size
        what = f"coordinate {worst} (counted from 0)" if worst < n else self.system.constraint_names[worst - n]
        frozen = self.options.iteration_matrix == "frozen"
        return SimulationError(
            Cause.NEWTON_FAILED,
            f"Newton's method does not converge in {what}: {self.reason}",
            where=f"t = {t:.9g} s",
            value=f"step {self.h:.3g} s",
            limit="one iteration matrix" if frozen else f"{MAX_HALVINGS} halvings of the step",
            remedy="let iteration_matrix be auto"
            if frozen
            else "check forces and stiffness that act there, for jumps without breakpoint first; then try a smaller "
            "step or a larger Newton tolerance",
        )


def _iterations(size: float, goal: float, rate: float) -> float:
    """Iterations from a correction of ``size`` down to ``goal``."""
    return math.log(goal / size) / math.log(rate) if 0 < rate < 1 else math.inf
