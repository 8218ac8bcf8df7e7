"""Models of the tests of inverse dynamics, made of nothing that `erls.inverse` is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from erls.maths.so3 import Array

_NINE = Polynomial([0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0])


def nine(t: Array, angle: float, start: float, duration: float) -> tuple[Array, Array, Array]:
    """A polynomial of degree 9 from 0 to an angle, with two derivatives."""
    x = np.clip((t - start) / duration, 0.0, 1.0)
    return tuple(angle * _NINE.deriv(k)(x) / duration**k if k else angle * _NINE(x) for k in range(3))  # type: ignore[return-value]


@dataclass(frozen=True)
class LinearArm:
    """M q̈ + K q = b u, y = c q: a hub that turns by θ = q₀, and the nodes of a beam in its axes, q₁ ...: deflections
    and slopes of four Euler-Bernoulli elements; rotations of the hub small, no axial motion, no damping.
    """

    mass: Array
    stiffness: Array
    drive: Array
    output: Array

    @classmethod
    def made(cls) -> LinearArm:
        """E = 70 GPa, ρ = 2700 kg/m³, 40 x 4 mm, 1 m; tip 0.15 kg, hub 0.05 kg m²; y = θ + w / L."""
        youngs_modulus, density, width, height, length, count = 70e9, 2700.0, 0.04, 0.004, 1.0, 4
        bending, line = youngs_modulus * width * height**3 / 12, density * width * height
        e, n = length / count, 2 * (count + 1)
        units = np.outer(*([1.0, e, 1.0, e],) * 2)
        heavy = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
        heavy = line * e / 420 * units * heavy
        stiff = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
        stiff = bending / e**3 * units * stiff
        mass, stiffness = np.zeros((2, n, n))
        for k in range(count):
            at = slice(2 * k, 2 * k + 4)
            mass[at, at] += heavy
            stiffness[at, at] += stiff
        mass[-2, -2] += 0.15
        turned = np.zeros(n)
        turned[::2], turned[1::2] = np.linspace(0.0, length, count + 1), 1.0
        moves = np.column_stack([turned, np.eye(n)[:, 2:]])
        mass = moves.T @ mass @ moves
        mass[0, 0] += 0.05
        whole = np.zeros((n - 1, n - 1))
        whole[1:, 1:] = stiffness[2:, 2:]
        drive, output = np.zeros((2, n - 1))
        drive[0] = output[0] = 1.0
        output[-2] = 1 / length
        return cls(mass, whole, drive, output)

    def internal(self) -> tuple[Array, Array, Array]:
        """ẅ = A w + B y + C ÿ of the deflections w where y is held: (m, m), (m,), (m,)."""
        back = np.eye(len(self.mass))
        back[0, 1:] = -self.output[1:]  # q of (y, w)
        left = np.hstack([self.output[1:, None], np.eye(len(back) - 1)])  # across the drive, which is (1, -c) there
        mass, stiffness = (left @ back.T @ part @ back for part in (self.mass, self.stiffness))
        inverse = np.linalg.inv(mass[:, 1:])
        return -inverse @ stiffness[:, 1:], -inverse @ stiffness[:, 0], -inverse @ mass[:, 0]

    def torque(self, y: Array, w: Array, faster: Array, bent: Array) -> Array:
        """(k,) of y, w and their second derivatives: the row of the hub."""
        q, a = (np.column_stack([one - x @ self.output[1:], x]) for one, x in ((y, w), (faster, bent)))
        return np.asarray(a @ self.mass[0] + q @ self.stiffness[0])

    def forward(self, t: Array, u: Array) -> Array:
        """(k,) output from rest under torques at even times, by the trapezoidal rule."""
        h = float(t[1] - t[0])
        q, v = np.zeros((2, len(self.mass)))
        a = np.linalg.solve(self.mass, self.drive * u[0])
        step = np.linalg.inv(self.mass + h * h / 4 * self.stiffness)
        found = [0.0]
        for force in u[1:]:
            near, rate = q + h * v + h * h / 4 * a, v + h / 2 * a
            a = step @ (self.drive * force - self.stiffness @ near)
            q, v = near + h * h / 4 * a, rate + h / 2 * a
            found.append(float(self.output @ q))
        return np.array(found)


@dataclass
class LinearField:
    """ẋ = A x + f(t) of (w, ẇ), as `erls.inverse.two_point.collocate` takes it."""

    matrix: Array
    force: Array
    x: Array | None = None

    def look(self, x: Array) -> None:
        """See `Field`."""
        self.x = x

    def learn(self, knots: Any) -> None:
        """Nothing: it is linear."""

    def slopes(self, x: Array) -> Array:
        """See `Field`."""
        return x @ self.matrix.T + self.force

    def tangents(self) -> Array:
        """See `Field`."""
        return np.broadcast_to(self.matrix, (len(self.force), *self.matrix.shape))

    def move(self, step: Array) -> float:
        """Nothing else moves."""
        return 0.0


class PassiveArm:
    """Two uniform slender links of 1 m and 1 kg, a passive joint of 50 N m/rad and 0.25 N m s; y = α + β / 2."""

    stiffness, damping = 50.0, 0.25

    def terms(self, angle: Array, turn: Array, bend: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Mass matrix a, b, c and forces f, g: a α̈ + b β̈ + f = u, b α̈ + c β̈ + g = 0, of β, α̇, β̇."""
        cosine, sine = np.cos(angle), np.sin(angle)
        a, b, c = 5 / 3 + cosine, 1 / 3 + cosine / 2, np.full_like(angle, 1 / 3)
        f = -sine * (turn * bend + bend**2 / 2)
        return a, b, c, f, sine * turn**2 / 2 + self.stiffness * angle + self.damping * bend

    def internal(self, angle: Array, bend: Array, y: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        """β̈ and the torque where y is held."""
        a, b, c, f, g = self.terms(angle, y[1] - bend / 2, bend)
        faster = -(b * y[2] + g) / (c - b / 2)
        return faster, a * (y[2] - faster / 2) + b * faster + f
