"""The turn about z of a rotation Q, by its entries, and what a thread makes of it.

    ψ = arg Z,    Z = (Q₀₀ + Q₁₁) + i (Q₁₀ - Q₀₁)

is the angle of a rotation about z, and smooth where z axes part a little, as those of conditions do that are yet to be
closed; it is undefined where they point opposite ways. With Q̇ = Q ω̃ and ρ = (Q₀₂ + i Q₁₂)/Z

    ψ̇ = ω₂ - Re ρ ω₀ - Im ρ ω₁,    ρ̇ = (ω₁ (Q₀₀ + i Q₁₀) - ω₀ (Q₀₁ + i Q₁₁))/Z - i ω₂ ρ + (ω₁ + i ω₀) ρ².

The parts of complex numbers are written out, since the entries may be complex themselves for complex steps.
"""

from __future__ import annotations

import numpy as np

from erls.maths.coefficients import angle_of
from erls.maths.jit import part
from erls.maths.vectors import Rotation, Vector


@part
def _over(q: Rotation, real: float, imaginary: float) -> tuple[float, float]:
    """(real + i imaginary)/Z."""
    k, s = q[0] + q[4], q[3] - q[1]
    square = k * k + s * s
    return (k * real + s * imaginary) / square, (k * imaginary - s * real) / square


@part
def turn_gradient(q: Rotation) -> Vector:
    """Derivatives of the turn along ω."""
    x, y = _over(q, q[2], q[5])
    return -x, -y, 1.0 + 0.0 * x


@part
def turn_gradient_change(q: Rotation, w: Vector) -> Vector:
    """Derivative of `turn_gradient` as the frame turns by ω."""
    x, y = _over(q, q[2], q[5])
    p, r = _over(q, w[1] * q[0] - w[0] * q[1], w[1] * q[3] - w[0] * q[4])
    a, b = x * x - y * y, 2 * x * y
    change = p + w[2] * y + w[1] * a - w[0] * b
    return -change, w[2] * x - r - w[1] * b - w[0] * a, 0.0 * change


@part
def off_thread(slide: float, pitch: float, q: Rotation) -> float:
    """How far ``slide`` is from the nearest turn of a thread, at half a lead 2π pitch at most.

    All that a nut can do at one ψ is to be whole leads away, so that this is zero in all of its poses, and in no other.
    """
    left = slide - pitch * angle_of(q[3] - q[1], q[0] + q[4])
    lead = 2 * np.pi * pitch
    rest: float = left - lead * np.floor((left / lead).real + 0.5)
    return rest
