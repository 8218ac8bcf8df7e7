"""Equations of motion as their compiled functions, where a formulation has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.maths.so3 import Array


class Quick:
    """Compiled functions with the signatures of `erls.equations.system.SecondOrderSystem`."""

    compiled: None = None  # for those who would call them as they are

    def __init__(self, system: Any) -> None:
        self.size: int = system.size
        self.length_scales, self.breakpoints = system.length_scales, system.breakpoints
        self._functions, self._system = system.compiled, system
        self._constants = self._functions.reals, self._functions.integers, self._functions.scratch

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f."""
        out = np.empty(self.size)
        self._functions.residual(*self._constants, t, y, v, a, out)
        return out

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) M⁻¹ f."""
        out = np.empty(self.size)
        if self._functions.acceleration(*self._constants, t, y, v, out):
            return np.asarray(self._system.acceleration(t, y, v))  # which names the coordinate that nothing resists
        return out

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n)."""
        out = np.empty((self.size, self.size))
        self._functions.mass_matrix(*self._constants, t, y, out)
        return out

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """(n, n) twice."""
        stiffness, damping = np.empty((2, self.size, self.size))
        self._functions.stiffness_and_damping(*self._constants, t, y, v, stiffness, damping)
        return stiffness, damping


def quick(system: Any) -> Any:
    """The system itself, or its compiled form where that is all of it."""
    whole = system.compiled is None or (getattr(system, "dry", None) is not None)
    return system if whole else Quick(system)
