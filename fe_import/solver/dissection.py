"""Nested dissection: a graph is cut in two by removing a few vertices, the halves are cut again, and so on.

Eliminated last, the removed vertices (separators) keep the halves from filling each other in (A. George, SIAM J.
Numer. Anal. 10, 1973). All parts of one level are cut at once. Where positions are known, a part is cut across a
coordinate axis or its principal axis, whichever separator is smaller; otherwise between two far ends, by the number
of edges to them. The cut goes where the vertices leave the widest gap near the middle, which on a regular mesh is
between two layers of nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import breadth_first_order

from fe_import.model import Array, IntArray
from fe_import.solver.graph import Graph

LEAF = 20  # vertices that are not cut further
_WINDOW = 0.1  # the cut is within this share of the vertices from the middle

Flags = NDArray[np.bool_]


@dataclass
class _Level:
    """What is left to cut: vertices, the part each is in (0 ... parts - 1), and the edges within parts."""

    vertices: IntArray
    part: IntArray
    count: IntArray
    a: IntArray
    b: IntArray

    def start(self) -> IntArray:
        return np.asarray(np.cumsum(self.count) - self.count)


def dissect(graph: Graph, positions: Array | None = None) -> IntArray:
    """Number of the separator or leaf that each vertex belongs to.

    Parameters
    ----------
    graph : Graph
    positions : (v, 3) array or None
        Of the vertices.

    Returns
    -------
    (v,) int array
        Numbers of a binary tree: 1 is the root, the halves of k are 2 k and 2 k + 1.
    """
    total = len(graph.first)
    number = np.zeros(total, dtype=np.int64)
    vertices, label = np.arange(total), np.ones(total, dtype=np.int64)
    a, b = graph.a.astype(np.int64), graph.b.astype(np.int64)
    while True:
        count = np.unique(label, return_inverse=True, return_counts=True)[1:]
        small = count[1][count[0]] <= LEAF
        number[vertices[small]] = label[small]
        vertices, label, a, b = _kept(~small, vertices, label, a, b)
        if not len(vertices):
            return number
        _, part, sizes = np.unique(label, return_inverse=True, return_counts=True)
        level = _Level(vertices, part, sizes, a, b)
        side, separator = _best_cut(level, None if positions is None else positions[vertices])
        number[vertices[separator]] = label[separator]
        label = 2 * label + side
        inside = side[a] == side[b]
        vertices, label, a, b = _kept(~separator, vertices, label, a[inside], b[inside])


def _kept(keep: Flags, vertices: IntArray, label: IntArray, a: IntArray, b: IntArray) -> tuple[IntArray, ...]:
    """Some of the vertices and the edges between them, renumbered."""
    new = np.cumsum(keep) - 1
    both = keep[a] & keep[b]
    return vertices[keep], label[keep], new[a[both]], new[b[both]]


def _best_cut(level: _Level, positions: Array | None) -> tuple[Flags, Flags]:
    """The side that each vertex is on, and which vertices separate; each part takes its smallest separator."""
    best: tuple[Flags, Flags, IntArray] | None = None
    for coordinate in _along_hops(level) if positions is None else _along_axes(level, positions):
        side = _cut_at_gap(level, coordinate)
        separator, size = _separator(level, side)
        if best is None:
            best = side, separator, size
        else:
            better = (size < best[2])[level.part]
            best = np.where(better, side, best[0]), np.where(better, separator, best[1]), np.minimum(size, best[2])
    assert best is not None
    return best[0], best[1]


def _along_axes(level: _Level, positions: Array) -> Iterator[Array]:
    """Coordinate of each vertex along the longest coordinate axis of its part, and along its principal axis."""
    part, count = level.part, level.count
    sums = [np.bincount(part, positions[:, c]) for c in range(3)]
    offset = positions - (np.stack(sums, axis=1) / count[:, None])[part]
    spread = np.empty((len(count), 3, 3))
    for c in range(3):
        for d in range(c, 3):
            spread[:, c, d] = spread[:, d, c] = np.bincount(part, offset[:, c] * offset[:, d])
    longest = np.diagonal(spread, axis1=1, axis2=2).argmax(axis=1)
    yield np.take_along_axis(offset, longest[part][:, None], axis=1)[:, 0]
    principal = np.linalg.eigh(spread)[1][:, :, -1]
    yield np.einsum("vc,vc->v", offset, principal[part])


def _along_hops(level: _Level) -> Iterator[Array]:
    """Difference of the distances in edges from two far ends of each part, and distance from one of them."""
    size = len(level.part)
    ends = np.concatenate([level.a, level.b, np.full(len(level.count), size)])
    others = np.concatenate([level.b, level.a, level.start()])
    last = len(level.a) * 2

    def distances(sources: IntArray) -> Array:
        others[last:] = sources
        graph = sp.csr_array((np.ones(len(ends), dtype=np.int8), (ends, others)), shape=(size + 1, size + 1))
        return _hops(graph, size)

    in_parts = np.argsort(level.part, kind="stable")
    near = distances(_farthest(level, distances(in_parts[level.start()])))
    yield near - distances(_farthest(level, near))
    yield near


def _farthest(level: _Level, distance: Array) -> IntArray:
    """A vertex of each part of largest distance."""
    return np.asarray(np.lexsort((distance, level.part))[level.start() + level.count - 1])


def _hops(graph: sp.csr_array, source: int) -> Array:
    """Edges from the neighbours of a vertex to all others; the number of vertices where there is no way."""
    order, before = breadth_first_order(graph, source)
    place = np.empty(graph.shape[0], dtype=np.int64)
    place[order] = np.arange(len(order))
    parent = place[before[order[1:]]]  # rises, since breadth comes first
    result = np.full(graph.shape[0], float(graph.shape[0]))
    first, last, depth = 0, 1, -1
    while first < last:
        result[order[first:last]] = depth
        first, last, depth = last, 1 + int(np.searchsorted(parent, last)), depth + 1
    return result[:-1]


def _cut_at_gap(level: _Level, coordinate: Array) -> Flags:
    """Which vertices are above the widest gap of a coordinate near the middle of their part."""
    start, count = level.start(), level.count
    order = np.lexsort((coordinate, level.part))
    part, rising = level.part[order], coordinate[order]
    rank = np.arange(len(order)) - start[part]
    gap = np.diff(rising, prepend=rising[:1])
    reach = np.abs(rank - count[part] / 2)
    gap[(rank == 0) | (reach > np.maximum(_WINDOW * count[part], 1))] = -1.0
    widest = np.maximum.reduceat(gap, start)
    candidates = np.flatnonzero(gap >= 0.999 * widest[part])  # of gaps that differ by rounding, the middle one
    candidates = candidates[np.lexsort((reach[candidates], part[candidates]))]
    cut = candidates[np.searchsorted(part[candidates], np.arange(len(count)))]
    above = np.empty(len(order), dtype=bool)
    above[order] = np.arange(len(order)) >= cut[part]
    return above


def _separator(level: _Level, side: Flags) -> tuple[Flags, IntArray]:
    """The vertices on one side with edges across the cut, on the side with fewer; their number in each part."""
    across = side[level.a] != side[level.b]
    touched = np.zeros(len(side), dtype=bool)
    touched[level.a[across]] = touched[level.b[across]] = True
    parts = len(level.count)
    below = np.bincount(level.part[touched & ~side], minlength=parts)
    above = np.bincount(level.part[touched & side], minlength=parts)
    return touched & (side == (above < below)[level.part]), np.minimum(below, above)
