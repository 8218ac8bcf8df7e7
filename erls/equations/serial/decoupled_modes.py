"""Coordinates in which the elastic block of a link is diagonal, for iteration matrices solved link by link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.maths.so3 import Array

MIXING = 0.1  # rate at which iterations converge that leave out how damping couples the coordinates of a link


@dataclass(frozen=True)
class DecoupledModes:
    """Coordinates z of a link, q_d = V z, in which its elastic mass is 1 and its stiffness diagonal.

    Attributes
    ----------
    vectors : (e, e) array
        V.
    stiffness, damping : (e,) arrays
        Diagonals of Vᵀ K V, Vᵀ C V.
    mixing : float
        Bound on the spectral radius of D⁻¹ α (Vᵀ C V - its diagonal) for D = 1 + α diag(Vᵀ C V) + α² Vᵀ K V: of an
        implicit integrator, whose α² has no negative real part, |D_i| is at least √2 |α| ω_i.
    """

    vectors: Array
    stiffness: Array
    damping: Array
    mixing: float


def decoupled_modes(mass: Array, stiffness: Array, damping: Array) -> DecoupledModes:
    """Of an elastic block (e, e) of the mass matrix, with diagonals (e,) of stiffness and damping."""
    if not len(mass):
        return DecoupledModes(np.zeros((0, 0)), np.zeros(0), np.zeros(0), 0.0)
    squares, vectors = la.eigh(np.diag(stiffness), mass)
    turned = vectors.T @ (damping[:, None] * vectors)
    coupled = np.abs(turned - np.diag(np.diag(turned)))
    if not coupled.any():
        return DecoupledModes(vectors, squares, np.diag(turned), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        coupled /= np.sqrt(2 * np.sqrt(np.abs(np.outer(squares, squares))))
    mixing = float(np.linalg.norm(coupled, 2)) if np.isfinite(coupled).all() else np.inf
    return DecoupledModes(vectors, squares, np.diag(turned), mixing)
