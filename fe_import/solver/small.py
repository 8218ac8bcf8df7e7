"""Small matrices as dense ones: LAPACK is done before compiled code is loaded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.linalg import lapack

from fe_import.model import Array, IntArray
from fe_import.solver.base import SINGULAR, SingularMatrix
from fe_import.solver.elimination import Elimination

SMALL = 600  # dofs
TRUSTED = 1e-9  # of the diagonal; smaller pivots make the signs of later ones doubtful


@dataclass(frozen=True)
class DenseFactor:
    """Cholesky factor of a positive definite matrix.

    Attributes
    ----------
    elimination : Elimination
        Not used.
    triangle : (n, n) array
        L.
    """

    elimination: Elimination
    triangle: Array

    def solve(self, right: Array) -> Array:
        """(n, k) or (n,) solutions."""
        return np.asarray(la.cho_solve((self.triangle, True), right))


def dense_factor(matrix: sp.csc_array, elimination: Elimination) -> DenseFactor:
    """Cholesky factor of a positive definite matrix.

    Raises
    ------
    SingularMatrix
        A pivot is not positive, or within rounding of zero.
    """
    full = matrix.toarray()
    triangle, failed = lapack.dpotrf(full, lower=1, clean=1)
    if failed or (triangle.diagonal() ** 2 <= SINGULAR * np.abs(full.diagonal())).any():
        raise SingularMatrix
    return DenseFactor(elimination, triangle)


def signed_pivots(square: Array, right: Array, diagonal: Array) -> tuple[int, Array] | None:
    """How many eigenvalues of a symmetric matrix are negative, and its solutions.

    Pivots of both signs by Bunch & Kaufman; only the lower triangle is looked at.

    Parameters
    ----------
    square : (n, n) array
    right : (n, k) array
    diagonal : (n,) array
        What pivots are compared with.

    Returns
    -------
    tuple or None
        None when a pivot is too small to trust its sign.
    """
    factor, pivots, solved, failed = lapack.dsysv(square, right, lower=1)
    values = _pivot_values(factor, pivots)
    if failed > 0 or np.abs(values).min() <= TRUSTED * diagonal.min():
        return None
    return int((values < 0).sum()), solved


def _pivot_values(factor: Array, pivots: IntArray) -> Array:
    """Eigenvalues of the 1x1 and 2x2 blocks of D in LAPACK's LDLᵀ; both rows of a 2x2 block are marked negative."""
    values = factor.diagonal().copy()
    k = 0
    while k < len(values):
        if pivots[k] > 0:
            k += 1
            continue
        off = factor[k + 1, k]
        values[k : k + 2] = np.linalg.eigvalsh([[values[k], off], [off, values[k + 1]]])
        k += 2
    return values
