"""Linear systems [[A, C], [B, 0]] with unknown increments and multipliers, scaled, dense or sparse.

Increments and constraints are measured in metres, forces in newtons per mass of the mechanism times ``period``²
(βh² of a step), and multipliers likewise: the condition number then stays bounded as the step tends to zero
(C. L. Bottasso, D. Dopico, L. Trainelli, Multibody Syst. Dyn. 19 (2008) 3–20).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from erls.maths.so3 import Array

if TYPE_CHECKING:  # sparse matrices come with the systems that have them
    import scipy.sparse as sp

Matrix: TypeAlias = "Array | sp.csc_array"


class Scales:
    """Units in which a system is solved.

    Parameters
    ----------
    metres : (n,) array
        Metres per unit of each increment.
    mass : (n, n) matrix
        Its largest diagonal entry, per square metre, is the unit of mass [kg].
    rows : (m, n) matrix
        B; each constraint is scaled so that its largest derivative by a displacement in metres is one.
    """

    def __init__(self, metres: Array, mass: Matrix, rows: Matrix) -> None:
        self.increment = 1 / metres
        self.mass = float((mass.diagonal() * self.increment**2).max(initial=0.0)) or 1.0
        sizes = dense(abs(rows * self.increment).max(axis=1)).ravel() if rows.shape[0] else np.zeros(0)
        self.constraint = 1 / np.where(sizes > 0, sizes, 1.0)


class Saddle:
    """A factored system.

    Parameters
    ----------
    block : (n, n) matrix
        A, force per increment.
    columns : (n, m) matrix
        C = Bᵀ.
    rows : (m, n) matrix
        B, or B T.
    period : float
        Square root of what turns forces per mass into displacements [s].
    """

    def __init__(self, block: Matrix, columns: Matrix, rows: Matrix, scales: Scales, period: float) -> None:
        self.size, self.scales = block.shape[0], scales
        d, s = scales.increment, scales.constraint
        self.force = period**2 / scales.mass  # scaled force = force · this · d
        self._left = np.concatenate([self.force * d, s])
        self._right = np.concatenate([d, s / self.force])
        self.singular: int | None = None  # unknown at which the factorization broke down
        self._sparse = None
        whole = _assemble(block, columns, rows, self._left, self._right)
        if not isinstance(whole, np.ndarray):
            from scipy.sparse.linalg import splu

            try:
                self._sparse = splu(whole)
            except RuntimeError:
                self.singular = _emptiest(whole)
        else:
            self._factors, self._pivots, info = dgetrf(whole)
            if info > 0:
                self.singular = info - 1

    def scaled(self, force: Array, constraint: Array) -> Array:
        """(n + m,) right-hand side [metres]."""
        right: Array = self._left * np.concatenate([force, constraint])
        return right

    def solve(self, right: Array) -> Array:
        """(n + m,) scaled unknowns [metres] of a scaled right-hand side."""
        if self._sparse is not None:
            return np.asarray(self._sparse.solve(right), dtype=float)
        return np.asarray(dgetrs(self._factors, self._pivots, right)[0], dtype=float)

    def unscaled(self, unknowns: Array) -> tuple[Array, Array]:
        """Increment (n,) and multipliers (m,) of scaled unknowns."""
        both = self._right * unknowns
        return both[: self.size], both[self.size :]


def scaled_matrix(block: Matrix, rows: Matrix, scales: Scales, period: float) -> Matrix:
    """(n + m, n + m) what `Saddle` factors, for its condition number."""
    d, s = scales.increment, scales.constraint
    force = period**2 / scales.mass
    return _assemble(block, rows.T, rows, np.concatenate([force * d, s]), np.concatenate([d, s / force]))


def dense(matrix: Any) -> Array:
    """A sparse or dense matrix as an array."""
    result: Array = matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)
    return result


def _assemble(block: Matrix, columns: Matrix, rows: Matrix, left: Array, right: Array) -> Matrix:
    n, m = block.shape[0], rows.shape[0]
    if not (isinstance(block, np.ndarray) and isinstance(rows, np.ndarray)):
        import scipy.sparse as sp

        whole = sp.block_array([[sp.csc_array(block), sp.csc_array(columns)], [sp.csc_array(rows), None]], format="csc")
        return sp.csc_array(sp.diags_array(left) @ whole @ sp.diags_array(right))
    result = np.zeros((n + m, n + m))
    result[:n, :n], result[:n, n:], result[n:, :n] = block, columns, rows
    return left[:, None] * result * right


def _emptiest(matrix: Matrix) -> int:
    """Column of smallest norm: the first suspect of a singular sparse matrix."""
    return int(np.argmin(abs(matrix).power(2).sum(axis=0)))
