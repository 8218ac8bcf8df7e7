"""Rotation vectors of one and the same rotation, which differ by full turns about their axis.

    ψ' = (1 + 2πn/|ψ|) ψ,   dψ'/dψ = 1 + 2πn/|ψ| (1 - a aᵀ),   a = ψ/|ψ|
"""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array

_TINY = 1e-300


def turned_on(psi: Array, rate: Array, turns: Array | int) -> tuple[Array, Array]:
    """Rotation vectors (..., 3) [rad] with so many more full turns (...), and their rates (..., 3)."""
    length = np.maximum(np.linalg.norm(psi, axis=-1, keepdims=True), _TINY)
    along, more = psi / length, 2 * np.pi * np.asarray(turns)[..., None]
    across = rate - along * (along * rate).sum(axis=-1, keepdims=True)
    return psi + more * along, rate + more / length * across


def turns_to(psi: Array, near: Array) -> Array:
    """(...) full turns that bring rotation vectors (..., 3) nearest to others (..., 3)."""
    length = np.linalg.norm(psi, axis=-1)
    along = (psi * near).sum(axis=-1) / np.maximum(length, _TINY)
    return np.asarray(np.round((along - length) / (2 * np.pi)))


def nearest(psi: Array, near: Array) -> Array:
    """(..., 3) vectors of the same rotations that are nearest to others (..., 3)."""
    return turned_on(psi, np.zeros_like(psi), turns_to(psi, near))[0]
