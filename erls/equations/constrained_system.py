"""The contract between constrained equations of motion (index-3 DAEs on a Lie group) and whoever solves them.

    M(q) a = f(t, q, v) - B(t, q)ᵀ λ,    Φ(t, q) = 0,    q̇ = q · ṽ

A configuration q is whatever the system stores (positions, rotation matrices, modal coordinates); velocities v and
increments live in Rⁿ, and ``compose`` applies an increment. Floating frames and nodal frames alike are such systems.
The rules 2 to 7 of `erls.integrate.base` hold here too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias, runtime_checkable

from erls.maths.saddle import Matrix
from erls.maths.so3 import Array

if TYPE_CHECKING:  # they import the compiler
    from erls.equations.stepped import Stepped
    from erls.equations.switches.base import Switches

Configuration: TypeAlias = Any  # never changed in place


class ConstrainedSystem(Protocol):
    """Equations of motion with constraints, in redundant coordinates."""

    @property
    def compiled(self) -> Stepped | None:
        """The same in compiled form, for one run; None where there is none."""
        return None

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

    def places(self, stored: Array) -> Array:
        """(k, p, 3) points [m] of what is stored of k knots (k, s): the error of a run is told at these."""


@runtime_checkable
class SwitchedSystem(ConstrainedSystem, Protocol):
    """A system what acts in whose joints has modes."""

    @property
    def switches(self) -> Switches | None:
        """Modes (`erls.equations.switches.base`), at what is stored of knots; None where there are none after all."""

    @property
    def unlocked(self) -> ConstrainedSystem:
        """The same without conditions that come and go with modes."""

    def from_stored(self, y: Array, v: Array) -> tuple[Configuration, Array]:
        """Configuration and velocity from what `stored` gives, interpolated or not."""

    def driven(self, t: float, q: Configuration, v: Array) -> tuple[Array, Array]:
        """Accelerations (n,) and multipliers (m,) with the present modes."""


class ConstrainedState(NamedTuple):
    """Configuration, velocity (n,), acceleration (n,) and multipliers (m,)."""

    q: Configuration
    v: Array
    a: Array
    multipliers: Array
