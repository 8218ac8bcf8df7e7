"""Coefficients of Lie-group generalized-α, the contract of what makes its steps, and the messages of failed ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from erls.equations.constrained_system import Configuration, ConstrainedSystem
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.driver import not_finite
from erls.maths.so3 import Array

MAX_HALVINGS = 12
MAX_ITERATIONS = 10
REFRESH_COST = 6  # of a fresh iteration matrix, in iterations
TOLERATED = 3  # iterations beyond the fewest, or beyond two, on average, before a fresh matrix is worth its cost
ROUNDING = 16 * np.finfo(float).eps
SLOWEST_KNOWN, FASTEST_TRUSTED = 0.9, 1e-3  # bounds on a convergence rate carried over from earlier steps


@dataclass(frozen=True)
class Formulas:
    """Steps of ``h`` with numerical damping ``spectral_radius``; a₁ = share · v̇₁ + pull · v̇₀ + keep · a₀.

    Attributes
    ----------
    to_v, to_a : float
        γ' and β': changes of v₁ and v̇₁ with those of the increment.
    period : float
        Square root of 1/β'.
    tolerance : float
        Error at which Newton iterations end [m]. An error e of the increment is one of e β' in v̇: it falls with h³,
        like the truncation error of a step.
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
    def of(options: ConstrainedOptions, h: float) -> Formulas:
        """Coefficients for an integration's steps of ``h``."""
        rho = options.spectral_radius
        alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        beta = 0.25 * (gamma + 0.5) ** 2
        return Formulas(h, alpha_m, alpha_f, gamma, beta, options.newton_tolerance * min(1.0, max(h / 1e-3, 0.01)) ** 3)

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
    def period(self) -> float:
        return self.h * math.sqrt(self.beta * self.share)

    @property
    def error(self) -> float:
        return abs(1 / 6 - self.beta - (self.alpha_m - self.alpha_f) / 2) * self.h**2


class Limit(NamedTuple):
    """Largest local error [m], or 0 for none, and whether a larger step would be welcome."""

    error: float = 0.0
    can_grow: bool = False


DONE, FAILED, INACCURATE, TIMID = range(4)
GROWTH = 1.7
"""Ends of a stretch: all steps made; Newton's method failed; too large a local error; a step ``GROWTH`` times as large
would do."""


class Steps(Protocol):
    """What makes steps and records them: as NumPy (`lie_steps`) or compiled (`lie_compiled`)."""

    h: float
    error: float
    """Of the last step [m]."""

    def begin(self, leg: Leg, q: Configuration, v: Array) -> None:
        """Start a leg: consistent acceleration, which the algorithmic one equals."""

    def set_step(self, h: float) -> None:
        """Change the step; a₀ moves with it."""

    def stretch(self, times: Array, last: float, limit: Limit) -> tuple[int, int]:
        """Steps to ``times``, with forces up to ``last``; how many were made and recorded, and what ended them."""

    def end(self) -> tuple[Configuration, Array]:
        """Configuration and velocity."""

    def failure(self, t: float) -> SimulationError:
        """Why the step to ``t`` failed."""


def newton_failure(
    system: ConstrainedSystem, options: ConstrainedOptions, t: float, h: float, suspect: Array, reason: str
) -> SimulationError:
    """The step to ``t`` failed at the smallest step; ``suspect`` (n + m,) tells where."""
    if not np.isfinite(suspect).all():
        return not_finite(t, suspect)
    worst, n = int(np.abs(suspect).argmax()), system.size
    what = f"coordinate {worst} (counted from 0)" if worst < n else system.constraint_names[worst - n]
    frozen = options.iteration_matrix == "frozen"
    return SimulationError(
        Cause.NEWTON_FAILED,
        f"Newton's method does not converge in {what}: {reason}",
        where=f"t = {t:.9g} s",
        value=f"step {h:.3g} s",
        limit="one iteration matrix" if frozen else f"{MAX_HALVINGS} halvings of the step",
        remedy="let iteration_matrix be auto"
        if frozen
        else "check forces and stiffness that act there, for jumps without breakpoint first; then try a smaller step",
    )


def too_slow(before: float, size: float, goal: float) -> str:
    """Reason of a failure: corrections [m]."""
    return f"corrections of {before:.3g} m and {size:.3g} m do not shrink to {goal:.3g} m"


SINGULAR = "the iteration matrix is singular"
