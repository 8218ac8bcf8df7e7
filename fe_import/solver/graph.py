"""The graph of a sparse symmetric matrix, dofs of one and the same pattern merged into one vertex."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_import.model import IntArray

_CHUNK = 4_000_000  # matrix entries looked at in one go


@dataclass(frozen=True)
class Graph:
    """Vertices and edges.

    Attributes
    ----------
    vertex : (n,) int array
        Vertex of each dof; the three dofs of a solid's node share one.
    first : (v,) int array
        A dof of each vertex.
    a, b : (e,) int arrays
        The two ends of each edge.
    """

    vertex: IntArray
    first: IntArray
    a: NDArray[np.int32]
    b: NDArray[np.int32]


def matrix_graph(matrix: sp.csc_array) -> Graph:
    """Graph of a symmetric matrix; an entry whose mirror image is not stored counts all the same."""
    keys, symmetric = _pattern_keys(matrix)
    if not symmetric:
        pattern = sp.csc_array((np.ones(matrix.nnz, dtype=np.int8), matrix.indices, matrix.indptr), matrix.shape)
        matrix = (pattern + pattern.T).tocsc()
        keys, _ = _pattern_keys(matrix)
    _, first, vertex = np.unique(keys, return_index=True, return_inverse=True)
    chosen = matrix[:, first]
    is_first = np.zeros(matrix.shape[0], dtype=bool)
    is_first[first] = True
    edges = [np.zeros((2, 0), dtype=np.int32)]
    for start, stop in _chunks(chosen.indptr):
        rows = chosen.indices[chosen.indptr[start] : chosen.indptr[stop]]
        columns = np.repeat(np.arange(start, stop), np.diff(chosen.indptr[start : stop + 1]))
        seen = is_first[rows]
        pair = np.stack([columns[seen], vertex[rows[seen]]]).astype(np.int32)
        edges.append(pair[:, pair[1] > pair[0]])
    a, b = np.concatenate(edges, axis=1)
    return Graph(vertex.astype(np.int64), first.astype(np.int64), a, b)


def _pattern_keys(matrix: sp.csc_array) -> tuple[NDArray[np.uint64], bool]:
    """(n,) keys, equal for columns with entries in the same rows, and whether the pattern is symmetric.

    A key is the sum of random 64-bit numbers, one per row; sums over all entries of the product of a number of the
    row and another of the column tell whether these can change roles.
    """
    n = matrix.shape[0]
    number = np.random.default_rng(0).integers(1, 2**63, (2, n), dtype=np.uint64)
    keys = number.copy()  # the diagonal counts whether or not it is stored
    for start, stop in _chunks(matrix.indptr):
        rows = matrix.indices[matrix.indptr[start] : matrix.indptr[stop]]
        counts = np.diff(matrix.indptr[start : stop + 1])
        own = rows == np.repeat(np.arange(start, stop), counts)
        filled = start + np.flatnonzero(counts)
        for k in range(2):
            terms = number[k][rows]
            terms[own] = 0
            keys[k, filled] += np.add.reduceat(terms, matrix.indptr[filled] - matrix.indptr[start])
    return keys[0], bool((keys[0] * number[1]).sum() == (keys[1] * number[0]).sum())


def _chunks(indptr: IntArray) -> list[tuple[int, int]]:
    """Ranges of columns with at most `_CHUNK` entries each, or one column; empty columns in front may be left out."""
    n = len(indptr) - 1
    cuts = [int(np.searchsorted(indptr, indptr[0], side="right")) - 1] if n else [0]
    while cuts[-1] < n:
        cuts.append(max(cuts[-1] + 1, int(np.searchsorted(indptr, indptr[cuts[-1]] + _CHUNK, side="right")) - 1))
    return list(itertools.pairwise(cuts))
