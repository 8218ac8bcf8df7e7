"""Factorization and lowest eigenpairs of sparse symmetric matrices, behind one small interface, verified."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array

Matrix: TypeAlias = Array | sp.csc_array

_DENSE = 600  # below this size LAPACK is faster than Lanczos and finds every mode
_RESIDUAL = 1e-6  # relative residual of an accepted eigenpair; Lanczos to working precision gives below 1e-9


def factorize(matrix: sp.csc_array, what: str) -> Callable[[Array], Array]:
    """Factorize a symmetric positive definite matrix; returns the solve with dense right-hand sides.

    Raises
    ------
    FEImportError
        Cause NOT_DEFINITE when the matrix is singular to working precision.
    """
    try:
        factor = spla.splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        raise _singular(what) from None
    pivots = factor.U.diagonal()
    if (pivots <= 1e-13 * np.abs(matrix.diagonal())[factor.perm_c.argsort()]).any():
        raise _singular(what)

    def solve(right: Array) -> Array:
        return np.asarray(factor.solve(np.ascontiguousarray(right, dtype=float)))

    return solve


def _singular(what: str) -> FEImportError:
    return FEImportError(
        Cause.NOT_DEFINITE,
        f"the {what} is singular or unstable: some part can move without strain",
        remedy="connect all parts, remove hinges inside the link, or give the free part stiffness",
    )


def lowest_modes(stiffness: sp.csc_array, mass: sp.csc_array, count: int, what: str) -> tuple[Array, Array]:
    """Lowest modes of K φ = ω² M φ with K positive definite and M positive semidefinite.

    Massless directions have no mode: fewer than ``count`` may come back.

    Returns
    -------
    omega : (k,) array
        Circular frequencies in rising order [rad/s].
    modes : (d, k) array
        Mass-orthonormal.

    Raises
    ------
    FEImportError
        K is not positive definite (NOT_DEFINITE), or the solver failed (EIGENSOLVER).
    """
    size = stiffness.shape[0]
    if count == 0 or size == 0 or not mass.count_nonzero():
        return np.zeros(0), np.zeros((size, 0))
    if size <= _DENSE or count > size // 4:
        return dense_modes(stiffness.toarray(), mass.toarray(), count, what)
    solve = factorize(stiffness, what)
    operator = spla.LinearOperator((size, size), matvec=solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)  # a fixed start makes the reduction reproducible
    try:
        values, modes = spla.eigsh(stiffness, count, mass, sigma=0.0, OPinv=operator, v0=start, which="LM")
    except spla.ArpackError as problem:
        raise FEImportError(
            Cause.EIGENSOLVER, f"modes of the {what}: {problem}", value=count, remedy="ask for fewer modes"
        ) from None
    order = np.argsort(values)
    values, modes = values[order], modes[:, order]
    force = stiffness @ modes
    residual = np.linalg.norm(force - mass @ modes * values, axis=0) / np.linalg.norm(force, axis=0)
    if residual.max() > _RESIDUAL:
        raise FEImportError(
            Cause.EIGENSOLVER,
            f"modes of the {what} did not converge",
            value=float(residual.max()),
            limit=_RESIDUAL,
            remedy="ask for fewer modes",
        )
    omega = np.sqrt(values)
    _check_complete(stiffness, mass, values, what)
    omega, change = polishing(stiffness, mass, omega, modes)
    return omega, modes @ change


def _check_complete(stiffness: sp.csc_array, mass: sp.csc_array, values: Array, what: str) -> None:
    """Refuse a spectrum with a gap: Lanczos may miss one of several modes of equal frequency.

    Sylvester: K - λM has as many negative pivots as there are modes below λ. The count is trusted when the pivots
    came from the diagonal and none is small; λ lies where the found spectrum leaves most room, above its middle.
    """
    first = len(values) // 2
    room = np.diff(np.log(values[first:]))
    if not len(room):
        return
    last = first + int(room.argmax())
    shift = float(np.sqrt(values[last] * values[last + 1]))
    below = modes_below(stiffness, mass, shift)
    if below is not None and below != last + 1:
        raise FEImportError(
            Cause.EIGENSOLVER,
            f"modes of the {what} were missed",
            value=f"{last + 1} found below {np.sqrt(shift) / (2 * np.pi):.6g} Hz",
            limit=f"there are {below}",
            remedy="ask for more or for fewer modes",
        )


def modes_below(stiffness: sp.csc_array, mass: sp.csc_array, shift: float) -> int | None:
    """Number of eigenvalues of K φ = λ M φ below ``shift`` (Sylvester: negative pivots of K - λM).

    None when the pivots do not tell: one is small, or they did not come from the diagonal.
    """
    shifted = (stiffness - shift * mass).tocsc()
    try:
        factor = spla.splu(
            shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        return None
    pivots = factor.U.diagonal()
    if not np.array_equal(factor.perm_r, factor.perm_c) or np.abs(pivots).min() < 1e-10 * np.abs(pivots).max():
        return None
    return int((pivots < 0).sum())


def dense_modes(stiffness: Array, mass: Array, count: int | None, what: str) -> tuple[Array, Array]:
    """`lowest_modes` of small dense matrices; all modes with mass when ``count`` is None."""
    try:
        # solved as M φ = μ K φ, μ = 1/ω²: massless directions are the null space of M, and the largest μ, the
        # lowest modes, are the most accurate
        diagonal = np.diag(stiffness)
        if not (diagonal > 0).all():
            raise _singular(what)
        scale = 1 / np.sqrt(diagonal)
        mass, stiffness = mass * np.outer(scale, scale), stiffness * np.outer(scale, scale)
        mu, modes = la.eigh(mass, stiffness)
    except (la.LinAlgError, ValueError):
        raise _singular(what) from None
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
