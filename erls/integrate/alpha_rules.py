"""Coefficients of generalized-α, rules of its iterations, and the messages of failed steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from erls.errors import Cause, SimulationError
from erls.integrate.driver import not_finite
from erls.maths.so3 import Array
from erls.scene.integrators import MATRICES, STARTS

MAX_HALVINGS = 12
MAX_ITERATIONS, FROZEN_ITERATIONS = 10, 100  # a slow step with one matrix for all has no other way to go
ROUNDING = 16 * np.finfo(float).eps
SLOWEST_KNOWN, FASTEST_TRUSTED = 0.9, 1e-3  # bounds on a convergence rate carried over from earlier steps
GROWTH = 1.7  # ratio of steps that is worth new factors
SINGULAR = "the iteration matrix is singular"
_ALIKE = 0.01  # corrections that go to and fro between two states, and do not converge slowly
_TURNING = ", as where a force turns over within one step: friction has too small a transition_rate, say"
GUESSES = (*STARTS, "extrapolated")


@dataclass(frozen=True)
class Rules:
    """How the iterations of a step begin and end, and what a fresh iteration matrix is worth.

    Attributes
    ----------
    spectral_radius, newton_tolerance : float
        See `erls.integrate.base.Options`.
    matrix : str
        Of `erls.scene.integrators.MATRICES`.
    guess : str
        Of `GUESSES`: zero accelerations and multipliers, the last ones, or accelerations extrapolated.
    balance : float
        Largest residual against its terms with which iterations may end; negative: it is not looked at.
    patience : float
        Cost of a fresh matrix between steps, in iterations.
    renewal : float
        The same within a step; infinite: a step that fails is tried again with a fresh one.
    tolerated : float
        Iterations beyond the fewest that do not count towards that.
    fewest : int
        Iterations that always count as few.
    over : int
        Iterations over which a rate of convergence is taken: two where they rise and fall in turns.
    """

    spectral_radius: float
    newton_tolerance: float
    matrix: str = "auto"
    guess: str = "extrapolated"
    balance: float = -1.0
    patience: float = 4.0
    renewal: float = math.inf
    tolerated: float = 0.0
    fewest: int = 1
    over: int = 1


@dataclass(frozen=True)
class Formulas:
    """Steps of ``h``; a₁ = share · v̇₁ + pull · v̇₀ + keep · a₀.

    Attributes
    ----------
    to_v, to_a : float
        γ' and β': changes of v₁ and v̇₁ with those of the increment.
    tolerance : float
        Error at which Newton iterations end [m]. An error e of the increment is one of e β' in v̇: it falls with h³,
        like the truncation error of a step, down to 0.01 ms.
    error : float
        Truncation error of the increment over |v̇₁ − v̇₀|: a₀ stands for v̇ at t₀ + (α_m − α_f) h.
    """

    h: float
    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float
    tolerance: float

    @staticmethod
    def of(rules: Rules, h: float) -> Formulas:
        """Coefficients for steps of ``h``."""
        rho = rules.spectral_radius
        alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        beta = 0.25 * (gamma + 0.5) ** 2
        return Formulas(h, alpha_m, alpha_f, gamma, beta, rules.newton_tolerance * min(1.0, max(h / 1e-3, 0.01)) ** 3)

    @property
    def share(self) -> float:
        return (1 - self.alpha_f) / (1 - self.alpha_m)

    @property
    def pull(self) -> float:
        return self.alpha_f / (1 - self.alpha_m)

    @property
    def keep(self) -> float:
        return -self.alpha_m / (1 - self.alpha_m)

    @property
    def to_v(self) -> float:
        return self.gamma / (self.h * self.beta)

    @property
    def to_a(self) -> float:
        return 1 / (self.h * self.h * self.beta * self.share)

    @property
    def error(self) -> float:
        return abs(1 / 6 - self.beta - (self.alpha_m - self.alpha_f) / 2) * self.h**2


class Limit(NamedTuple):
    """Largest local error [m], or 0 for none, and whether a larger step would be welcome."""

    error: float = 0.0
    can_grow: bool = False


class Words(NamedTuple):
    """How messages speak of a system: names of its conditions, where to look, what else to try."""

    conditions: tuple[str, ...] = ()
    place: str = "on this coordinate"
    instead: str = "a smaller step, or integrator lobatto"


def newton_failure(
    words: Words, size: int, rules: Rules, t: float, h: float, suspect: Array, reason: str
) -> SimulationError:
    """The step to ``t`` failed at the smallest step; ``suspect`` (n + m,) tells where, n being ``size``."""
    if not np.isfinite(suspect).all():
        return not_finite(t, suspect)
    worst = int(np.abs(suspect).argmax())
    what = f"coordinate {worst} (counted from 0)" if worst < size else words.conditions[worst - size]
    frozen = rules.matrix == MATRICES[2]
    return SimulationError(
        Cause.NEWTON_FAILED,
        f"Newton's method does not converge in {what}: {reason}",
        where=f"t = {t:.9g} s",
        value=f"step {h:.3g} s",
        limit="one iteration matrix" if frozen else f"{MAX_HALVINGS} halvings of the step",
        remedy="let iteration_matrix be auto"
        if frozen
        else f"check forces and stiffness that act {words.place}, for jumps without breakpoint first; "
        f"then try {words.instead}",
    )


def too_slow(before: float, size: float, goal: float) -> str:
    """Reason of a failure: corrections [m]."""
    told = f"corrections of {before:.3g} m and {size:.3g} m do not shrink to {goal:.3g} m"
    return told + (_TURNING if abs(size - before) < _ALIKE * before else "")
