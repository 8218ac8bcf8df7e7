"""Functions of a squared angle x = θ² that rotations are made of, accurate from θ = 0 on; real or complex.

Stumpff functions (K. Stumpff, Himmelsmechanik I, 1959, ch. V):

    c_k(x) = Σ_j (−x)^j / (2j + k)!,    c₀ = cos θ,  c₁ = sin θ / θ,  c₂ = (1 − cos θ)/θ²,  c₃ = (θ − sin θ)/θ³

with c_k = 1/k! − x c_{k+2} and dc_k/dx = (k c_{k+2} − c_{k+1})/2. The inverse of a tangent operator needs

    b(x) = (1 − (θ/2) cot(θ/2))/x = 2/(4π² − x) + Σ_k 2 (ζ(2k + 2) − 1) x^k / (2π)^(2k+2),

with its pole at θ = 2π set apart; it solves 2x b' = 1/4 − 3b + x b².

Each function is a series near zero and a closed form beyond, both without branches, so that they serve for arrays too
(`erls.maths.rotation_maps`); the choice goes by the real part, and a complex step through it is exact.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from erls.maths.jit import part

Three: TypeAlias = tuple[float, float, float]
Seven: TypeAlias = tuple[float, float, float, float, float, float, float]

FEW, MANY, CLOSED_FROM = 6, 12, 4.0
"""Terms that are exact to rounding up to `_FEW_BELOW` and up to ``CLOSED_FROM``, where the closed form takes over."""
_FEW_BELOW = 0.25
_FACTORIALS = tuple(1.0 / math.factorial(k) for k in range(32))
_POLE = 4 * math.pi**2
POLE_HALVED = 0.5 * _POLE
"""Where the closed form of the inverse coefficient takes over."""
_FEW_ZETA, MANY_ZETA = 7, 19
# 2 ζ(s) - 2 of Riemann's function at s = 2, 4, 6, ..., which falls by four from term to term
_SUMMED = (float((np.arange(2000.0, 1.0, -1.0) ** -s).sum()) for s in range(6, 2 * MANY_ZETA + 2, 2))
_ZETA = tuple(2.0 * value for value in (math.pi**2 / 6 - 1, math.pi**4 / 90 - 1, *_SUMMED))


@part
def stumpff(x: float) -> Seven:
    """c₁ to c₇ of a squared angle."""
    if x.real > CLOSED_FROM:
        return stumpff_closed(x)
    return stumpff_series(x, FEW if x.real <= _FEW_BELOW else MANY)


@part
def stumpff_series(x: float, terms: int) -> Seven:
    """c₁ to c₇: the two highest from their series, the others from them."""
    c6, c7 = 0.0 * x, 0.0 * x
    for j in range(terms - 1, -1, -1):
        c6 = _FACTORIALS[2 * j + 6] - x * c6
        c7 = _FACTORIALS[2 * j + 7] - x * c7
    c5, c4 = _FACTORIALS[5] - x * c7, _FACTORIALS[4] - x * c6
    c3, c2 = _FACTORIALS[3] - x * c5, _FACTORIALS[2] - x * c4
    return 1.0 - x * c3, c2, c3, c4, c5, c6, c7


@part
def stumpff_closed(x: float) -> Seven:
    """c₁ to c₇ from cosine and sine."""
    angle = np.sqrt(x)
    c0, c1 = np.cos(angle), np.sin(angle) / angle
    c2, c3 = (1.0 - c0) / x, (1.0 - c1) / x
    c4, c5 = (_FACTORIALS[2] - c2) / x, (_FACTORIALS[3] - c3) / x
    return c1, c2, c3, c4, c5, (_FACTORIALS[4] - c4) / x, (_FACTORIALS[5] - c5) / x


@part
def tangent_coefficients(c: Seven) -> tuple[Three, Three]:
    """f = −c₂ and g = c₃ of the tangent operator 1 + f ψ̃ + g ψ̃², each with two derivatives by x."""
    c4_, c3_, c2_ = (4 * c[5] - c[4]) / 2, (3 * c[4] - c[3]) / 2, (2 * c[3] - c[2]) / 2
    c5_ = (5 * c[6] - c[5]) / 2
    return (-c[1], -c2_, -(2 * c4_ - c3_) / 2), (c[2], c3_, (3 * c5_ - c4_) / 2)


@part
def inverse_coefficient(x: float) -> Three:
    """b(x) with two derivatives; infinite at a full turn."""
    if x.real > POLE_HALVED:
        return inverse_closed(x)
    return inverse_series(x, _FEW_ZETA if x.real <= _FEW_BELOW else MANY_ZETA)


@part
def inverse_series(x: float, terms: int) -> Three:
    """b(x) with two derivatives: the pole, and the series of what is left."""
    y = x / _POLE
    value, slope, bend = 0.0 * x, 0.0 * x, 0.0 * x
    for k in range(terms - 1, -1, -1):
        bend = slope * 2 + y * bend
        slope = value + y * slope
        value = _ZETA[k] + y * value
    gap = 1.0 / (1.0 - y)
    above = (slope + 2 * gap**2) / _POLE**2, (bend + 4 * gap**3) / _POLE**3
    return (value + 2 * gap) / _POLE, above[0], above[1]


@part
def inverse_closed(x: float) -> Three:
    """b(x) with two derivatives, which follow from its differential equation."""
    half = np.sqrt(x) / 2
    b = (1.0 - half * np.cos(half) / np.sin(half)) / x
    first = (0.25 - 3 * b + x * b * b) / (2 * x)
    return b, first, (b * b - 5 * first + 2 * x * b * first) / (2 * x)


@part
def angle_of(sine: float, cosine: float) -> float:
    """Angle of a point (cosine, sine) of any size, from −π to π; with complex numbers, of small imaginary parts.

    The angle of the real parts, and the one from there, whose tangent is zero for real numbers.
    """
    s, c = sine.real, cosine.real
    rest = (sine * c - cosine * s) / (cosine * c + sine * s)
    angle: float = np.arctan2(s, c) + rest * (1.0 - rest * rest / 3)
    return angle
