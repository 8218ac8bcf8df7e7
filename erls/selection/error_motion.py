"""The error that other equations of motion make, from the exact error equation along a computed motion.

Let (y, v, a) be the knots of a motion that some equations gave, and R(t, y, v, a) = M a - f those of another system.
Its motion from the same start is y + e with

    R(t, y + e, v + ė, a + ë) = r(t),

where r holds what the knots themselves leave out of balance. At e = 0 the left-hand side is the force by which the two
systems differ, evaluated along the computed motion; it drives e. Nothing is linearized, and since the motion itself is
known, the steps need to resolve e alone: generalized-α with a frozen iteration matrix, as in
`erls.integrators.generalized_alpha`, over every few knots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.errors import Cause, SimulationError
from erls.integrators.base import Array, SecondOrderSystem, metre_scales

Balance = Callable[[float, Array, Array, Array], Array]
RADIUS = 0.7  # numerical damping of what the steps do not resolve
_ITERATIONS, _SLOW = 15, 6
_LEFT, _ROUNDING = 0.05, 1e-14
_HAIR = 2e-12  # of the run: forces jump at the ends of a leg


@dataclass(frozen=True)
class Knots:
    """Knots of a motion between two jumps: times (k,) at which forces may be asked for, and y, v, a (k, n)."""

    t: Array
    y: Array
    v: Array
    a: Array

    @classmethod
    def inside(cls, t: Array, y: Array, v: Array, a: Array) -> Knots:
        """Times moved by a hair from jumps at the ends."""
        hair = min(_HAIR * max(1.0, abs(t[0]), abs(t[-1])), (t[-1] - t[0]) / 4)
        return cls(np.clip(t, t[0] + hair, t[-1] - hair), y, v, a)


@dataclass(frozen=True)
class Deviation:
    """At one knot: its time, the knot (y, v) and the other system's motion (y + e, v + ė)."""

    t: float
    y: Array
    v: Array
    other_y: Array
    other_v: Array


def error_motion(
    system: SecondOrderSystem,
    legs: list[Knots],
    start: tuple[Array, Array],
    balance: Balance,
    stride: int,
    accuracy: float,
) -> list[Deviation]:
    """Integrate the error along a motion.

    Parameters
    ----------
    system : SecondOrderSystem
        R.
    legs : list of Knots
        The motion, in the coordinates of ``system``.
    start : (n,), (n,) arrays
        e and ė at the first knot.
    balance : callable
        r(t, y, v, a) (n,) of the knots.
    stride : int
        Knots per step; less where the iteration needs it.
    accuracy : float
        Error that does not matter [m].

    Raises
    ------
    SimulationError
        NEWTON_FAILED, or SINGULAR_MASS of the other system.
    """
    stepper = _Stepper(system, accuracy, float(legs[-1].t[-1] - legs[0].t[0]))
    e, rate = start
    result: list[Deviation] = []
    for leg in legs:
        at, last, wide = 0, len(leg.t) - 1, stride
        acceleration = stepper.acceleration(leg, e, rate, balance)
        stepper.begin(acceleration)
        result.append(Deviation(float(leg.t[0]), leg.y[0], leg.v[0], leg.y[0] + e, leg.v[0] + rate))
        while at < last:
            to = min(at + wide, last)
            found = stepper.step(leg, at, to, e, rate, balance)
            if found is None:
                if to == at + 1:
                    message = "the error of what was left out cannot be followed"
                    where = f"t = {leg.t[to]:.6g} s"
                    raise SimulationError(Cause.NEWTON_FAILED, message, where=where, remedy="use effects = 'all'")
                wide = max(1, (to - at) // 2)
                continue
            e, rate = found
            at, wide = to, min(2 * wide, stride)
            result.append(Deviation(float(leg.t[at]), leg.y[at], leg.v[at], leg.y[at] + e, leg.v[at] + rate))
    return result


class _Stepper:
    """Formulas, iteration matrix and accelerations."""

    def __init__(self, system: SecondOrderSystem, accuracy: float, duration: float) -> None:
        self.system, self.accuracy, self.duration = system, accuracy, duration
        self.metres = metre_scales(system)
        self.alpha_m, self.alpha_f = (2 * RADIUS - 1) / (RADIUS + 1), RADIUS / (RADIUS + 1)
        self.gamma = 0.5 + self.alpha_f - self.alpha_m
        self.beta = 0.25 * (self.gamma + 0.5) ** 2
        self.h = 0.0
        self.factor: tuple[Array, Array] | None = None
        self.acc = self.alg = np.zeros(system.size)
        self.largest = 0.0

    def acceleration(self, leg: Knots, e: Array, rate: Array, balance: Balance) -> Array:
        """ë at the first knot of a leg."""
        t, y, v, a = leg.t[0], leg.y[0], leg.v[0], leg.a[0]
        force = self.system.residual(t, y + e, v + rate, a) - balance(t, y, v, a)
        return np.asarray(np.linalg.solve(self.system.mass_matrix(t, y + e), -force), dtype=float)

    def begin(self, acceleration: Array) -> None:
        """ë and a₀ at the start of a leg."""
        self.acc = self.alg = acceleration
        self.factor = None

    def step(
        self, leg: Knots, at: int, to: int, e: Array, rate: Array, balance: Balance
    ) -> tuple[Array, Array] | None:
        """e and ė at knot ``to``; None where the iteration fails."""
        t, y, v, a = float(leg.t[to]), leg.y[to], leg.v[to], leg.a[to]
        h = float(leg.t[to] - leg.t[at])
        alg = self.alg if self.h == 0 else self.acc + (self.alg - self.acc) * (h / self.h)
        if abs(h - self.h) > 1e-6 * h:
            self.h, self.factor = h, None
        share = (1 - self.alpha_f) / (1 - self.alpha_m)
        known = (self.alpha_f * self.acc - self.alpha_m * alg) / (1 - self.alpha_m)
        to_v, to_a = self.gamma / (h * self.beta), 1 / (h * h * self.beta * share)
        r = balance(t, y, v, a)
        # what iterations leave in e is an acceleration, 1/h² of it, that moves joints over the whole run
        share_left = _LEFT * (h / self.duration) ** 2
        rounding = _ROUNDING * float(np.abs(self.metres * y).max(initial=0.0))
        for fresh in (self.factor is None, True):
            acc = self.acc
            next_alg = known + share * acc
            next_e = e + h * rate + h * h * ((0.5 - self.beta) * alg + self.beta * next_alg)
            next_rate = rate + h * ((1 - self.gamma) * alg + self.gamma * next_alg)
            if fresh and not self.refresh(t, y + next_e, v + next_rate, to_v, to_a):
                return None
            before = np.inf
            for count in range(_ITERATIONS):
                out = self.system.residual(t, y + next_e, v + next_rate, a + acc) - r
                move = la.lu_solve(self.factor, out, check_finite=False)
                size = float(np.abs(self.metres * move).max(initial=0.0))
                if not size < 2 * before:
                    break
                next_e, next_rate, acc = next_e - move, next_rate - to_v * move, acc - to_a * move
                left = size * min(1.0, size / before) if count else size
                if left <= share_left * max(self.accuracy, self.largest) or size <= rounding:
                    self.largest = max(self.largest, float(np.abs(self.metres * next_e).max(initial=0.0)))
                    self.acc, self.alg = acc, known + share * acc
                    if count >= _SLOW:
                        self.factor = None
                    return next_e, next_rate
                before = size
            if fresh:
                return None
        return None

    def refresh(self, t: float, y: Array, v: Array, to_v: float, to_a: float) -> bool:
        """Factor the iteration matrix; False when it is not finite."""
        stiffness, damping = self.system.stiffness_and_damping(t, y, v)
        matrix = to_a * self.system.mass_matrix(t, y) + to_v * damping + stiffness
        if not np.isfinite(matrix).all():
            return False
        self.factor = la.lu_factor(matrix, check_finite=False)
        return True
