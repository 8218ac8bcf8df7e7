"""In which order dofs are eliminated, and what the factor will hold: known from the pattern alone.

Dofs are eliminated front by front, a front being a separator or leaf of the dissection. Eliminating it couples all
dofs of later fronts that it touches (its rows). The counts of entries, operations and memory that follow are those
of the multifrontal factorization to the last number, not estimates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array, IntArray
from fe_import.solver.dissection import dissect
from fe_import.solver.graph import Graph, matrix_graph
from fe_import.solver.layout import Layout, lay_out


@dataclass(frozen=True)
class Elimination:
    """An order of elimination and its fronts, children before parents.

    Attributes
    ----------
    order : (n,) int array
        Dof that is eliminated k-th. "Places" are positions in this order.
    starts : (f + 1,) int array
        First place of each front; the last entry is n.
    rows : tuple of (r,) int arrays
        Places, beyond the front, that it couples; rising.
    children : tuple of tuples
        Fronts whose first row lies in this one.
    """

    order: IntArray
    starts: IntArray
    rows: tuple[IntArray, ...]
    children: tuple[tuple[int, ...], ...]

    @cached_property
    def layout(self) -> Layout:
        """Where numbers lie, and what is eliminated side by side."""
        return lay_out(self.starts, self.rows, self.children)

    @property
    def nonzeros(self) -> int:
        """Entries of the lower triangular factor."""
        own, across = self.layout.own, self.layout.across
        return int((own * (own + 1) // 2 + own * across).sum())

    @property
    def operations(self) -> Array:
        """(f,) multiplications and additions that each front takes in a Cholesky factorization."""
        return self.layout.operations

    @property
    def expected_seconds(self) -> float:
        """Of a factorization, on one core of 2023 (30 operations and 0.12 added entries per nanosecond); machines and
        their load differ by a factor of three."""
        return float(self.operations.sum() / 3e10 + (self.layout.across.astype(float) ** 2).sum() / 1.2e8)


def analyse(matrix: sp.csc_array, positions: Array | None = None) -> Elimination:
    """Order and fronts for a matrix of symmetric pattern.

    Parameters
    ----------
    matrix : (n, n) sparse CSC
        Only its pattern is looked at.
    positions : (n, 3) array or None
        Where each dof sits; without, the order is found from the graph alone, more slowly and not quite as good.
    """
    graph = matrix_graph(matrix)
    number = dissect(graph, None if positions is None else np.asarray(positions, dtype=float)[graph.first])
    vertices = _children_first(number)
    sorted_number = number[vertices]
    starts = np.flatnonzero(np.diff(sorted_number, prepend=0, append=0))
    rows, children = _fronts(graph, vertices, starts)
    sequence = _subtrees_together(children)
    if (np.diff(sequence) != 1).any():  # a separator that separates nothing is nobody's parent
        vertices = vertices[_ranges(starts[sequence], starts[sequence + 1])]
        starts = np.concatenate([[0], np.cumsum(np.diff(starts)[sequence])])
        rows, children = _fronts(graph, vertices, starts)

    # from vertices to dofs
    first = np.concatenate([[0], np.cumsum(np.bincount(graph.vertex)[vertices])])
    place = np.empty(len(vertices), dtype=np.int64)
    place[vertices] = np.arange(len(vertices))
    order = np.argsort(place[graph.vertex], kind="stable")
    return Elimination(order, first[starts], tuple(_ranges(first[r], first[r + 1]) for r in rows), children)


def _children_first(number: IntArray) -> IntArray:
    """Vertices sorted by their number in the tree of the dissection, each subtree before its root."""
    depth = np.frexp(number.astype(float))[1].astype(np.int64)
    last = (number + 1) << (depth.max(initial=0) - depth)  # the rightmost leaf below
    return np.lexsort((np.arange(len(number)), -depth, last))


def _subtrees_together(children: tuple[tuple[int, ...], ...]) -> IntArray:
    """Fronts in an order in which each comes right after all that are below it."""
    below = {child for each in children for child in each}
    waiting = [front for front in range(len(children)) if front not in below]
    found = []
    while waiting:
        found.append(waiting.pop())
        waiting += children[found[-1]]
    return np.array(found[::-1], dtype=np.int64)


def _fronts(
    graph: Graph, vertices: IntArray, starts: IntArray
) -> tuple[list[IntArray], tuple[tuple[int, ...], ...]]:
    """Rows of each front, among the sorted vertices, and its children."""
    size, count = len(vertices), len(starts) - 1
    place = np.empty(size, dtype=np.int64)
    place[vertices] = np.arange(size)
    front = np.repeat(np.arange(count), np.diff(starts))
    a, b = place[graph.a], place[graph.b]
    lower, upper = np.minimum(a, b), np.maximum(a, b)
    leaving = upper >= starts[front[lower] + 1]
    pairs = np.unique(front[lower[leaving]] * size + upper[leaving])
    own, limits = pairs % max(size, 1), np.searchsorted(pairs, np.arange(count + 1) * size)
    rows: list[IntArray] = []
    children: list[list[int]] = [[] for _ in range(count)]
    for k in range(count):
        found = own[limits[k] : limits[k + 1]]
        if children[k]:
            found = np.unique(np.concatenate([found, *(rows[child] for child in children[k])]))
            found = found[np.searchsorted(found, starts[k + 1]) :]
        rows.append(found)
        if len(found):
            children[front[found[0]]].append(k)
    return rows, tuple(map(tuple, children))


def _ranges(first: IntArray, last: IntArray) -> IntArray:
    """first[0] ... last[0] - 1, first[1] ... last[1] - 1, and so on."""
    length = last - first
    return np.asarray(np.arange(length.sum()) + np.repeat(first - np.cumsum(length) + length, length))
