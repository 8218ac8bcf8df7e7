"""Where the numbers of fronts lie, and which fronts are eliminated side by side.

The tree of fronts is cut into pieces, the same ones whatever the number of threads: subtrees of at most a sixteenth of
the work, eliminated each by one thread, and the fronts above them, each a piece of its own. Pieces of one wave need
nothing of each other. Within a piece the matrices that fronts leave to their parents lie in one array: a parent's is
made before those of its children are given up, so that fronts of even depth stack up from its begin, others from its
end, and what is needed next is always on top.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_import.model import Array, IntArray

_SHARE = 16  # pieces that the work is cut into, at least
_LEAST = 1e8  # operations of a piece worth a thread
FIRST, ROWS, CHILDREN, PANEL, REST = range(5)
"""Columns of the table of fronts: its first place, where its rows and its children are listed (the next front's entries
are the ends), where its columns and what it leaves to its parent lie in the arrays of its piece."""


@dataclass(frozen=True)
class Piece:
    """Fronts that one thread eliminates.

    Attributes
    ----------
    first, stop : int
        The fronts.
    wave : int
        Pieces of lower waves come before.
    roots : tuple of int
        Fronts whose parents are in other pieces.
    panel_size, rest_size : int
        Numbers of the factor, and of what its fronts leave to parents at most at a time.
    boundary : (b,) int array
        Places beyond the piece that it touches; rising.
    """

    first: int
    stop: int
    wave: int
    roots: tuple[int, ...]
    panel_size: int
    rest_size: int
    boundary: IntArray


@dataclass(frozen=True)
class Layout:
    """Fronts in flat arrays.

    Attributes
    ----------
    table : (f + 1, 5) int array
    rows, children : int arrays
    pieces : tuple of Piece
        In the order of their fronts.
    operations : (f,) array
        Work of each front.
    """

    table: IntArray
    rows: IntArray
    children: IntArray
    pieces: tuple[Piece, ...]
    operations: Array

    @cached_property
    def own(self) -> IntArray:
        """(f,) dofs that each front eliminates."""
        return np.diff(self.table[:, FIRST])

    @cached_property
    def across(self) -> IntArray:
        """(f,) rows of each front."""
        return np.diff(self.table[:, ROWS])

    @cached_property
    def waves(self) -> tuple[tuple[int, ...], ...]:
        """Pieces that need nothing of each other, the largest first."""
        work = [-float(self.operations[piece.first : piece.stop].sum()) for piece in self.pieces]
        last = max((piece.wave for piece in self.pieces), default=-1)
        found: list[list[int]] = [[] for _ in range(last + 1)]
        for number in sorted(range(len(work)), key=work.__getitem__):
            found[self.pieces[number].wave].append(number)
        return tuple(map(tuple, found))

    @cached_property
    def spread(self) -> tuple[IntArray, IntArray]:
        """Rows for solutions: those beyond a piece lie behind all places, each piece's own.

        Returns
        -------
        rows : int array
        begin : (p + 1,) int array
            Where those of each piece begin.
        """
        lengths = [len(piece.boundary) for piece in self.pieces]
        begin = self.table[-1, FIRST] + np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)])
        rows = self.rows.copy()
        for number, piece in enumerate(self.pieces):
            part = rows[self.table[piece.first, ROWS] : self.table[piece.stop, ROWS]]
            beyond = part >= self.table[piece.stop, FIRST]
            part[beyond] = begin[number] + np.searchsorted(piece.boundary, part[beyond])
        return rows, begin

    def peak_bytes(self, keep: bool, threads: int) -> int:
        """Memory of an elimination at its largest, the factor included where it is kept."""
        places = int(self.table[-1, FIRST]) // 2  # of 32 bits, counted in numbers of 64
        kept, waiting, peak = 0, 0, 0
        left = [sum(int(self.across[root]) ** 2 for root in piece.roots) for piece in self.pieces]
        for wave in self.waves:
            working = [places + self._working(self.pieces[number], keep) for number in wave]
            for k, number in enumerate(wave):
                kept += self.pieces[number].panel_size if keep else 0
                waiting += left[number]
                peak = max(peak, kept + waiting + sum(working[max(0, k + 1 - threads) : k + 1]))
            waiting -= sum(self._consumed(number) for number in wave)
        return 8 * max(peak, kept)

    def _working(self, piece: Piece, keep: bool) -> int:
        """Numbers that are given up when a piece is done; fronts above others leave their matrix as it is."""
        return (0 if piece.wave else piece.rest_size) + (0 if keep else self._largest_panel(piece))

    def _largest_panel(self, piece: Piece) -> int:
        own, across = self.own[piece.first : piece.stop], self.across[piece.first : piece.stop]
        return int((own * (own + across)).max(initial=0))

    def _consumed(self, number: int) -> int:
        """What the children of a piece in other pieces left to it."""
        piece, total = self.pieces[number], 0
        for front in range(piece.first, piece.stop):
            for child in self.children[self.table[front, CHILDREN] : self.table[front + 1, CHILDREN]]:
                total += int(self.across[child]) ** 2 if child < piece.first else 0
        return total


def lay_out(starts: IntArray, rows: tuple[IntArray, ...], children: tuple[tuple[int, ...], ...]) -> Layout:
    """Of fronts in the order of their elimination; arguments as in `fe_import.solver.elimination.Elimination`."""
    count = len(rows)
    own, across = np.diff(starts), np.array([len(r) for r in rows], dtype=np.int64)
    size = own.astype(float)
    operations = size**3 / 3 + size**2 * across + size * across.astype(float) ** 2
    parent = np.full(count, -1)
    for front, below in enumerate(children):
        parent[list(below)] = front
    table = np.zeros((count + 1, 5), dtype=np.int64)
    table[:, FIRST] = starts
    table[1:, ROWS] = np.cumsum(across)
    table[1:, CHILDREN] = np.cumsum([len(c) for c in children], dtype=np.int64)
    pieces = []
    for first, stop, wave in _ranges(operations, parent):
        panels = np.cumsum(own[first:stop] * (own[first:stop] + across[first:stop]))
        table[first + 1 : stop, PANEL] = panels[:-1]
        roots = tuple(int(k) for k in first + np.flatnonzero((parent[first:stop] < 0) | (parent[first:stop] >= stop)))
        at, rest_size = _stacked(first, stop, parent, across)
        table[first:stop, REST] = at
        boundary = np.unique(np.concatenate([rows[root] for root in roots]))
        pieces.append(Piece(first, stop, wave, roots, int(panels[-1]), rest_size, boundary))
    flat = np.concatenate([np.zeros(0, dtype=np.int64), *rows])
    listed = np.array([child for each in children for child in each], dtype=np.int64)
    return Layout(table, flat, listed, tuple(pieces), operations)


def _ranges(operations: Array, parent: IntArray) -> list[tuple[int, int, int]]:
    """First front, the one after the last, and wave of each piece."""
    count = len(parent)
    work, first, wave = operations.copy(), np.arange(count), np.zeros(count, dtype=np.int64)
    limit = max(operations.sum() / _SHARE, _LEAST)
    for front in range(count):  # children come before
        if work[front] > limit:
            wave[front] += 1
        above = parent[front]
        if above >= 0:
            work[above] += work[front]
            first[above] = min(first[above], first[front])
            wave[above] = max(wave[above], wave[front])
    found: list[tuple[int, int, int]] = []
    taken = limit
    for front in range(count):
        if work[front] > limit:
            found.append((front, front + 1, int(wave[front])))
            taken = limit
        elif parent[front] < 0 or work[parent[front]] > limit:
            if found and taken + work[front] <= limit:  # small ones side by side
                found[-1] = (found[-1][0], front + 1, 0)
                taken += work[front]
            else:
                found.append((int(first[front]), front + 1, 0))
                taken = work[front]
    return found


def _stacked(first: int, stop: int, parent: IntArray, across: IntArray) -> tuple[IntArray, int]:
    """Where in the array of a piece each front leaves its matrix, and the size of the array."""
    depth = np.zeros(stop - first, dtype=np.int64)
    for front in range(stop - 2, first - 1, -1):
        if first <= parent[front] < stop:
            depth[front - first] = depth[parent[front] - first] + 1
    used, largest = [0, 0], 0
    at, given = np.zeros(stop - first, dtype=np.int64), np.zeros(stop - first, dtype=np.int64)
    for front in range(first, stop):
        k, size = front - first, int(across[front]) ** 2
        side = int(depth[k] % 2)
        at[k] = used[side]
        used[side] += size
        largest = max(largest, sum(used))
        used[1 - side] -= int(given[k])
        if first <= parent[front] < stop:
            given[parent[front] - first] += size
    odd = depth % 2 == 1
    at[odd] = largest - at[odd] - across[first:stop][odd] ** 2
    return at, largest
