"""Motion of an interface node in the floating frame: displaced by u, turned by exp(φ), both linear in η, or of second
order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array, cross, skew
from erls.mechanism.links import Link, node_shape6

_SERIES = 0.5  # rad²; below, six to nine terms give full precision
_A = [(-1) ** k / math.factorial(2 * k + 2) for k in range(9)]
_B = [(-1) ** k / math.factorial(2 * k + 3) for k in range(9)]


def _horner(coefficients: list[float], s: float) -> tuple[float, float]:
    """Value and derivative of a polynomial with rising powers."""
    value = slope = 0.0
    for c in reversed(coefficients):
        slope = slope * s + value
        value = value * s + c
    return value, slope


def turn_factors(s: float) -> tuple[float, float, float, float]:
    """a = (1 - cos φ)/φ², b = (φ - sin φ)/φ³ and their derivatives by s = φ²."""
    if s < _SERIES:
        return *_horner(_A, s), *_horner(_B, s)
    angle = math.sqrt(s)
    sine, cosine = math.sin(angle) / angle, math.cos(angle)
    a, b = (1 - cosine) / s, (1 - sine) / s
    return a, (sine / 2 - a) / s, b, ((sine - cosine) / (2 * s) - b) / s


@dataclass(frozen=True)
class Displaced:
    """A displaced interface node.

    Attributes
    ----------
    pose : (4, 4) array
        In the floating frame.
    jacobian : (6, n) array
        Twist relative to that frame per η̇, in the node's axes.
    bias : (6,) array
        Derivative of that twist at η̈ = 0.
    """

    pose: Array
    jacobian: Array
    bias: Array


class InterfaceMotion:
    """How an interface node moves with η.

    Parameters
    ----------
    position : (3,) array
        Undeformed, in the floating frame.
    translation, rotation : (3, n) arrays
        u and φ per elastic coordinate.
    second_order : (6, n, n) array, optional
        Ψ of u and φ, which gain ½ ηᵀ Ψ η.
    """

    def __init__(
        self, position: Array, translation: Array, rotation: Array, second_order: Array | None = None
    ) -> None:
        self.position, self.translation, self.rotation = position, translation, rotation
        self.second_order = second_order

    def at(self, eta: Array, rate: Array) -> Displaced:
        """The node at elastic coordinates η and their rates, (n,) each."""
        translation, rotation = self.translation, self.rotation
        u, phi = translation @ eta, rotation @ eta
        if self.second_order is not None:
            slope = self.second_order @ eta
            u, phi = u + slope[:3] @ eta / 2, phi + slope[3:] @ eta / 2
            translation, rotation = translation + slope[:3], rotation + slope[3:]
        phi_rate = rotation @ rate
        s, s_rate = float(phi @ phi), 2 * float(phi @ phi_rate)
        a, a_slope, b, b_slope = turn_factors(s)
        tilde = skew(phi)
        square = tilde @ tilde
        turn = (1 - s * b) * tilde + a * square
        turn.flat[::4] += 1.0
        tangent = b * square - a * tilde  # ω = T(φ) φ̇ in the node's axes
        tangent.flat[::4] += 1.0

        jacobian = np.empty((6, len(eta)))
        jacobian[:3] = turn.T @ translation
        jacobian[3:] = tangent @ rotation
        twist = jacobian @ rate
        once = cross(phi, phi_rate)
        twice = cross(phi, once)
        bias = np.empty(6)
        bias[:3] = cross(twist[:3], twist[3:])
        bias[3:] = (b_slope * twice - a_slope * once) * s_rate + b * cross(phi_rate, once)
        if self.second_order is not None:
            curved = (self.second_order @ rate) @ rate
            bias[:3] += turn.T @ curved[:3]
            bias[3:] += tangent @ curved[3:]

        pose = np.eye(4)
        pose[:3, :3] = turn
        pose[:3, 3] = self.position + u
        return Displaced(pose, jacobian, bias)


def node_motion(link: Link, node: int, basis: Array, stiffened: bool) -> InterfaceMotion:
    """Motion of a node of a link whose elastic coordinates stand for the fields ``basis`` (m, n)."""
    translation, rotation = node_shape6(link.model, node)
    second = None
    if stiffened and link.second_order is not None:
        second = basis.T @ link.second_order.node(node) @ basis
    return InterfaceMotion(link.model.nodes[node], translation @ basis, rotation @ basis, second)


def bracket(a: Array, b: Array) -> Array:
    """(6,) Lie bracket of two twists [v; ω]."""
    return np.concatenate([cross(a[3:], b[:3]) + cross(a[:3], b[3:]), cross(a[3:], b[3:])])
