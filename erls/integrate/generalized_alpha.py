"""Generalized-α, the default: implicit, second order, with numerical damping of unresolved vibrations.

J. Chung and G. M. Hulbert, J. Appl. Mech. 60 (1993) 371–375, in the form of M. Arnold and O. Brüls, Multibody
Syst. Dyn. 18 (2007) 185–202: M(y, t) ÿ = f holds at every knot, and an algorithmic acceleration a with

    (1 − α_m) a₁ + α_m a₀ = (1 − α_f) ÿ₁ + α_f ÿ₀

enters Newmark's formulas y₁ = y₀ + h v₀ + h² ((½ − β) a₀ + β a₁) and v₁ = v₀ + h ((1 − γ) a₀ + γ a₁). With

    α_m = (2ρ − 1)/(ρ + 1),  α_f = ρ/(ρ + 1),  γ = ½ + α_f − α_m,  β = ¼ (γ + ½)²

the order is two and vibrations that the step does not resolve lose the factor ρ = ρ∞ in each step. From a
correction Δy follow Δÿ = β' Δy and Δv = γ' Δy with β' = (1 − α_m)/(h² β (1 − α_f)) and γ' = γ/(h β), hence
the iteration matrix S = β' M + γ' C + K. A run starts with a₀ = ÿ₀: that is wrong by O(h), once, and decays.

S is factored once and kept while it serves. A fresh one costs about as much as a few residuals, so it is
made when the iterations beyond those that a fresh one needed add up to that cost, and when iteration fails.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from erls.equations.system import SecondOrderSystem, metre_scales
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg, Observer, Options, Solution
from erls.integrate.driver import Recorder, integrate_legs, not_finite
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.compiled_system import CompiledSystem

MAX_HALVINGS = 12
MAX_ITERATIONS = 10
REFRESH_COST = 4  # of a fresh iteration matrix, in residuals
_OWN_REFRESH_COST = 1  # the same where the system has its own way of solving
_ROUNDING = 16 * np.finfo(float).eps
_SLOWEST_KNOWN, _FASTEST_TRUSTED = 0.9, 1e-3  # bounds on a convergence rate carried over from earlier steps
_SINGULAR = "the iteration matrix is singular"


def _slow(before: float, size: float, goal: float) -> str:
    return f"corrections of {before:.3g} m and {size:.3g} m do not shrink to {goal:.3g} m"


def generalized_alpha(
    system: SecondOrderSystem,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None = None,
) -> Solution:
    """Integrate with fixed steps ``options.step`` (default: a thousandth of the run, at most 1 ms).

    Steps are equal inside a leg and end on breakpoints. Where Newton's method fails they are halved for a
    while.
    """
    step = options.step or min((times[1] - times[0]) / 1000, 1e-3)
    capacity = int(min((times[1] - times[0]) / step, 1e6)) + 2 if times[1] > times[0] else 2
    capacity = 1024 if options.output_step else capacity + 2 * len(system.breakpoints)
    recorder = Recorder(system.size, observer, capacity, options.output_step)
    stepper = _Stepper(system, options, step, recorder)
    compiled = getattr(system, "compiled", None) if system.size else None
    advance = stepper.advance if compiled is None else _Compiled(stepper, compiled).advance
    return integrate_legs(system, times, y, v, recorder, advance)


class _Stepper:
    """State, formulas and iteration matrix of one run."""

    def __init__(self, system: SecondOrderSystem, options: Options, step: float, recorder: Recorder) -> None:
        self.system, self.step, self.work = system, step, recorder.work
        self.tolerance = self.asked_tolerance = options.newton_tolerance
        rho = options.spectral_radius
        self.alpha_m, self.alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        self.gamma = 0.5 + self.alpha_f - self.alpha_m
        self.beta = 0.25 * (self.gamma + 0.5) ** 2
        self.metres = metre_scales(system)
        self.per_metre = 1 / self.metres
        self.h = 0.0
        self.factors = self.pivots = np.empty(0)  # of S
        self.factored = False
        self.rate = _SLOWEST_KNOWN
        self.usual = MAX_ITERATIONS  # fewest since the matrix is fresh
        self.excess = 0  # sum of slow steps' iterations beyond those
        self.suspect, self.reason = np.zeros(1), ""  # (n,) what made the last iteration fail, and how

    def set_step(self, h: float) -> None:
        """Formulas for steps of ``h``; a step that differs only by rounding keeps the matrix."""
        if abs(h - self.h) > 1e-6 * h:
            self.factored = False
        self.h = h
        # an error e in y is one of e β' in ÿ: let it fall with h³, like the truncation error of a step, down to 0.01 ms
        self.tolerance = self.asked_tolerance * min(1.0, max(h / 1e-3, 0.01)) ** 3
        share = (1 - self.alpha_f) / (1 - self.alpha_m)  # of ÿ₁ in a₁
        self.to_v, self.to_a = self.gamma / (h * self.beta), 1 / (h * h * self.beta * share)
        keep, pull = -self.alpha_m / (1 - self.alpha_m), self.alpha_f / (1 - self.alpha_m)
        self.new_a = (share, pull, keep)  # weights of ÿ₁, ÿ₀, a₀ in a₁
        self.y_from_a = (h * h * (0.5 - self.beta), h * h * self.beta)
        self.v_from_a = (h * (1 - self.gamma), h * self.gamma)

    def advance(self, leg: Leg, y: Array, v: Array, a: Array, recorder: Recorder) -> tuple[Array, Array]:
        """Equal steps over a leg, each of 2^MAX_HALVINGS units of time, so that halved steps meet its end."""
        unit = 1 << MAX_HALVINGS
        count = max(1, math.ceil((leg.end - leg.start) / self.step * (1 - 1e-9)))
        total, at, halvings, served = count * unit, 0, 0, 0
        span = leg.end - leg.start
        self.set_step(span / count)
        acc, alg = a, a  # ÿ₀ and a₀
        zero = np.zeros_like(a)
        change = guess = zero  # of ÿ over a step: the last one, and the one expected next
        while at < total:
            target = at + (unit >> halvings)
            t = leg.end if target == total else leg.start + span * (target / total)
            found = self.solve(min(t, leg.last), y, v, acc, alg, guess)
            if found is None:
                recorder.work.rejected_steps += 1
                halvings, served = halvings + 1, 0
                if halvings > MAX_HALVINGS:
                    raise self.failure(t)
                alg = self.change_step(span / count / (1 << halvings), acc, alg)
                change = guess = zero
                continue
            y, v, new, alg = found
            before, change, acc = change, new - acc, new
            # extrapolate ÿ where that would have foretold it better; unresolved modes keep ÿ₀
            guess = np.where(np.abs(change - before) < np.abs(change), change, 0.0)
            at, served = target, served + 1
            recorder.append(t, y, v, acc)
            recorder.accept(t)
            if halvings and served >= 4 and at % (unit >> (halvings - 1)) == 0:
                halvings, served = halvings - 1, 0
                alg = self.change_step(span / count / (1 << halvings), acc, alg)
                change = guess = zero
        return y, v

    def change_step(self, h: float, acc: Array, alg: Array) -> Array:
        """Set ``h`` and return a₀ for it: a₀ stands for ÿ at t₀ + (α_m − α_f) h, which moves with h."""
        alg = acc + (alg - acc) * (h / self.h)
        self.set_step(h)
        return alg

    def refresh(self, t: float, y: Array, v: Array) -> bool:
        """Factor S, scaled to newtons per metre, at this state; False when it is singular or not finite."""
        stiffness, damping = self.system.stiffness_and_damping(t, y, v)
        matrix = self.to_a * self.system.mass_matrix(t, y) + self.to_v * damping + stiffness
        matrix = self.per_metre[:, None] * matrix * self.per_metre
        self.factors, self.pivots, info = dgetrf(matrix)
        self.work.factorizations += 1
        self.factored = info == 0
        if not self.factored:
            self.suspect, self.reason = np.zeros(len(y)), _SINGULAR
            self.suspect[info - 1] = 1.0
        self.rate, self.usual, self.excess = _SLOWEST_KNOWN, MAX_ITERATIONS, 0
        return self.factored

    def solve(
        self, t: float, y: Array, v: Array, acc: Array, alg: Array, guess: Array
    ) -> tuple[Array, Array, Array, Array] | None:
        """One step: y, v, ÿ, a at ``t``, or None when Newton's method fails even with a fresh matrix."""
        share, pull, keep = self.new_a
        known = pull * acc + keep * alg  # part of a₁ that the iteration leaves alone
        fresh = not self.factored or self.excess >= REFRESH_COST
        while True:
            acc1 = acc + guess
            alg1 = known + share * acc1
            y1 = y + self.h * v + self.y_from_a[0] * alg + self.y_from_a[1] * alg1
            v1 = v + self.v_from_a[0] * alg + self.v_from_a[1] * alg1
            if fresh and not self.refresh(t, y1, v1):
                return None
            if self.iterate(t, y1, v1, acc1):
                return y1, v1, acc1, known + share * acc1
            if fresh:
                return None
            fresh = True

    def iterate(self, t: float, y: Array, v: Array, acc: Array) -> bool:
        """Chord iteration on y, v, ÿ in place; True when the remaining error is estimated within tolerance.

        The estimate rate/(1 − rate) |Δ| uses the rate of earlier steps at first (Hairer & Wanner, Solving
        ODEs II, sec. IV.8), which counts for less the older it gets.
        """
        rounding = _ROUNDING * float(np.abs(self.metres * y).max())
        goal = self.tolerance + rounding
        rate, before = max(self.rate, _FASTEST_TRUSTED) ** 0.8, 0.0
        for k in range(1, MAX_ITERATIONS + 1):
            self.work.rhs_calls += 1
            self.work.newton_iterations += 1
            residual = self.system.residual(t, y, v, acc)
            correction, _ = dgetrs(self.factors, self.pivots, residual * self.per_metre)
            size = float(np.abs(correction).max())
            if not math.isfinite(size):
                self.suspect = residual if not np.isfinite(residual).all() else correction
                return False
            move = correction * self.per_metre
            y -= move
            v -= self.to_v * move
            acc -= self.to_a * move
            if k > 1:
                rate = size / before
            if size <= rounding or (rate < 1 and size * rate <= goal * (1 - rate)):
                self.rate = min(rate, _SLOWEST_KNOWN)
                self.usual = min(self.usual, k)
                if k > 1 and rate > _FASTEST_TRUSTED:  # otherwise the last iteration just confirmed
                    self.excess += k - self.usual
                return True
            left = MAX_ITERATIONS - k
            # a first correction may be small by luck; later ones must lead to the goal in time
            if rate > 2 or (k > 2 and (rate >= 1 or size * rate ** (left + 1) > goal * (1 - rate))):
                break
            before = size
        self.suspect = correction
        self.reason = _slow(before, size, goal)
        return False

    def failure(self, t: float) -> SimulationError:
        """The step to ``t`` failed at the smallest step."""
        if not np.isfinite(self.suspect).all():
            return not_finite(t, self.suspect)
        worst = int(np.abs(self.suspect).argmax())
        return SimulationError(
            Cause.NEWTON_FAILED,
            f"Newton's method does not converge in coordinate {worst} (counted from 0): {self.reason}",
            where=f"t = {t:.9g} s",
            value=f"step {self.h:.3g} s",
            limit=f"{MAX_HALVINGS} halvings of the step",
            remedy="check forces and stiffness that act on this coordinate, for jumps without breakpoint "
            "first; then try a smaller step, or integrator lobatto",
        )


class _Compiled:
    """The same steps, taken by the compiled loop (`erls.integrate.stepping.generalized_alpha`)."""

    def __init__(self, stepper: _Stepper, system: CompiledSystem) -> None:
        from erls.integrate.generalized_alpha_compiled import Chunks  # here: it imports the compiler
        from erls.integrate.stepping import generalized_alpha as loop

        self.stepper, self.loop = stepper, loop
        known = {
            loop.ALPHA_M: stepper.alpha_m,
            loop.ALPHA_F: stepper.alpha_f,
            loop.GAMMA: stepper.gamma,
            loop.BETA: stepper.beta,
            loop.ASKED: stepper.asked_tolerance,
            loop.SLOWEST: _SLOWEST_KNOWN,
            loop.FASTEST: _FASTEST_TRUSTED,
            loop.ROUNDING: _ROUNDING,
            loop.RATE: _SLOWEST_KNOWN,
        }
        counts = {
            loop.MAX_HALVINGS: MAX_HALVINGS,
            loop.MAX_ITERATIONS: MAX_ITERATIONS,
            loop.REFRESH_COST: REFRESH_COST if system.factoring is None else _OWN_REFRESH_COST,
            loop.USUAL: MAX_ITERATIONS,
        }
        self.chunks = Chunks(system, known, counts, stepper.metres)

    def advance(self, leg: Leg, y: Array, v: Array, a: Array, recorder: Recorder) -> tuple[Array, Array]:
        """See `_Stepper.advance`."""
        loop, chunks, stepper = self.loop, self.chunks, self.stepper
        count = max(1, math.ceil((leg.end - leg.start) / stepper.step * (1 - 1e-9)))
        if chunks.advance(leg, count, y, v, a, recorder):
            return chunks.state[loop.Y].copy(), chunks.state[loop.V].copy()
        known, reason = chunks.known, chunks.counts[loop.REASON]
        stepper.h, stepper.suspect = float(known[loop.H]), chunks.state[loop.CORRECTION]
        stepper.reason = (
            _SINGULAR
            if reason == loop.SINGULAR
            else _slow(float(known[loop.BEFORE]), float(known[loop.SIZE]), float(known[loop.GOAL]))
        )
        raise stepper.failure(float(known[loop.LAST]))
