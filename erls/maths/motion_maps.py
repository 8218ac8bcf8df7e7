"""Operators of rigid motions SE(3) as matrices, for any number of them at once.

The formulas are those of `erls.maths.motions`, with arrays in place of numbers. Poses are (..., 4, 4), twists
ξ = [v; ω] (..., 6). As with rotations, T⁻¹ has a pole at |ω| = 2π.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.maths import motions, rotations
from erls.maths import rotation_maps as turns
from erls.maths.jit import plain
from erls.maths.so3 import Array
from erls.maths.vectors import dot

_HALF = (0.5, 0.0, 0.0)
_UNITS = tuple(np.eye(6))  # a column is what becomes of a unit twist: all six along a last axis
_E = _UNITS[:3], _UNITS[3:]


def poses(rotation: Array, position: Array) -> Array:
    """(..., 4, 4) poses of rotations (..., 3, 3) and positions (..., 3)."""
    result = np.zeros((*rotation.shape[:-2], 4, 4), dtype=np.result_type(rotation, position))
    result[..., :3, :3], result[..., :3, 3], result[..., 3, 3] = rotation, position, 1.0
    return result


def inverse(h: Array) -> Array:
    """(..., 4, 4) inverse poses."""
    turn = np.swapaxes(h[..., :3, :3], -1, -2)
    return poses(turn, -(turn @ h[..., :3, 3:])[..., 0])


def adjoint(h: Array) -> Array:
    """(..., 6, 6) Ad: twists in the moved frame's axes to twists in the fixed ones, hat(Ad ξ) = H hat(ξ) H⁻¹."""
    return adjoint_inverse(inverse(h))


def adjoint_inverse(h: Array) -> Array:
    """(..., 6, 6) Ad⁻¹: `erls.maths.se3.twist_transform` of many poses."""
    return _columns(plain(motions.transformed)(*_parts(h), *_E))


def bracket(xi: Array) -> Array:
    """(..., 6, 6) ad of twists (..., 6)."""
    return _columns(plain(motions.bracket)(*_pair(xi), *_E))


def cobracket(force: Array) -> Array:
    """(..., 6, 6) matrix of ξ ↦ ad(ξ)ᵀ f, for forces f = [n; m] (..., 6)."""
    return _columns(plain(motions.cobracket)(*_E, *_pair(force)))


def exp(xi: Array) -> Array:
    """(..., 4, 4) motions by twists (..., 6)."""
    u, psi = turns.entries(xi[..., :3]), turns.entries(xi[..., 3:])
    f, g = turns.tangent_coefficients(psi)
    return poses(turns.exp(xi[..., 3:]), np.stack(plain(rotations.value)(-f[0], g[0], psi, u), axis=-1))


def log(h: Array) -> Array:
    """(..., 6) twists of motions (..., 4, 4), turning by at most π; at π as `erls.maths.rotation_maps.log`."""
    return _with_turn(h, turns.log(h[..., :3, :3]))


def log_near(h: Array, near: Array) -> Array:
    """(..., 6) the twists of motions (..., 4, 4) whose turn is closest to that of ``near`` (..., 6)."""
    return _with_turn(h, turns.log_near(h[..., :3, :3], near[..., 3:]))


def _with_turn(h: Array, turn: Array) -> Array:
    psi = turns.entries(turn)
    b = turns.inverse_coefficient(plain(dot)(psi, psi))
    u = plain(rotations.value)(-0.5, b[0], psi, turns.entries(h[..., :3, 3]))
    return np.concatenate([np.stack(u, axis=-1), turn], axis=-1)


def tangent(xi: Array) -> Array:
    """(..., 6, 6) T."""
    u, psi = _pair(xi)
    return _columns(plain(motions.series)(*turns.tangent_coefficients(psi), u, psi, *_E))


def tangent_derivative(xi: Array, along: Array) -> Array:
    """(..., 6, 6) derivative of T(ξ) when ξ moves along ``along`` (..., 6)."""
    u, psi = _pair(xi)
    return _columns(plain(motions.change)(*turns.tangent_coefficients(psi), u, psi, *_pair(along), *_E))


def tangent_inverse(xi: Array) -> Array:
    """(..., 6, 6) T⁻¹; infinite at |ω| = 2π."""
    u, psi = _pair(xi)
    b = turns.inverse_coefficient(plain(dot)(psi, psi))
    return _columns(plain(motions.series)(_HALF, b, u, psi, *_E))


def tangent_inverse_derivative(xi: Array, along: Array) -> Array:
    """(..., 6, 6) derivative of T⁻¹(ξ) along ``along`` (..., 6)."""
    u, psi = _pair(xi)
    b = turns.inverse_coefficient(plain(dot)(psi, psi))
    return _columns(plain(motions.change)(_HALF, b, u, psi, *_pair(along), *_E))


def _pair(xi: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Both vectors of twists (..., 6), with an axis for the columns."""
    return turns.entries(xi[..., None, :3]), turns.entries(xi[..., None, 3:])


def _parts(h: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Position and rotation of poses, with an axis for the columns."""
    turn = h[..., :3, :3].reshape(*h.shape[:-2], 1, 9)
    return turns.entries(h[..., None, :3, 3]), turns.entries(turn)


def _columns(pair: Any) -> Array:
    """(..., 6, 6) of two triples of arrays (..., 6), which hold the entries of its columns."""
    return np.stack(np.broadcast_arrays(*pair[0], *pair[1]), axis=-2)
