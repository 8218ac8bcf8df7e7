"""Exponential, logarithm and tangent operators of rotations as matrices, for any number of them at once.

The formulas are those of `erls.maths.rotations` and `erls.maths.coefficients`, with arrays in place of numbers: real or
complex, over any leading axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.maths import coefficients, rotations
from erls.maths.coefficients import CLOSED_FROM, MANY, MANY_ZETA, POLE_HALVED
from erls.maths.jit import plain
from erls.maths.rotations import FACTOR_FROM
from erls.maths.so3 import Array
from erls.maths.vectors import dot

_UNITS = tuple(np.eye(3))  # a column is what becomes of a unit vector: all three along a last axis
_dot = plain(dot)


def skews(a: Array) -> Array:
    """(..., 3, 3) matrices of the cross products by vectors (..., 3)."""
    result = np.zeros((*a.shape, 3), dtype=np.result_type(a, float))
    result[..., 0, 1], result[..., 0, 2], result[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    result[..., 1, 0], result[..., 2, 0], result[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return result


def stumpff(x: Any) -> Any:
    """c₁ to c₇ of squared angles (...): the series or the closed forms, whichever is accurate."""
    x = np.asarray(x)
    far = x.real > CLOSED_FROM
    near = plain(coefficients.stumpff_series)(np.where(far, 0.0, x), MANY)
    if not far.any():
        return near
    closed = plain(coefficients.stumpff_closed)(np.where(far, x, CLOSED_FROM))
    return tuple(np.where(far, b, a) for a, b in zip(near, closed, strict=True))


def inverse_coefficient(x: Any) -> Any:
    """b of squared angles (...), with two derivatives."""
    x = np.asarray(x)
    far = x.real > POLE_HALVED
    near = plain(coefficients.inverse_series)(np.where(far, 0.0, x), MANY_ZETA)
    if not far.any():
        return near
    with np.errstate(divide="ignore", invalid="ignore"):
        closed = plain(coefficients.inverse_closed)(np.where(far, x, POLE_HALVED))
    return tuple(np.where(far, b, a) for a, b in zip(near, closed, strict=True))


def exp(psi: Array) -> Array:
    """(..., 3, 3) rotations by rotation vectors (..., 3)."""
    p = entries(psi)
    c = stumpff(_dot(p, p))
    return _matrices(plain(rotations.exponential)(p, c[0], c[1]))


def log(rotation: Array) -> Array:
    """(..., 3) rotation vectors of rotations (..., 3, 3), of length at most π; at π as `rotations.logarithm`."""
    r = entries(rotation.reshape(*rotation.shape[:-2], 9))
    columns = np.stack([np.stack(q, axis=-1) for q in plain(rotations.quaternions)(r)], axis=-2)
    largest = np.argmax(np.diagonal(columns, axis1=-2, axis2=-1).real, axis=-1)
    q = np.take_along_axis(columns, largest[..., None, None], axis=-2)[..., 0, :]
    w, *xyz = plain(rotations.unit_quaternion)(entries(np.where(q[..., :1].real < 0, -q, q)))
    axis = np.stack(xyz, axis=-1)
    square = (axis * axis).sum(axis=-1)
    far = square.real > FACTOR_FROM
    factor = np.where(far, plain(rotations.angle_over_sine)(np.where(far, square, 1.0), w), 2 + square / 3)
    vectors: Array = factor[..., None] * axis
    return vectors


def log_near(rotation: Array, near: Array) -> Array:
    """(..., 3) the rotation vectors of rotations (..., 3, 3) closest to ``near``: they may pass π, and turn on."""
    psi = log(rotation)
    square = (psi * psi).sum(axis=-1)
    turned = square.real > 0  # without a turn there is no axis to go on about
    longer = plain(rotations.turned_on)(np.sqrt(np.where(turned, square, 1.0)), (psi * near).sum(axis=-1))
    onward: Array = psi * np.where(turned, longer, 1.0)[..., None]
    return onward


def tangent(psi: Array) -> Array:
    """(..., 3, 3) T."""
    p = entries(psi)
    f, g = tangent_coefficients(p)
    return _matrices(plain(rotations.exponential)(p, f[0], g[0]))


def tangent_derivative(psi: Array, change: Array) -> Array:
    """(..., 3, 3) derivative of T(ψ) when ψ moves along ``change`` (..., 3)."""
    p = entries(psi[..., None, :])
    f, g = tangent_coefficients(p)
    return _columns(plain(rotations.first)(f[0], f[1], g[0], g[1], p, entries(change[..., None, :]), _UNITS))


def tangent_inverse(psi: Array) -> Array:
    """(..., 3, 3) T⁻¹; infinite at θ = 2π."""
    p = entries(psi)
    return _matrices(plain(rotations.exponential)(p, 0.5, inverse_coefficient(_dot(p, p))[0]))


def tangent_inverse_derivative(psi: Array, change: Array) -> Array:
    """(..., 3, 3) derivative of T⁻¹(ψ) along ``change`` (..., 3)."""
    p = entries(psi[..., None, :])
    b = inverse_coefficient(_dot(p, p))
    return _columns(plain(rotations.first)(0.5, 0.0, b[0], b[1], p, entries(change[..., None, :]), _UNITS))


def tangent_coefficients(psi: tuple[Array, ...]) -> Any:
    """f and g of T, each with two derivatives, for the entries of rotation vectors."""
    return plain(coefficients.tangent_coefficients)(stumpff(_dot(psi, psi)))


def entries(vectors: Array) -> tuple[Array, ...]:
    """Numbers of vectors (..., n) as n arrays (...)."""
    return tuple(np.moveaxis(vectors, -1, 0))


def _matrices(nine: tuple[Array, ...]) -> Array:
    """(..., 3, 3) of entries, rows first."""
    return np.stack(nine, axis=-1).reshape(*np.shape(nine[1]), 3, 3)


def _columns(vectors: tuple[Array, ...]) -> Array:
    """(..., 3, 3) of three arrays (..., 3), which hold the entries of its columns."""
    return np.stack(np.broadcast_arrays(*vectors), axis=-2)
