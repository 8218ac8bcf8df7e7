"""Sums of element blocks into a dense or sparse matrix, and of element forces into a vector."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from erls.maths.saddle import Matrix
from erls.maths.so3 import Array

IntArray = NDArray[np.int64]

DENSE_UP_TO = 90  # columns; where a sparse factorization begins to pay


class Scatter:
    """Where the entries of blocks go; entries with a negative row or column are dropped (the ground).

    Parameters
    ----------
    rows, columns : list of (e, r) and (e, c) arrays
        Numbers of the rows and columns of e blocks (e, r, c), one pair for each family of blocks.
    shape : (int, int)
    """

    def __init__(self, rows: list[IntArray], columns: list[IntArray], shape: tuple[int, int]) -> None:
        self.shape, self.sparse = shape, shape[1] > DENSE_UP_TO
        every = [np.broadcast_arrays(r[:, :, None], c[:, None, :]) for r, c in zip(rows, columns, strict=True)]
        row = np.concatenate([r.ravel() for r, _ in every]) if every else np.zeros(0, dtype=np.int64)
        column = np.concatenate([c.ravel() for _, c in every]) if every else np.zeros(0, dtype=np.int64)
        self._kept = (row >= 0) & (column >= 0)
        row, column = row[self._kept], column[self._kept]
        if self.sparse:
            key, place = np.unique(column * shape[0] + row, return_inverse=True)
            self._place: IntArray = np.asarray(place, dtype=np.int64)
            self._indices = key % shape[0]
            self._starts = np.searchsorted(key, np.arange(shape[1] + 1) * shape[0])
        else:
            self._place = row * shape[1] + column

    def matrix(self, blocks: list[Array]) -> Matrix:
        """The sum of all blocks."""
        values = np.concatenate([b.ravel() for b in blocks])[self._kept] if blocks else np.zeros(0)
        if self.sparse:
            summed: Array = np.asarray(np.bincount(self._place, values, len(self._indices)), dtype=float)
            return sp.csc_array((summed, self._indices, self._starts), shape=self.shape)
        flat: Array = np.asarray(np.bincount(self._place, values, self.shape[0] * self.shape[1]), dtype=float)
        return flat.reshape(self.shape)


def dofs(nodes: IntArray) -> IntArray:
    """(e, 6k) coordinates of the nodes (e, k) of elements; those of the ground, node −1, are negative."""
    numbers = 6 * nodes[..., None] + np.arange(6)
    numbers = np.where(nodes[..., None] < 0, -1, numbers)
    result: IntArray = numbers.reshape(*nodes.shape[:-1], 6 * nodes.shape[-1])
    return result
