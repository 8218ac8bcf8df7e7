"""The contract between constrained equations of motion (index-3 DAEs on a Lie group) and their integrators.

    M(q) a = f(t, q, v) - B(t, q)ᵀ λ,    Φ(t, q) = 0,    q̇ = q · ṽ

A configuration q is whatever the system stores (positions, rotation matrices, modal coordinates); velocities v and
increments live in Rⁿ, and ``compose`` applies an increment. Floating frames and nodal frames alike are such systems.
The rules 2 to 7 of `erls.integrators.base` hold here too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
import scipy.sparse as sp

from erls.errors import Cause, SceneError
from erls.integrators.base import Array, Options, Solution

Matrix: TypeAlias = Array | sp.csc_array
Configuration: TypeAlias = Any  # never changed in place


class ConstrainedSystem(Protocol):
    """Equations of motion with constraints, in redundant coordinates."""

    @property
    def size(self) -> int:
        """Number of velocity coordinates n."""

    @property
    def constraints(self) -> int:
        """Number of constraints m."""

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """(m,) what each constraint is, for messages."""

    @property
    def length_scales(self) -> Array:
        """(n,) largest displacement in metres of any point of the mechanism per unit of each increment."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which forces or prescribed accelerations jump, in rising order."""

    def compose(self, q: Configuration, increment: Array) -> Configuration:
        """q ∘ exp(increment)."""

    def tangent(self, increment: Array) -> Matrix | None:
        """(n, n) T: variation of q ∘ exp(increment) = T · variation of the increment; None where it is 1."""

    def residual(self, t: float, q: Configuration, v: Array, a: Array) -> Array:
        """(n,) M a - f, without the forces of the constraints."""

    def mass_matrix(self, t: float, q: Configuration) -> Matrix:
        """(n, n) symmetric."""

    def stiffness_and_damping(
        self, t: float, q: Configuration, v: Array, a: Array, multipliers: Array
    ) -> tuple[Matrix, Matrix]:
        """(n, n) twice: derivatives of residual + Bᵀλ by an increment of q and by v.

        They enter the iteration matrix only; terms left out cost iterations, not accuracy.
        """

    def constraint(self, t: float, q: Configuration) -> Array:
        """(m,) Φ."""

    def constraint_matrix(self, t: float, q: Configuration) -> Matrix:
        """(m, n) B: Φ̇ = B v + Φ_t."""

    def constraint_rate(self, t: float, q: Configuration) -> Array:
        """(m,) Φ_t: partial derivative by time."""

    def constraint_bias(self, t: float, q: Configuration, v: Array) -> Array:
        """(m,) Φ̈ - B a."""

    def stored(self, t: float, q: Configuration, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(s,) three times: what a `Solution` keeps of a knot, with its first and second derivative by time.

        Quintic Hermite interpolation through them must be as accurate as the method: rotations go in as the nine
        entries of their matrix, or as joint angles.
        """


MATRICES = ("auto", "update", "frozen")
STARTS = ("zero", "last")


@dataclass(frozen=True)
class ConstrainedOptions(Options):
    """Settings of an integration with constraints.

    Attributes
    ----------
    iteration_matrix : str
        ``update``: a new one in every Newton iteration; ``frozen``: one for all steps of a size; ``auto``: a new one
        when iteration has become slow.
    residual_tolerance : float
        Newton iterations stop, too, when the residual is below this times the sum of the norms of its terms.
    project_velocity : bool
        Move velocities onto the constraints after every step; otherwise they keep to them within the accuracy of
        the method.
    start_from : str
        Newton iterations start from ``zero`` accelerations and multipliers or from the ``last`` ones, which lie nearer.
    error_tolerance : float or None
        Largest local error of a step [m]: steps adapt to it, ``step`` being the largest. None for equal steps.
    compiled : bool or None
        Whether to use compiled kernels where a system has them; None where the compiler is on (`erls.kernels.jit`).

    Raises
    ------
    SceneError
        With cause BAD_FIELD, naming the setting.
    """

    iteration_matrix: str = "auto"
    residual_tolerance: float = 1e-10
    project_velocity: bool = False
    start_from: str = "zero"
    error_tolerance: float | None = None
    compiled: bool | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        checks = (
            (
                "iteration_matrix",
                self.iteration_matrix,
                self.iteration_matrix in MATRICES,
                f"one of {', '.join(MATRICES)}",
            ),
            (
                "residual_tolerance",
                self.residual_tolerance,
                0 <= self.residual_tolerance < 1,
                "zero or more, and below 1",
            ),
            ("start_from", self.start_from, self.start_from in STARTS, f"one of {', '.join(STARTS)}"),
            (
                "error_tolerance",
                self.error_tolerance,
                self.error_tolerance is None or self.error_tolerance > 0,
                "a positive number of metres",
            ),
        )
        for name, value, ok, right in checks:
            if not ok:
                message = "the integrator cannot work with this value"
                raise SceneError(
                    Cause.BAD_FIELD, message, where=f"options.{name}", value=value, remedy=f"must be {right}"
                )


class ConstrainedState(NamedTuple):
    """Configuration, velocity (n,), acceleration (n,) and multipliers (m,)."""

    q: Configuration
    v: Array
    a: Array
    multipliers: Array


@dataclass(frozen=True)
class ConstrainedSolution(Solution):
    """Knots of what the system stores, with rates (k, n) of the velocities v and multipliers (k, m) there."""

    accelerations: Array = field(default_factory=lambda: np.zeros((0, 0)))
    multipliers: Array = field(default_factory=lambda: np.zeros((0, 0)))
