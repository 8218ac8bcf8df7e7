"""Rotations: exponential, logarithm and tangent operators of one rotation vector ψ, applied to vectors.

ψ of length θ stands for R = exp(ψ̃). With R moving, Rᵀ Ṙ = ω̃ and ω = T(ψ) ψ̇:

    exp ψ̃ = 1 + c₁ ψ̃ + c₂ ψ̃²,    T = 1 − c₂ ψ̃ + c₃ ψ̃²,    T⁻¹ = 1 + ψ̃/2 + b ψ̃²

(A. Iserles, H. Munthe-Kaas, S. Nørsett, A. Zanna, Acta Numerica 2000, app. B). T is singular at θ = 2π, where its
inverse has a pole; a logarithm stays within π. Every operator is 1 + f ψ̃ + g ψ̃² with functions f, g of x = θ², which
come with as many derivatives by x as are asked for (`erls.maths.coefficients`); its transpose has −f.
One matrix for each of many vectors: `erls.maths.rotation_maps`.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from erls.maths.coefficients import Three, angle_of
from erls.maths.jit import part
from erls.maths.vectors import Rotation, Vector, cross, dot, plus, product, scaled

Quaternion: TypeAlias = tuple[float, float, float, float]

FACTOR_FROM = 1e-8
"""Square of sin(θ/2) below which the next term of θ / sin(θ/2) = 2 (1 + s²/6) is below rounding."""


@part
def exponential(psi: Vector, c1: float, c2: float) -> Rotation:
    """1 + c₁ ψ̃ + c₂ ψ̃²."""
    x, y, z = psi
    a, b, c = c2 * x * x, c2 * y * y, c2 * z * z
    d, e, f = c2 * x * y, c2 * y * z, c2 * z * x
    u, v, w = c1 * x, c1 * y, c1 * z
    return 1 - b - c, d - w, f + v, d + w, 1 - a - c, e - u, f - v, e + u, 1 - a - b


@part
def turned_further(r: Rotation, psi: Vector, c1: float, c2: float) -> Rotation:
    """R exp(ψ̃), orthogonal to rounding however often it is turned."""
    r = product(r, exponential(psi, c1, c2))
    x, y, z = (r[0], r[3], r[6]), (r[1], r[4], r[7]), (r[2], r[5], r[8])
    xx, yy, zz = 1.5 - 0.5 * dot(x, x), 1.5 - 0.5 * dot(y, y), 1.5 - 0.5 * dot(z, z)
    xy, yz, zx = -0.5 * dot(x, y), -0.5 * dot(y, z), -0.5 * dot(z, x)
    return product(r, (xx, xy, zx, xy, yy, yz, zx, yz, zz))


@part
def quaternions(r: Rotation) -> tuple[Quaternion, Quaternion, Quaternion, Quaternion]:
    """Columns of 4 q qᵀ, scalar first: the unit quaternion q of a rotation, four times and of different lengths."""
    trace = r[0] + r[4] + r[8]
    wx, wy, wz = r[7] - r[5], r[2] - r[6], r[3] - r[1]
    xy, xz, yz = r[1] + r[3], r[2] + r[6], r[5] + r[7]
    return (
        (1 + trace, wx, wy, wz),
        (wx, 1 + 2 * r[0] - trace, xy, xz),
        (wy, xy, 1 + 2 * r[4] - trace, yz),
        (wz, xz, yz, 1 + 2 * r[8] - trace),
    )


@part
def unit_quaternion(q: Quaternion) -> Quaternion:
    """Of length one."""
    w, x, y, z = q
    size = np.sqrt(w * w + x * x + y * y + z * z)
    return w / size, x / size, y / size, z / size


@part
def angle_over_sine(square: float, w: float) -> float:
    """θ / sin(θ/2) from sin²(θ/2) and cos(θ/2), where the sine is not small."""
    half = np.sqrt(square)
    ratio: float = 2 * angle_of(half, w) / half
    return ratio


@part
def logarithm(r: Rotation) -> Vector:
    """At most π long; there both signs serve, and the component of largest magnitude is positive.

    The way is over the unit quaternion, from its largest component (S. W. Shepperd, J. Guidance and Control 1 (1978)
    223), so that no angle is inaccurate.
    """
    by_w, by_x, by_y, by_z = quaternions(r)
    a, b, c, d = by_w[0].real, by_x[1].real, by_y[2].real, by_z[3].real
    q = by_z
    if a >= b and a >= c and a >= d:
        q = by_w
    elif b >= c and b >= d:
        q = by_x
    elif c >= d:
        q = by_y
    if q[0].real < 0.0:
        q = (-q[0], -q[1], -q[2], -q[3])
    w, x, y, z = unit_quaternion(q)
    square = x * x + y * y + z * z
    factor = angle_over_sine(square, w) if square.real > FACTOR_FROM else 2 + square / 3
    return factor * x, factor * y, factor * z


@part
def logarithm_near(r: Rotation, near: Vector) -> Vector:
    """The logarithm closest to ``near``: it may pass π, and turn on."""
    psi = logarithm(r)
    square = dot(psi, psi)
    if not square.real > 0.0:
        return psi
    return scaled(turned_on(np.sqrt(square), dot(psi, near)), psi)


@part
def turned_on(angle: float, product: float) -> float:
    """Factor that lengthens a vector of length ``angle`` by whole turns, next to one of this product with it."""
    turns: float = np.round((product / angle - angle).real / (2 * math.pi))
    return 1.0 + 2 * math.pi * turns / angle


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
