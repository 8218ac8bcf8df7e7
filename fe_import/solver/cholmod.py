"""CHOLMOD through scikit-sparse (Y. Chen, T. A. Davis et al., ACM Trans. Math. Software 35, 2008), optional."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from fe_import.solver.base import SINGULAR, SingularMatrix
from fe_import.solver.elimination import Elimination
from fe_import.solver.superlu import PermutedFactor


def factorize(matrix: sp.csc_array, elimination: Elimination, advance: Callable[[float], None]) -> PermutedFactor:
    """Cholesky factor, with the elimination's order, of the matrix scaled to a unit diagonal."""
    from sksparse import cholmod

    diagonal = matrix.diagonal()
    if (diagonal <= 0).any():
        raise SingularMatrix
    scale = 1 / np.sqrt(diagonal)[elimination.order]
    scaling = sp.diags_array(scale)
    permuted = (scaling @ matrix[elimination.order][:, elimination.order] @ scaling).tocsc()
    permuted.sort_indices()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cholmod.CholmodWarning)  # a condition worse than 1e10 is common
        try:
            factor = cholmod.cho_factor(permuted, order="natural")
        except cholmod.CholmodNotPositiveDefiniteError:
            raise SingularMatrix from None
    if factor.rcond <= SINGULAR:  # smallest over largest pivot, and these are at most one
        raise SingularMatrix

    def solve(right: np.ndarray) -> np.ndarray:
        factors = scale if right.ndim == 1 else scale[:, None]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", cholmod.CholmodWarning)
            return np.asarray(factors * factor.solve(np.asfortranarray(factors * right)))

    return PermutedFactor(elimination.order, solve)


def bytes_needed(elimination: Elimination) -> int:
    """The supernodal factor, and the simplicial one with indices that scikit-sparse makes of it."""
    return elimination.nonzeros * (8 + 8 + 8)
