"""Exponential, logarithm, adjoint and tangent operators of rigid motions SE(3), for any number of them at once.

A twist ξ = [v; ω] (as in `erls.maths.se3`) has the bracket ad ξ = [[ω̃, ṽ], [0, ω̃]]: ω̃ with a perturbation ṽ above its
diagonal. Every power series in ad ξ therefore has the derivative of the same series of rotations, along v, there:

    T(ξ) = [[T(ω), DT(ω)·v], [0, T(ω)]],    exp ξ = (exp ω̃, T(ω)ᵀ v)

(V. Sonneville, A. Cardona, O. Brüls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451, app. A). With H = exp ξ moving,
H⁻¹ Ḣ = ν̃ and ν = T(ξ) ξ̇. As with rotations, T⁻¹ has a pole at |ω| = 2π.
"""

from __future__ import annotations

import numpy as np

from erls.maths import rotation_maps as rotations
from erls.maths.rotation_maps import skews
from erls.maths.so3 import Array


def poses(rotation: Array, position: Array) -> Array:
    """(..., 4, 4) poses of rotations (..., 3, 3) and positions (..., 3)."""
    result = np.zeros((*rotation.shape[:-2], 4, 4))
    result[..., :3, :3], result[..., :3, 3], result[..., 3, 3] = rotation, position, 1.0
    return result


def inverse(h: Array) -> Array:
    """(..., 4, 4) inverse poses."""
    turn = np.swapaxes(h[..., :3, :3], -1, -2)
    return poses(turn, -_times(turn, h[..., :3, 3]))


def adjoint(h: Array) -> Array:
    """(..., 6, 6) Ad: twists in the moved frame's axes to twists in the fixed ones, hat(Ad ξ) = H hat(ξ) H⁻¹."""
    turn = h[..., :3, :3]
    return _dual(turn, skews(h[..., :3, 3]) @ turn)


def adjoint_inverse(h: Array) -> Array:
    """(..., 6, 6) Ad⁻¹: `erls.maths.se3.twist_transform` of many poses."""
    turn = np.swapaxes(h[..., :3, :3], -1, -2)
    return _dual(turn, -turn @ skews(h[..., :3, 3]))


def bracket(xi: Array) -> Array:
    """(..., 6, 6) ad of twists (..., 6)."""
    return _dual(skews(xi[..., 3:]), skews(xi[..., :3]))


def cobracket(force: Array) -> Array:
    """(..., 6, 6) matrix of ξ ↦ ad(ξ)ᵀ f, for forces f = [n; m] (..., 6)."""
    result = np.zeros((*force.shape, 6))
    n = skews(force[..., :3])
    result[..., :3, 3:] = result[..., 3:, :3] = n
    result[..., 3:, 3:] = skews(force[..., 3:])
    return result


def exp(xi: Array) -> Array:
    """(..., 4, 4) motions by twists (..., 6)."""
    shift = np.swapaxes(rotations.tangent(xi[..., 3:]), -1, -2)
    return poses(rotations.exp(xi[..., 3:]), _times(shift, xi[..., :3]))


def log(h: Array) -> Array:
    """(..., 6) twists of motions (..., 4, 4), turning by at most π; at π as `erls.maths.rotation_maps.log`."""
    return _with_turn(h, rotations.log(h[..., :3, :3]))


def log_near(h: Array, near: Array) -> Array:
    """(..., 6) the twists of motions (..., 4, 4) whose turn is closest to that of ``near`` (..., 6)."""
    return _with_turn(h, rotations.log_near(h[..., :3, :3], near[..., 3:]))


def _with_turn(h: Array, psi: Array) -> Array:
    back = np.swapaxes(rotations.tangent_inverse(psi), -1, -2)
    return np.concatenate([_times(back, h[..., :3, 3]), psi], axis=-1)


def tangent(xi: Array) -> Array:
    """(..., 6, 6) T."""
    v, w = xi[..., :3], xi[..., 3:]
    return _dual(rotations.tangent(w), rotations.tangent_derivative(w, v))


def tangent_derivative(xi: Array, change: Array) -> Array:
    """(..., 6, 6) derivative of T(ξ) when ξ moves along ``change`` (..., 6)."""
    v, w, dv, dw = xi[..., :3], xi[..., 3:], change[..., :3], change[..., 3:]
    above = rotations.tangent_second_derivative(w, v, dw) + rotations.tangent_derivative(w, dv)
    return _dual(rotations.tangent_derivative(w, dw), above)


def tangent_inverse(xi: Array) -> Array:
    """(..., 6, 6) T⁻¹; infinite at |ω| = 2π."""
    v, w = xi[..., :3], xi[..., 3:]
    return _dual(rotations.tangent_inverse(w), rotations.tangent_inverse_derivative(w, v))


def tangent_inverse_derivative(xi: Array, change: Array) -> Array:
    """(..., 6, 6) derivative of T⁻¹(ξ) along ``change`` (..., 6)."""
    v, w, dv, dw = xi[..., :3], xi[..., 3:], change[..., :3], change[..., 3:]
    above = rotations.tangent_inverse_second_derivative(w, v, dw) + rotations.tangent_inverse_derivative(w, dv)
    return _dual(rotations.tangent_inverse_derivative(w, dw), above)


def _times(matrix: Array, vector: Array) -> Array:
    product: Array = (matrix @ vector[..., None])[..., 0]
    return product


def _dual(diagonal: Array, above: Array) -> Array:
    """(..., 6, 6) [[A, B], [0, A]]."""
    result = np.zeros((*np.broadcast_shapes(diagonal.shape, above.shape)[:-2], 6, 6))
    result[..., :3, :3] = result[..., 3:, 3:] = diagonal
    result[..., :3, 3:] = above
    return result
