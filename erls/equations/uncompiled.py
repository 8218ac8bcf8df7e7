"""Any system with the signatures of `erls.equations.compiled_system`, for loops that run as plain Python."""

from __future__ import annotations

import numpy as np

from erls.equations.compiled_system import CompiledSystem, IntArray
from erls.equations.system import SecondOrderSystem
from erls.maths.so3 import Array


def uncompiled(system: SecondOrderSystem) -> CompiledSystem:
    """The functions of a system; what it raises goes through."""
    none: IntArray = np.zeros(0, dtype=np.int64)

    def residual(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
    ) -> None:
        out[:] = system.residual(t, y, v, a)

    def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
        out[:] = system.mass_matrix(t, y)

    def stiffness_and_damping(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
    ) -> None:
        k[:], c[:] = system.stiffness_and_damping(t, y, v)

    def acceleration(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
    ) -> int:
        out[:] = system.acceleration(t, y, v)
        return 0

    empty = np.zeros(0)
    return CompiledSystem(
        system.size, empty, none, empty, residual, mass_matrix, stiffness_and_damping, lambda: acceleration
    )


