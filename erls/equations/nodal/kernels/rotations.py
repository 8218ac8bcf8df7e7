"""Exponential, logarithm and tangent operators of one rotation vector ψ, applied to vectors.

The formulas of `erls.maths.rotation_maps`: every operator is 1 + f ψ̃ + g ψ̃² with functions f, g of x = |ψ|²
(`erls.maths.coefficients`). Its transpose has −f. Functions come with as many derivatives by x as are asked for.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from scipy.special import zeta

from erls.equations.nodal.kernels.vectors import Rotation, Vector, cross, dot, plus, scaled
from erls.maths.jit import part

Three: TypeAlias = tuple[float, float, float]
Seven: TypeAlias = tuple[float, float, float, float, float, float, float]

_SMALL, _MIDDLE = 0.25, 4.0  # squared angles up to which 6 and 12 terms of the series are exact to rounding
_FACTORIALS = tuple(1.0 / math.factorial(k) for k in range(32))
_POLE = 4 * math.pi**2
_RATIO_BELOW = 0.5  # of x to the pole
_ZETA = tuple(2.0 * float(zeta(2 * k + 2) - 1) for k in range(19))  # falls by four from term to term


@part
def stumpff(x: float) -> Seven:
    """c₁ to c₇ of a squared angle."""
    if x <= _MIDDLE:
        c6 = c7 = 0.0
        for j in range(5 if x <= _SMALL else 11, -1, -1):
            c6 = _FACTORIALS[2 * j + 6] - x * c6
            c7 = _FACTORIALS[2 * j + 7] - x * c7
        c5, c4 = _FACTORIALS[5] - x * c7, _FACTORIALS[4] - x * c6
        c3, c2 = _FACTORIALS[3] - x * c5, _FACTORIALS[2] - x * c4
        return 1.0 - x * c3, c2, c3, c4, c5, c6, c7
    angle = math.sqrt(x)
    c0, c1 = math.cos(angle), math.sin(angle) / angle
    c2, c3 = (1.0 - c0) / x, (1.0 - c1) / x
    c4, c5 = (_FACTORIALS[2] - c2) / x, (_FACTORIALS[3] - c3) / x
    return c1, c2, c3, c4, c5, (_FACTORIALS[4] - c4) / x, (_FACTORIALS[5] - c5) / x


@part
def inverse_coefficient(x: float) -> Three:
    """b(x) with two derivatives; infinite at a full turn."""
    y = x / _POLE
    if y > _RATIO_BELOW:
        half = math.sqrt(x) / 2
        b = (1.0 - half * math.cos(half) / math.sin(half)) / x
        first = (0.25 - 3 * b + x * b * b) / (2 * x)
        return b, first, (b * b - 5 * first + 2 * x * b * first) / (2 * x)
    value = slope = bend = 0.0
    for k in range(6 if x <= _SMALL else 18, -1, -1):
        bend = slope * 2 + y * bend
        slope = value + y * slope
        value = _ZETA[k] + y * value
    gap = 1.0 / (1.0 - y)
    above = (slope + 2 * gap**2) / _POLE**2, (bend + 4 * gap**3) / _POLE**3
    return (value + 2 * gap) / _POLE, above[0], above[1]


@part
def tangent_coefficients(c: Seven) -> tuple[Three, Three]:
    """f and g of the tangent operator."""
    c4_, c3_, c2_ = (4 * c[5] - c[4]) / 2, (3 * c[4] - c[3]) / 2, (2 * c[3] - c[2]) / 2
    c5_ = (5 * c[6] - c[5]) / 2
    return (-c[1], -c2_, -(2 * c4_ - c3_) / 2), (c[2], c3_, (3 * c5_ - c4_) / 2)


@part
def exponential(psi: Vector, c1: float, c2: float) -> Rotation:
    """1 + c₁ ψ̃ + c₂ ψ̃²."""
    x, y, z = psi
    a, b, c = c2 * x * x, c2 * y * y, c2 * z * z
    d, e, f = c2 * x * y, c2 * y * z, c2 * z * x
    u, v, w = c1 * x, c1 * y, c1 * z
    return 1 - b - c, d - w, f + v, d + w, 1 - a - c, e - u, f - v, e + u, 1 - a - b


@part
def logarithm(r: Rotation) -> Vector:
    """At most π long; over the largest component of the unit quaternion."""
    trace = r[0] + r[4] + r[8]
    w, x, y, z = 1 + trace, 1 + 2 * r[0] - trace, 1 + 2 * r[4] - trace, 1 + 2 * r[8] - trace
    if w >= x and w >= y and w >= z:
        x, y, z = r[7] - r[5], r[2] - r[6], r[3] - r[1]
    elif x >= y and x >= z:
        w, y, z = r[7] - r[5], r[1] + r[3], r[2] + r[6]
    elif y >= z:
        w, x, z = r[2] - r[6], r[1] + r[3], r[5] + r[7]
    else:
        w, x, y = r[3] - r[1], r[2] + r[6], r[5] + r[7]
    size = math.copysign(math.sqrt(w * w + x * x + y * y + z * z), w)
    w, x, y, z = w / size, x / size, y / size, z / size
    half = math.sqrt(x * x + y * y + z * z)
    # θ / sin(θ/2): below 1e-4 the next term of 2 (1 + s²/6) is below rounding
    factor = 2 * math.atan2(half, w) / half if half > 1e-4 else 2 + half * half / 3
    return factor * x, factor * y, factor * z


@part
def logarithm_near(r: Rotation, near: Vector) -> Vector:
    """The logarithm closest to ``near``: it may pass π, and turn on."""
    psi = logarithm(r)
    angle = math.sqrt(dot(psi, psi))
    if angle == 0.0:
        return psi
    turns = round((dot(psi, near) / angle - angle) / (2 * math.pi))
    return scaled(1.0 + 2 * math.pi * turns / angle, psi)


@part
def value(f: float, g: float, psi: Vector, a: Vector) -> Vector:
    """(1 + f ψ̃ + g ψ̃²) a."""
    s = cross(psi, a)
    return plus(plus(a, scaled(f, s)), scaled(g, cross(psi, s)))


@part
def first(f: float, f1: float, g: float, g1: float, psi: Vector, d: Vector, a: Vector) -> Vector:
    """Derivative along d of the above."""
    s, t = cross(psi, a), cross(d, a)
    along = 2 * dot(psi, d)
    mixed = plus(cross(psi, t), cross(d, s))
    result = plus(scaled(f, t), scaled(g, mixed))
    return plus(result, scaled(along, plus(scaled(f1, s), scaled(g1, cross(psi, s)))))


@part
def second(f1: float, f2: float, g: Three, psi: Vector, d: Vector, e: Vector, a: Vector) -> Vector:
    """Second derivative along d and e; f itself does not enter."""
    s, t, u = cross(psi, a), cross(d, a), cross(e, a)
    by_d, by_e, both = 2 * dot(psi, d), 2 * dot(psi, e), 2 * dot(d, e)
    result = scaled(g[0], plus(cross(d, u), cross(e, t)))
    result = plus(result, scaled(by_e, plus(scaled(f1, t), scaled(g[1], plus(cross(psi, t), cross(d, s))))))
    result = plus(result, scaled(by_d, plus(scaled(f1, u), scaled(g[1], plus(cross(psi, u), cross(e, s))))))
    straight = plus(scaled(both * f1 + by_d * by_e * f2, s), scaled(both * g[1] + by_d * by_e * g[2], cross(psi, s)))
    return plus(result, straight)
