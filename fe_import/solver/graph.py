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
    _, first, vertex = np.unique(_pattern_keys(matrix), return_index=True, return_inverse=True)
    chosen = matrix[:, first]
    is_first = np.zeros(matrix.shape[0], dtype=bool)
    is_first[first] = True
    below, above = [np.zeros((2, 0), dtype=np.int32)], [np.zeros((2, 0), dtype=np.int32)]
    for start, stop in _chunks(chosen.indptr):
        rows = chosen.indices[chosen.indptr[start] : chosen.indptr[stop]]
        columns = np.repeat(np.arange(start, stop), np.diff(chosen.indptr[start : stop + 1]))
        seen = is_first[rows]
        pair = np.stack([columns[seen], vertex[rows[seen]]]).astype(np.int32)
        below.append(pair[:, pair[1] > pair[0]])
        above.append(pair[::-1, pair[1] < pair[0]])
    edges = np.concatenate(below, axis=1)
    if _checksum(edges) != sum(map(_checksum, above)) % 2**64:
        edges = np.concatenate([edges, *above], axis=1)
    return Graph(vertex.astype(np.int64), first.astype(np.int64), edges[0], edges[1])


def _checksum(edges: NDArray[np.int32]) -> int:
    """Equal for equal sets of edges, in whatever order."""
    a, b = edges.astype(np.uint64)
    mixed = (a << np.uint64(32) | b) * np.uint64(0x9E3779B97F4A7C15)
    return int(((mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)).sum(dtype=np.uint64))


def _pattern_keys(matrix: sp.csc_array) -> NDArray[np.uint64]:
    """(n,) keys, equal for columns with entries in the same rows: sums of random 64-bit numbers, one per row."""
    n = matrix.shape[0]
    number = np.random.default_rng(0).integers(1, 2**63, n, dtype=np.uint64)
    keys = number.copy()  # the diagonal counts whether or not it is stored
    for start, stop in _chunks(matrix.indptr):
        rows = matrix.indices[matrix.indptr[start] : matrix.indptr[stop]]
        counts = np.diff(matrix.indptr[start : stop + 1])
        terms = np.where(rows == np.repeat(np.arange(start, stop), counts), np.uint64(0), number[rows])
        filled = start + np.flatnonzero(counts)
        keys[filled] += np.add.reduceat(terms, matrix.indptr[filled] - matrix.indptr[start])
    return np.asarray(keys)


def _chunks(indptr: IntArray) -> list[tuple[int, int]]:
    """Ranges of columns with at most `_CHUNK` entries each, or one column; empty columns in front may be left out."""
    n = len(indptr) - 1
    cuts = [int(np.searchsorted(indptr, indptr[0], side="right")) - 1] if n else [0]
    while cuts[-1] < n:
        cuts.append(max(cuts[-1] + 1, int(np.searchsorted(indptr, indptr[cuts[-1]] + _CHUNK, side="right")) - 1))
    return list(itertools.pairwise(cuts))
