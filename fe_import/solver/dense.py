"""Modes of small dense matrices, and what makes computed modes as accurate as they can be."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array

MECHANISM = "some part can move without strain"  # in errors that `fe_import.reduce` completes with the place
Matrix: TypeAlias = Array | sp.csc_array


def singular_matrix(what: str) -> FEImportError:
    """The error for a stiffness matrix that is not positive definite."""
    return FEImportError(
        Cause.NOT_DEFINITE,
        f"the {what} is singular or unstable: {MECHANISM}",
        remedy="connect all parts, remove hinges inside the link, or give the free part stiffness",
    )


def dense_modes(stiffness: Array, mass: Array, count: int | None, what: str) -> tuple[Array, Array]:
    """Lowest modes of small dense matrices; all modes with mass when ``count`` is None."""
    try:
        # solved as M φ = μ K φ, μ = 1/ω²: massless directions are the null space of M, and the largest μ, the
        # lowest modes, are the most accurate
        diagonal = np.diag(stiffness)
        if not (diagonal > 0).all():
            raise singular_matrix(what)
        scale = 1 / np.sqrt(diagonal)
        mass, stiffness = mass * np.outer(scale, scale), stiffness * np.outer(scale, scale)
        mu, modes = la.eigh(mass, stiffness)
    except (la.LinAlgError, ValueError):
        raise singular_matrix(what) from None
    mu, modes = mu[::-1], modes[:, ::-1]
    finite = mu > 1e-13 * mu[:1]
    mu, modes = mu[finite][:count], modes[:, finite][:, :count]
    omega, change = polishing(stiffness, mass, 1 / np.sqrt(mu), modes / np.sqrt(mu))
    return omega, scale[:, None] * (modes / np.sqrt(mu)) @ change


def polishing(stiffness: Matrix, mass: Matrix, omega: Array, modes: Array) -> tuple[Array, Array]:
    """What makes the upper modes as accurate as the lower ones.

    Solved for μ = 1/ω², a mode is known to rounding times μ₁/μ, so that the highest of many are neither
    mass-orthonormal nor modes. All are orthonormalized, the lowest first, and those above the geometric middle of
    the spectrum are found again within their span as eigenvectors for ω², where they are the accurate ones.

    Parameters
    ----------
    stiffness, mass : (d, d) dense or sparse
    omega : (m,) array
        In rising order.
    modes : (d, m) array

    Returns
    -------
    omega : (m,) array
    change : (m, m) array
        Near the identity; ``modes @ change`` are the better modes.
    """
    change = _orthonormalizing(modes, mass)
    high = omega**2 > omega[:1] * omega[-1:]
    if len(omega) == 0 or omega[-1] < 100 * omega[0]:
        return omega, change
    change[:, high] = change[:, high] @ _orthonormalizing(modes @ change[:, high], mass)
    stiff = modes @ change[:, high]
    squared, turn = la.eigh(stiff.T @ (stiffness @ stiff))
    change[:, high] = change[:, high] @ (turn * np.where(np.diag(turn) < 0, -1.0, 1.0))
    omega = np.concatenate([omega[~high], np.sqrt(squared)])
    order = np.argsort(omega, kind="stable")  # a pair of equal frequencies may stand on both sides of the middle
    return omega[order], change[:, order]


def _orthonormalizing(modes: Array, mass: Matrix) -> Array:
    """(m, m) upper triangle that makes nearly mass-orthonormal modes orthonormal, the first ones first."""
    lower = la.cholesky(modes.T @ (mass @ modes), lower=True)
    return np.asarray(la.solve_triangular(lower, np.eye(len(lower)), lower=True).T)
