"""Exponential, logarithm and tangent operators of rotations, for any number of them at once.

A rotation vector ψ of length θ stands for R = exp(ψ̃). With R moving, Rᵀ Ṙ = ω̃ and ω = T(ψ) ψ̇:

    exp ψ̃ = 1 + c₁ ψ̃ + c₂ ψ̃²,    T = 1 − c₂ ψ̃ + c₃ ψ̃²,    T⁻¹ = 1 + ψ̃/2 + b ψ̃²

(A. Iserles, H. Munthe-Kaas, S. Nørsett, A. Zanna, Acta Numerica 2000, app. B; coefficients in
`erls.maths.coefficients`). T is singular at θ = 2π, where its inverse has a pole; a logarithm stays within π.
All three are 1 + f(x) ψ̃ + g(x) ψ̃² with x = θ², and so are their derivatives formed.
"""

from __future__ import annotations

import numpy as np

from erls.maths.coefficients import inverse_coefficient, stumpff, stumpff_derivative, stumpff_second_derivative
from erls.maths.so3 import Array

_ONE = np.eye(3)


def skews(a: Array) -> Array:
    """(..., 3, 3) matrices of the cross products by vectors (..., 3)."""
    result = np.zeros((*a.shape, 3))
    result[..., 0, 1], result[..., 0, 2], result[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    result[..., 1, 0], result[..., 2, 0], result[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return result


def exp(psi: Array) -> Array:
    """(..., 3, 3) rotations by rotation vectors (..., 3)."""
    c = stumpff(_squared(psi), 2)
    return _value(psi, c[1], c[2])


def log(rotation: Array) -> Array:
    """(..., 3) rotation vectors of rotations (..., 3, 3), of length at most π.

    At exactly π both signs serve; the component of largest magnitude is positive then. The way is over the unit
    quaternion, from its largest component (S. W. Shepperd, J. Guidance and Control 1 (1978) 223), so that no
    angle is inaccurate.
    """
    r = rotation
    outer = np.empty((*r.shape[:-2], 4, 4))  # 4 q qᵀ, with the scalar last
    trace = np.trace(r, axis1=-2, axis2=-1)
    outer[..., :3, :3] = r + np.swapaxes(r, -1, -2)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        outer[..., i, i] = 1 + 2 * r[..., i, i] - trace
        outer[..., i, 3] = outer[..., 3, i] = r[..., k, j] - r[..., j, k]
    outer[..., 3, 3] = 1 + trace
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, largest[..., None, None], axis=-1)[..., 0]
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    q = np.where(q[..., 3:] < 0, -q, q)
    half = np.linalg.norm(q[..., :3], axis=-1)
    # θ / sin(θ/2): below 1e-4 the next term of 2 (1 + s²/6) is below rounding
    safe = np.where(half > 1e-4, half, 1.0)
    factor = np.where(half > 1e-4, 2 * np.arctan2(half, q[..., 3]) / safe, 2 + half**2 / 3)
    vectors: Array = factor[..., None] * q[..., :3]
    return vectors


def log_near(rotation: Array, near: Array) -> Array:
    """(..., 3) the rotation vectors of rotations (..., 3, 3) closest to ``near``: they may pass π, and turn on."""
    psi = log(rotation)
    angle = np.sqrt(_squared(psi))
    safe = np.where(angle > 0, angle, 1.0)
    along = (psi * near).sum(axis=-1) / safe  # of near on the axis; without a turn there is no axis to go on about
    turns = np.where(angle > 0, np.round((along - angle) / (2 * np.pi)), 0.0)
    onward: Array = psi * (1 + 2 * np.pi * turns / safe)[..., None]
    return onward


def tangent(psi: Array) -> Array:
    """(..., 3, 3) T."""
    c = stumpff(_squared(psi), 3)
    return _value(psi, -c[2], c[3])


def tangent_derivative(psi: Array, change: Array) -> Array:
    """(..., 3, 3) derivative of T(ψ) when ψ moves along ``change`` (..., 3)."""
    c = stumpff(_squared(psi), 5)
    return _derivative(psi, change, (-c[2], -stumpff_derivative(c, 2)), (c[3], stumpff_derivative(c, 3)))


def tangent_second_derivative(psi: Array, first: Array, second: Array) -> Array:
    """(..., 3, 3) second derivative of T(ψ) along ``first`` and ``second`` (..., 3)."""
    c = stumpff(_squared(psi), 7)
    f = (-c[2], -stumpff_derivative(c, 2), -stumpff_second_derivative(c, 2))
    return _second(psi, first, second, f, (c[3], stumpff_derivative(c, 3), stumpff_second_derivative(c, 3)))


def tangent_inverse(psi: Array) -> Array:
    """(..., 3, 3) T⁻¹; infinite at θ = 2π."""
    b, _, _ = inverse_coefficient(_squared(psi))
    return _value(psi, np.full(b.shape, 0.5), b)


def tangent_inverse_derivative(psi: Array, change: Array) -> Array:
    """(..., 3, 3) derivative of T⁻¹(ψ) along ``change`` (..., 3)."""
    b, slope, _ = inverse_coefficient(_squared(psi))
    return _derivative(psi, change, (np.full(b.shape, 0.5), np.zeros(b.shape)), (b, slope))


def tangent_inverse_second_derivative(psi: Array, first: Array, second: Array) -> Array:
    """(..., 3, 3) second derivative of T⁻¹(ψ) along ``first`` and ``second`` (..., 3)."""
    g = inverse_coefficient(_squared(psi))
    none = np.zeros(g[0].shape)
    return _second(psi, first, second, (np.full(g[0].shape, 0.5), none, none), g)


def _squared(psi: Array) -> Array:
    x: Array = (psi * psi).sum(axis=-1)
    return x


def _scaled(factor: Array, matrix: Array) -> Array:
    return factor[..., None, None] * matrix


def _value(psi: Array, f: Array, g: Array) -> Array:
    """1 + f ψ̃ + g ψ̃²."""
    s = skews(psi)
    return _ONE + _scaled(f, s) + _scaled(g, s @ s)


def _derivative(psi: Array, d: Array, f: tuple[Array, ...], g: tuple[Array, ...]) -> Array:
    """Derivative along d of the above; f, g with their first derivatives by x."""
    s, t = skews(psi), skews(d)
    along = 2 * (psi * d).sum(axis=-1)
    return _scaled(f[0], t) + _scaled(g[0], s @ t + t @ s) + _scaled(along * f[1], s) + _scaled(along * g[1], s @ s)


def _second(psi: Array, d: Array, e: Array, f: tuple[Array, ...], g: tuple[Array, ...]) -> Array:
    """Second derivative along d and e; f, g with two derivatives by x."""
    s, t, u = skews(psi), skews(d), skews(e)
    by_d, by_e = 2 * (psi * d).sum(axis=-1), 2 * (psi * e).sum(axis=-1)
    both = 2 * (d * e).sum(axis=-1)
    return (
        _scaled(g[0], t @ u + u @ t)
        + _scaled(by_e * f[1], t)
        + _scaled(by_e * g[1], s @ t + t @ s)
        + _scaled(by_d * f[1], u)
        + _scaled(by_d * g[1], s @ u + u @ s)
        + _scaled(both * f[1] + by_d * by_e * f[2], s)
        + _scaled(both * g[1] + by_d * by_e * g[2], s @ s)
    )
