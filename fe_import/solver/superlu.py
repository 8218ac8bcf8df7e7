"""SciPy's SuperLU (X. S. Li, ACM Trans. Math. Software 31, 2005), pivots kept on the diagonal; it stores L and U."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fe_import.model import Array, IntArray
from fe_import.solver.base import SINGULAR, SingularMatrix
from fe_import.solver.elimination import Elimination


@dataclass(frozen=True)
class PermutedFactor:
    """Solves with the rows and columns of a matrix in the order of elimination."""

    order: IntArray
    permuted_solve: Callable[[Array], Any]

    def solve(self, right: Array) -> Array:
        """(n, k) or (n,) solutions."""
        result = np.empty(right.shape)
        result[self.order] = self.permuted_solve(np.asfortranarray(right[self.order], dtype=float))
        return result


def factorize(matrix: sp.csc_array, elimination: Elimination, advance: Callable[[float], None]) -> PermutedFactor:
    """LU factors, with the elimination's order."""
    permuted = matrix[elimination.order][:, elimination.order].tocsc()
    try:
        factor = spla.splu(permuted, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        raise SingularMatrix from None
    if (factor.U.diagonal() <= SINGULAR * np.abs(permuted.diagonal())[factor.perm_c.argsort()]).any():
        raise SingularMatrix
    return PermutedFactor(elimination.order, factor.solve)


def bytes_needed(elimination: Elimination) -> int:
    """L and U by SuperLU, and as SciPy's matrices when the pivots are looked at; indices for these."""
    return 2 * elimination.nonzeros * (8 + 8 + 4)
