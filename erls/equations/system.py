"""What equations of motion offer to whoever integrates, linearizes or watches them.

A system whose functions are compiled offers them as `erls.equations.compiled_system`; one that is plain Python enters
the same loops through `erls.equations.uncompiled`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.compiled_system import CompiledSystem


class MovingSystem(Protocol):
    """What integrators ask of independent and of constrained coordinates alike."""

    @property
    def length_scales(self) -> Array:
        """(n,) see `SecondOrderSystem`."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """See `SecondOrderSystem`."""


class SecondOrderSystem(Protocol):
    """Equations of motion M(y, t) a = f(t, y, v) in independent coordinates."""

    @property
    def size(self) -> int:
        """Number of coordinates n."""

    @property
    def length_scales(self) -> Array:
        """(n,) largest displacement in metres of any point of the mechanism per unit of each coordinate."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which forces or prescribed accelerations jump, in rising order."""

    @property
    def compiled(self) -> CompiledSystem | None:
        """The same equations in compiled form; None where there is none."""
        return None

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) generalized forces M(y, t) a - f(t, y, v)."""

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) symmetric positive definite."""

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) solution a of M a = f.

        Raises
        ------
        SimulationError
            With cause SINGULAR_MASS, naming the coordinate.
        """

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """(n, n) twice: the stiff parts of -∂f/∂y and -∂f/∂v (modal stiffness, springs, controller gains).

        They enter the iteration matrix of implicit methods only; terms left out cost iterations, not
        accuracy.
        """


def metre_scales(system: MovingSystem) -> Array:
    """(n,) ``system.length_scales``, never zero: also a coordinate that moves no point gets some metres."""
    scales: Array = np.array(system.length_scales, dtype=float)
    largest = float(scales.max(initial=0.0)) or 1.0
    bounded: Array = np.maximum(scales, 1e-6 * largest)
    return bounded
