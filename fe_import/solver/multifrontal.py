"""Multifrontal factorization: every front is a small dense matrix that LAPACK factorizes.

A front gathers the entries of its own dofs and what eliminating its children left over for it, factorizes the own
part, and leaves a matrix over its rows to its parent (I. S. Duff & J. K. Reid, ACM Trans. Math. Software 9, 1983;
J. W. H. Liu, SIAM Review 34, 1992). Only lower triangles are meant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack
from scipy.sparse._sparsetools import csr_todense  # adds to what is there; nothing public does that in one pass

from fe_import.model import Array, IntArray
from fe_import.solver.base import SINGULAR, SingularMatrix
from fe_import.solver.elimination import Elimination

_ADDED = 200_000  # entries of a child added at a time
_TRUSTED = 1e-9  # of the diagonal; smaller pivots make the signs of later ones doubtful

Advance = Callable[[int], None]


class OutsidePattern(Exception):
    """A matrix has entries that the elimination does not foresee."""


@dataclass(frozen=True)
class MultifrontalFactor:
    """Cholesky factor of a positive definite matrix, front by front.

    Attributes
    ----------
    elimination : Elimination
    inverses : tuple of (o, o) arrays
        Inverse triangles: a product is faster than a substitution where right-hand sides are few.
    rectangles : tuple of (r, o) arrays
        What is below the triangles.
    """

    elimination: Elimination
    inverses: tuple[Array, ...]
    rectangles: tuple[Array, ...]

    def solve(self, right: Array) -> Array:
        """(n, k) or (n,) solutions."""
        order, starts, rows = self.elimination.order, self.elimination.starts, self.elimination.rows
        x = np.ascontiguousarray(right[order].reshape(len(order), -1), dtype=float)
        for k, row in enumerate(rows):
            own = x[starts[k] : starts[k + 1]]
            own[:] = self.inverses[k] @ own
            if len(row):
                x[row] -= self.rectangles[k] @ own
        for k in reversed(range(len(rows))):
            own = x[starts[k] : starts[k + 1]]
            if len(rows[k]):
                own -= self.rectangles[k].T @ x[rows[k]]
            own[:] = self.inverses[k].T @ own
        result = np.empty_like(x)
        result[order] = x
        return result.reshape(right.shape)


def factorize(matrix: sp.csc_array, elimination: Elimination, advance: Advance) -> MultifrontalFactor:
    """Cholesky factor of a positive definite matrix.

    Raises
    ------
    SingularMatrix
        A pivot is not positive, or within rounding of zero.
    """
    diagonal = np.abs(matrix.diagonal())[elimination.order]
    fronts = _Fronts([(matrix, 1.0)], elimination)
    inverses, rectangles = [], []
    for k, own, across in fronts:
        triangle, failed = lapack.dpotrf(own, lower=1, clean=1)
        scale = diagonal[elimination.starts[k] : elimination.starts[k + 1]]
        if failed or (triangle.diagonal() ** 2 <= SINGULAR * scale).any():
            raise SingularMatrix
        if len(across):
            across = blas.dtrsm(1.0, triangle, across, side=1, lower=1, trans_a=1, overwrite_b=1)
            fronts.eliminate_squared(k, across)
        inverses.append(lapack.dtrtri(triangle, lower=1, overwrite_c=1)[0])
        rectangles.append(across)
        advance(k)
    return MultifrontalFactor(elimination, tuple(inverses), tuple(rectangles))


def negative_pivots(
    matrix: sp.csc_array,
    elimination: Elimination,
    advance: Advance,
    mass: sp.csc_array,
    shift: float,
) -> int | None:
    """Number of negative eigenvalues of K - λM (Sylvester's law of inertia).

    Most fronts are positive definite when few eigenvalues are negative; only the others need pivots of both signs
    (Bunch & Kaufman, within the front). Nothing of the factor is kept.

    Parameters
    ----------
    matrix : (n, n) sparse CSC
        K.
    elimination : Elimination
    advance : callable
        Told every front that is done.
    mass : (n, n) sparse CSC
        M.
    shift : float
        λ.

    Returns
    -------
    int or None
        None when a pivot is too small to trust the count.

    Raises
    ------
    OutsidePattern
        A matrix has entries that the elimination does not foresee.
    """
    diagonal = np.abs(matrix.diagonal())[elimination.order]
    fronts = _Fronts([(matrix, 1.0), (mass, -shift)], elimination)
    count = 0
    for k, own, across in fronts:
        scale = diagonal[elimination.starts[k] : elimination.starts[k + 1]]
        triangle, failed = lapack.dpotrf(own, lower=1, clean=0)
        if not failed and (triangle.diagonal() ** 2 > _TRUSTED * scale).all():
            if len(across):
                across = blas.dtrsm(1.0, triangle, across, side=1, lower=1, trans_a=1, overwrite_b=1)
                fronts.eliminate_squared(k, across)
        else:
            factor, pivots, solved, failed = lapack.dsysv(own, across.T, lower=1)
            values = _pivot_values(factor, pivots)
            if failed > 0 or np.abs(values).min() <= _TRUSTED * scale.min():
                return None
            count += int((values < 0).sum())
            fronts.eliminate(k, across, solved)
        advance(k)
    return count


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


class _Fronts:
    """Iterates over the fronts of a sum of matrices, each front gathered: number, own part (o, o), part across (r, o).
    One must be eliminated before the next is asked for."""

    def __init__(self, terms: Sequence[tuple[sp.csc_array, float]], elimination: Elimination) -> None:
        self._terms, self._elimination = terms, elimination
        count = len(elimination.order)
        self._place = np.empty(count, dtype=np.int64)
        self._place[elimination.order] = np.arange(count)
        self._local = np.empty(count, dtype=np.int64)
        self._left: dict[int, Array] = {}
        self._rest = np.zeros((0, 0))

    def __iter__(self) -> Iterator[tuple[int, Array, Array]]:
        starts = self._elimination.starts
        owner = np.full(len(self._place), -1)
        for k, row in enumerate(self._elimination.rows):
            own, size = starts[k + 1] - starts[k], starts[k + 1] - starts[k] + len(row)
            self._local[starts[k] : starts[k + 1]] = np.arange(own)
            self._local[row] = np.arange(own, size)
            owner[starts[k] : starts[k + 1]] = owner[row] = k
            front = np.zeros((size, own), order="F")
            for matrix, factor in self._terms:
                self._gather(matrix, factor, front, owner, k)
            self._rest = np.zeros((len(row), len(row)), order="F")
            for child in self._elimination.children[k]:
                self._extend(front, self._local[self._elimination.rows[child]], self._left.pop(child))
            yield k, front[:own], np.asfortranarray(front[own:])

    def _gather(self, matrix: sp.csc_array, factor: float, front: Array, owner: IntArray, k: int) -> None:
        """Add entries of a matrix in the columns of a front, from its own rows on."""
        first, last = self._elimination.starts[k], self._elimination.starts[k + 1]
        columns = self._elimination.order[first:last]
        begin = matrix.indptr[columns].astype(np.int64)
        counts = matrix.indptr[columns + 1] - begin
        ends = np.cumsum(counts)
        at = np.arange(ends[-1]) + np.repeat(begin - ends + counts, counts)
        row = self._place[matrix.indices[at]]
        later = row >= first
        row = row[later]
        if (owner[row] != k).any():
            raise OutsidePattern
        to = self._local[row] + np.repeat(np.arange(last - first) * len(front), counts)[later]
        front.T.reshape(-1)[to] += factor * matrix.data[at[later]]

    def _extend(self, front: Array, to: IntArray, left: Array) -> None:
        """Add what a child left over; rows rise, so lower triangles stay lower triangles."""
        own = front.shape[1]
        inner, rows = int(np.searchsorted(to, own)), to.astype(np.int32)
        for target, begin, end, shift in ((front, 0, inner, 0), (self._rest, inner, len(to), own)):
            height, many = len(target), len(to) - begin
            step = max(1, _ADDED // max(1, many))
            for first in range(begin, end, step):
                # columns of the child are rows of a sparse matrix, whose entries go where its columns say
                stop = min(first + step, end)
                columns = to[first:stop] - shift
                part = target.T[columns[0] : columns[-1] + 1]
                starts = np.zeros(len(part) + 1, dtype=np.int32)
                starts[columns - columns[0] + 1] = many
                np.cumsum(starts, out=starts)
                places = np.tile(rows[begin:] - shift, stop - first)
                csr_todense(len(part), height, starts, places, left.T[first:stop, begin:].reshape(-1), part)

    def eliminate_squared(self, front: int, across: Array) -> None:
        """Leave rest - across acrossᵀ to the parent."""
        self._left[front] = blas.dsyrk(-1.0, across, beta=1.0, c=self._rest, lower=1, overwrite_c=1)

    def eliminate(self, front: int, across: Array, solved: Array) -> None:
        """Leave rest - across solved to the parent."""
        if len(across):
            self._left[front] = blas.dgemm(-1.0, across, solved, beta=1.0, c=self._rest, overwrite_c=1)
