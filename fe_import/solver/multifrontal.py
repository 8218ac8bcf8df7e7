"""Multifrontal Cholesky factors and counts of negative pivots, pieces of the tree of fronts side by side.

What a piece is, is told in `fe_import.solver.layout`; what happens to a front, in `fe_import.solver.fronts`. Results
are the same to the last bit whatever the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array
from fe_import.solver.base import SINGULAR
from fe_import.solver.elimination import Elimination
from fe_import.solver.pieces import Advance, Doubtful, Work
from fe_import.solver.small import SMALL, TRUSTED, DenseFactor, dense_factor, signed_pivots
from fe_import.solver.threads import side_by_side, threads


@dataclass(frozen=True)
class MultifrontalFactor:
    """Cholesky factor of a positive definite matrix, piece by piece.

    Attributes
    ----------
    elimination : Elimination
    panels : tuple of arrays
        Columns of the fronts of each piece.
    """

    elimination: Elimination
    panels: tuple[Array, ...]

    def solve(self, right: Array) -> Array:
        """(n, k) or (n,) solutions."""
        from fe_import.solver.substitution import backward, forward

        layout, order = self.elimination.layout, self.elimination.order
        rows, begin = layout.spread
        columns = right.reshape(len(order), -1)
        x = np.zeros((begin[-1], columns.shape[1]))
        x[: len(order)] = columns[order]

        def beyond(number: int) -> Array:
            return x[begin[number] : begin[number + 1]]

        def substitute(kernel: Callable[..., None], number: int) -> None:
            piece = layout.pieces[number]
            own, across = layout.own[piece.first : piece.stop], layout.across[piece.first : piece.stop]
            memory = np.empty((max(int(own.max()), int(across.max())), x.shape[1]))
            kernel(piece.first, piece.stop, layout.table, rows, self.panels[number], x, memory)

        for wave in layout.waves:
            side_by_side(lambda number: substitute(forward, number), wave)
            for number in sorted(wave):
                x[layout.pieces[number].boundary] += beyond(number)
        for wave in reversed(layout.waves):
            for number in wave:
                beyond(number)[:] = x[layout.pieces[number].boundary]
            side_by_side(lambda number: substitute(backward, number), wave)
        result = np.empty_like(columns, dtype=float)
        result[order] = x[: len(order)]
        return result.reshape(right.shape)


def bytes_needed(elimination: Elimination, keep: bool = True) -> int:
    """Memory of an elimination at its largest, the factor included unless it is not kept."""
    return elimination.layout.peak_bytes(keep, threads())


def factorize(matrix: sp.csc_array, elimination: Elimination, advance: Advance) -> MultifrontalFactor | DenseFactor:
    """Cholesky factor of a positive definite matrix.

    Raises
    ------
    SingularMatrix
        A pivot is not positive, or within rounding of zero.
    """
    if matrix.shape[0] <= SMALL:
        return dense_factor(matrix, elimination)
    work = Work(matrix, elimination, advance, SINGULAR)
    work.run()
    return MultifrontalFactor(elimination, tuple(work.panels))


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
        Told the operations of what is done.
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
    if matrix.shape[0] <= SMALL:
        right = np.zeros((matrix.shape[0], 0))
        found = signed_pivots((matrix - shift * mass).toarray(), right, np.abs(matrix.diagonal()))
        return None if found is None else found[0]
    work = Work(matrix, elimination, advance, TRUSTED, mass, shift)
    try:
        work.run()
    except Doubtful:
        return None
    return sum(work.negative)
