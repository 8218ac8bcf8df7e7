"""A stiff nonlinear system in compiled form, and the same called from Python."""

from __future__ import annotations

import math

import numpy as np
from small_systems import ElasticPendulum

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import CompiledSystem, IntArray
from erls.maths.jit import helper, kernel
from erls.maths.so3 import Array

GRAVITY = ElasticPendulum.gravity


@helper
def forces(reals: Array, y: Array, v: Array, out: Array) -> None:
    """As `ElasticPendulum.forces`; ``reals`` holds ω and ζ."""
    omega, zeta, r = reals[0], reals[1], 1 + y[1]
    out[0] = -2 * r * v[0] * v[1] - GRAVITY * r * math.sin(y[0])
    out[1] = r * v[0] ** 2 + GRAVITY * math.cos(y[0]) - omega**2 * y[1] - 2 * zeta * omega * v[1]


@kernel(contract.RESIDUAL)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    forces(reals, y, v, out)
    out[0] = (1 + y[1]) ** 2 * a[0] - out[0]
    out[1] = a[1] - out[1]


@kernel(contract.MASS_MATRIX)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    out[:, :] = 0.0
    out[0, 0], out[1, 1] = (1 + y[1]) ** 2, 1.0


@kernel(contract.STIFFNESS_AND_DAMPING)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    k[:, :] = 0.0
    c[:, :] = 0.0
    k[1, 1], c[1, 1] = reals[0] ** 2, 2 * reals[1] * reals[0]


@kernel(contract.ACCELERATION)
def acceleration(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
) -> int:
    forces(reals, y, v, out)
    out[0] /= (1 + y[1]) ** 2
    return 0


class TwinPendulum(ElasticPendulum):
    """The same equations, called one by one from Python: to the last digit those of the compiled loop."""

    def kernels(self) -> CompiledSystem:
        reals = np.array([self.omega, self.zeta])
        none: IntArray = np.zeros(0, dtype=np.int64)
        functions = (residual, mass_matrix, stiffness_and_damping, acceleration)
        return CompiledSystem(2, reals, none, np.zeros(0), *functions)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        system, out = self.kernels(), np.zeros(2)
        system.residual(system.reals, system.integers, system.scratch, t, y, v, a, out)
        return out


class CompiledElasticPendulum(TwinPendulum):
    """In compiled form."""

    @property
    def compiled(self) -> CompiledSystem:
        return self.kernels()
