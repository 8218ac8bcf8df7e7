"""Linear constraints between nodal components: which are independent, and what the others follow from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class Dependence:
    """All nodal components = ``matrix`` @ independent ones.

    Attributes
    ----------
    matrix : (d, f) sparse CSR
        The identity on the rows ``independent``.
    independent : (f,) int array
        Rows that are the independent dofs, rising.
    """

    matrix: sp.csr_array
    independent: IntArray

    @staticmethod
    def free(count: int) -> Dependence:
        """No constraint."""
        return Dependence(sp.eye_array(count, format="csr"), np.arange(count))

    def extended(self, count: int) -> Dependence:
        """With further components behind, all independent."""
        matrix = sp.block_diag([self.matrix, sp.eye_array(count)], format="csr")
        rows = self.matrix.shape[0] + np.arange(count)
        return Dependence(sp.csr_array(matrix), np.concatenate([self.independent, rows]))

    def columns(self, rows: IntArray) -> IntArray:
        """Columns of the independent dofs among rows; -1 for rows that depend on others."""
        place = np.searchsorted(self.independent, rows).clip(max=len(self.independent) - 1)
        return np.where(self.independent[place] == rows, place, -1)

    def following(self, columns: IntArray, expression: sp.csr_array) -> Dependence:
        """Independent dofs made dependent.

        Parameters
        ----------
        columns : (k,) int array
            Of the dofs that follow from now on.
        expression : (k, f) sparse
            What they are in terms of the present independent dofs; zero at ``columns``.
        """
        count = len(self.independent)
        kept = np.setdiff1d(np.arange(count), columns)
        new = np.full(count, -1)
        new[kept] = np.arange(len(kept))
        terms = sp.coo_array(expression)
        row, column = terms.coords
        step = sp.csr_array(
            (
                np.concatenate([np.ones(len(kept)), terms.data]),
                (np.concatenate([kept, columns[row]]), np.concatenate([new[kept], new[column]])),
            ),
            shape=(count, len(kept)),
        )
        return Dependence(sp.csr_array(self.matrix @ step), self.independent[kept])


def arm(offsets: Array) -> Array:
    """(k, 3, 6) displacement of points at ``offsets`` (k, 3) from a node, per displacement and rotation of it."""
    result = np.zeros((len(offsets), 3, 6))
    result[:, :, :3] = np.eye(3)
    x, y, z = offsets.T
    result[:, 0, 4], result[:, 0, 5] = z, -y
    result[:, 1, 5], result[:, 1, 3] = x, -z
    result[:, 2, 3], result[:, 2, 4] = y, -x
    return result


def block_rows(dense: Array, columns: IntArray, width: int) -> sp.csr_array:
    """(k, width) sparse matrix with the (k, c) ``dense`` one in some of its columns."""
    rows = np.repeat(np.arange(len(dense)), len(columns))
    return sp.csr_array((dense.ravel(), (rows, np.tile(columns, len(dense)))), shape=(len(dense), width))
