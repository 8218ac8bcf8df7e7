"""Small mechanical systems with known behaviour, for tests of integrators."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from erls.equations.system import SecondOrderSystem
from erls.maths.so3 import Array


class Modes(SecondOrderSystem):
    """Uncoupled oscillators q̈ + 2ζω q̇ + ω² q = force(t), of unit mass and one metre per unit."""

    def __init__(
        self,
        omega: list[float],
        zeta: float = 0.0,
        force: Callable[[float], float] = lambda t: 0.0,
        breakpoints: tuple[float, ...] = (),
    ) -> None:
        self.omega, self.zeta, self.force, self._breakpoints = np.array(omega), zeta, force, breakpoints

    size = property(lambda self: len(self.omega))
    length_scales = property(lambda self: np.ones(self.size))
    breakpoints = property(lambda self: self._breakpoints)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        return self.force(t) - 2 * self.zeta * self.omega * v - self.omega**2 * y

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        return a - self.acceleration(t, y, v)

    def mass_matrix(self, t: float, y: Array) -> Array:
        return np.eye(self.size)

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        return np.diag(self.omega**2), np.diag(2 * self.zeta * self.omega)


class Law(Modes):
    """One coordinate of unit mass with acceleration ``law(t, y, v)``; no stiffness is told."""

    def __init__(
        self, law: Callable[[float, float, float], float], breakpoints: tuple[float, ...] = ()
    ) -> None:
        super().__init__([0.0], breakpoints=breakpoints)
        self.law = law

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        return np.array([self.law(t, y[0], v[0])])


class DoublePendulum(SecondOrderSystem):
    """Two unit point masses on massless rods of length 1 m; absolute angles from the vertical; g = 9.81 m/s².

    The mass matrix depends on the angles, and the integrator is told of no stiffness.
    """

    size = 2
    length_scales = np.array([2.0, 1.0])
    breakpoints: tuple[float, ...] = ()
    gravity = 9.81

    def mass_matrix(self, t: float, y: Array) -> Array:
        c = np.cos(y[0] - y[1])
        return np.array([[2.0, c], [c, 1.0]])

    def forces(self, y: Array, v: Array) -> Array:
        s = np.sin(y[0] - y[1])
        g = self.gravity * np.sin(y)
        return np.array([-s * v[1] ** 2 - 2 * g[0], s * v[0] ** 2 - g[1]])

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        return np.linalg.solve(self.mass_matrix(t, y), self.forces(y, v))

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        return self.mass_matrix(t, y) @ a - self.forces(y, v)

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        return np.zeros((2, 2)), np.zeros((2, 2))

    def energy(self, y: Array, v: Array) -> Array:
        """(k,) for knots (k, 2)."""
        kinetic = v[:, 0] ** 2 + v[:, 1] ** 2 / 2 + np.cos(y[:, 0] - y[:, 1]) * v[:, 0] * v[:, 1]
        return kinetic - self.gravity * (2 * np.cos(y[:, 0]) + np.cos(y[:, 1]))


class ElasticPendulum(SecondOrderSystem):
    """A unit mass on a spring of unit length: angle from the vertical and elongation; stiff and nonlinear."""

    size = 2
    length_scales = np.array([1.0, 1.0])
    breakpoints: tuple[float, ...] = ()
    gravity = 9.81

    def __init__(self, omega: float, zeta: float = 0.0) -> None:
        self.omega, self.zeta = omega, zeta

    def mass_matrix(self, t: float, y: Array) -> Array:
        return np.diag([(1 + y[1]) ** 2, 1.0])

    def forces(self, y: Array, v: Array) -> Array:
        r = 1 + y[1]
        return np.array(
            [
                -2 * r * v[0] * v[1] - self.gravity * r * np.sin(y[0]),
                r * v[0] ** 2
                + self.gravity * np.cos(y[0])
                - self.omega**2 * y[1]
                - 2 * self.zeta * self.omega * v[1],
            ]
        )

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        return self.forces(y, v) / self.mass_matrix(t, y).diagonal()

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        return self.mass_matrix(t, y) @ a - self.forces(y, v)

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        return np.diag([0.0, self.omega**2]), np.diag([0.0, 2 * self.zeta * self.omega])
