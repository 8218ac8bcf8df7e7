"""Exact tangents of the equations of motion along a run: ∂R/∂a, ∂R/∂v and ∂R/∂y of R = M a - f at its knots.

The iteration matrices of implicit methods leave out what only costs iterations (gyroscopic, centrifugal, geometric
terms); derivatives of a run need all of it. Where a run is long enough to be worth the second that it takes, a program
made of R itself gives it to rounding (`erls.equations.taped`); otherwise R is evaluated at many states in one call
(`erls.equations.series.residual_series`) and differenced as in `erls.equations.linearization`, there with its accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.linearization import difference_steps
from erls.equations.series import mass_series, residual_series
from erls.equations.side_by_side import eightfold_forces, eightfold_kernels
from erls.equations.taped import taped_tangents, worth_taping
from erls.maths.so3 import Array

_ROUGHER = 5.0
"""Times the steps of `difference_steps`: rounding and the third derivative take equal shares of 1e-11 then."""


class Tangents(NamedTuple):
    """(k, n, n) ∂R/∂a, ∂R/∂v, ∂R/∂y at k knots."""

    mass: Array
    damping: Array
    stiffness: Array


class Knots(NamedTuple):
    """(k,) times at which forces are asked for, (k, n) coordinates, rates and accelerations."""

    t: Array
    y: Array
    v: Array
    a: Array


@dataclass(frozen=True)
class Evaluation:
    """How forces and tangents of a run are found.

    Attributes
    ----------
    steps : (n,) array
        Of differences, `steps_of`.
    kernels : module or None
        Of eightfold numbers; None where a system has none, or where they are not worth it.
    taped : bool
        Whether tangents come from a tape, if it can be made.
    """

    steps: Array
    kernels: Any = None
    taped: bool = False

    @classmethod
    def of(cls, system: CompiledSystem, steps: Array, knots: int) -> Evaluation:
        """For a run with so many knots."""
        asked = 4 * system.size * knots
        kernels = eightfold_kernels(system, asked)
        loops = hasattr(system, "called") and worth_taping(asked)
        return cls(steps, kernels, kernels is not None or loops)

    @property
    def complex_steps(self) -> bool:
        """Whether forces of complex numbers are worth their compilation: twice as dear as real ones, one by one."""
        return self.taped and self.kernels is None

    def forces(self, system: CompiledSystem, knots: Knots) -> Array:
        """(k, n) forces out of balance, of equations of the same kind."""
        if self.kernels is None:
            return residual_series(system, *knots)
        return eightfold_forces(self.kernels, system, *knots)

    def tangents(self, system: CompiledSystem, knots: Knots) -> Tangents:
        """At all knots."""
        t, y, v, a = knots
        found = taped_tangents(system, *knots) if self.taped else None
        if found is not None:
            stiffness, damping, mass = (np.ascontiguousarray(x) for x in np.split(found, 3, axis=2))
            return Tangents(mass, damping, stiffness)
        mass = mass_series(system, t, y)
        n = y.shape[1]
        damping, stiffness = np.empty((2, len(t), n, n))
        for j in range(n):
            damping[:, :, j] = difference(lambda x: residual_series(system, t, y, x, a), v, j, self.steps[j])
            stiffness[:, :, j] = difference(lambda x: residual_series(system, t, x, v, a), y, j, self.steps[j])
        return Tangents(mass, damping, stiffness)


def difference(forces, x: Array, place: int, step: float) -> Array:  # type: ignore[no-untyped-def]
    """(k, n) central difference of forces (k, n) of states (k, n) by one of their coordinates."""
    above, below = x.copy(), x.copy()
    above[:, place] += step
    below[:, place] -= step
    taken = above[:, place] - below[:, place]  # what rounding leaves of two steps
    return np.asarray((forces(above) - forces(below)) / taken[:, None])


def steps_of(metres: Array, size: float, stiffness: Array) -> Array:
    """(n,) steps of differences of coordinates and of rates [m/s per m of the coordinate].

    Parameters
    ----------
    metres, size, stiffness
        As of `erls.equations.linearization.difference_steps`.
    """
    return _ROUGHER * difference_steps(metres, size, stiffness)
