"""The elimination of all pieces of a tree of fronts, those of one wave side by side.

Every sum is taken in the same order whatever the number of threads.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_import.compiled.jit import compiled_before
from fe_import.model import Array, IntArray
from fe_import.solver.base import SingularMatrix
from fe_import.solver.elimination import Elimination
from fe_import.solver.layout import CHILDREN, FIRST, REST, ROWS, Layout, Piece
from fe_import.solver.small import signed_pivots
from fe_import.solver.threads import side_by_side
from fe_import.solver.watch import say

_SLICE = 4e9  # operations between two looks at interrupts
_WIDE = 2e9  # operations of a front that all threads work on
_STRIP = 512  # rows or columns that a thread takes of it at a time

Advance = Callable[[float], None]
Places: TypeAlias = NDArray[np.int32]


class OutsidePattern(Exception):
    """A matrix has entries that the elimination does not foresee."""


class Doubtful(Exception):
    """A pivot is too small to trust its sign."""


class _Gathered(NamedTuple):
    """Of the tree and the matrices, as kernels take them."""

    table: IntArray
    rows: IntArray
    below: IntArray
    order: IntArray
    place: Places
    starts: IntArray
    indices: Places
    data: Array
    mass_starts: IntArray
    mass_indices: Places
    mass_data: Array
    shift: float


class Work:
    """One elimination of K, or K - λM of which signs are counted."""

    def __init__(
        self,
        matrix: sp.csc_array,
        elimination: Elimination,
        advance: Advance,
        limit: float,
        mass: sp.csc_array | None = None,
        shift: float = 0.0,
    ) -> None:
        if not compiled_before(__package__ or ""):
            say("compiling the sparse solver (once on this machine)")
        self._layout: Layout = elimination.layout
        self._advance, self._limit, self._keep = advance, limit, mass is None
        count = len(elimination.order)
        place = np.empty(count, dtype=np.int32)
        place[elimination.order] = np.arange(count)
        nothing = sp.csc_array((count, count))
        self._gathered = _Gathered(
            self._layout.table, self._layout.rows, self._layout.children, elimination.order, place,
            *_flat(matrix), *_flat(nothing if mass is None else mass), shift,
        )  # fmt: skip
        self._diagonal = np.abs(matrix.diagonal())[elimination.order]
        self._left: dict[int, Array] = {}
        self._memory = threading.local()
        self._done, self._lock, self._main = 0.0, threading.Lock(), threading.get_ident()
        self.panels: list[Array] = [np.zeros(0)] * len(self._layout.pieces)
        self.negative: list[int] = [0] * len(self._layout.pieces)

    def run(self) -> None:
        """Eliminate all pieces."""
        for wave in self._layout.waves:
            wide = [number for number in wave if self._is_wide(self._layout.pieces[number])]
            side_by_side(self._eliminate, [number for number in wave if number not in wide])
            for number in sorted(wide):
                self._eliminate(number)

    def _is_wide(self, piece: Piece) -> bool:
        return self._keep and piece.stop == piece.first + 1 and self._layout.operations[piece.first] > _WIDE

    def _told(self, first: int, stop: int) -> None:
        """Count what is done; listeners are told in the thread that asked."""
        with self._lock:
            self._done += float(self._layout.operations[first:stop].sum())
        if threading.get_ident() == self._main:
            self._advance(self._done)

    def _scratch(self, rows: int) -> tuple[Places, IntArray]:
        """Working memory of this thread."""
        if not hasattr(self._memory, "local"):
            self._memory.local = np.zeros(len(self._diagonal), dtype=np.int32)
        return self._memory.local, np.empty(rows, dtype=np.int64)

    def _eliminate(self, number: int) -> None:
        from fe_import.solver.fronts import eliminate

        layout, piece = self._layout, self._layout.pieces[number]
        own, across = layout.own[piece.first : piece.stop], layout.across[piece.first : piece.stop]
        panels = np.empty(piece.panel_size if self._keep else int((own * (own + across)).max()))
        rests = np.empty(piece.rest_size)
        local, to = self._scratch(int(across.max(initial=0)))
        if piece.wave:
            self._eliminate_one(number, panels, rests)
        else:
            front = piece.first
            while front < piece.stop:
                done = np.cumsum(layout.operations[front : piece.stop])
                stop = front + max(1, int(np.searchsorted(done, _SLICE)))
                begun, front = front, eliminate(
                    front, stop, *self._gathered, self._diagonal, self._limit, self._keep, panels, rests, local, to
                )  # fmt: skip
                if front < 0:
                    raise OutsidePattern
                if front < stop:
                    if self._keep:
                        raise SingularMatrix
                    self._indefinite(number, front, panels, rests, local, to)
                    front += 1
                self._told(begun, front)
        for root in piece.roots:
            size, at = int(layout.across[root]), int(layout.table[root, REST])
            if size:
                left = rests[at : at + size * size].reshape(size, size)
                self._left[root] = left if piece.wave else left.copy()
        if self._keep:
            self.panels[number] = panels

    def _views(self, front: int, panels: Array, rests: Array) -> tuple[Array, Array]:
        own, across = int(self._layout.own[front]), int(self._layout.across[front])
        at = int(self._layout.table[front, REST])
        return (
            panels[: own * (own + across)].reshape(own, own + across),
            rests[at : at + across * across].reshape(across, across),
        )

    def _indefinite(
        self, number: int, front: int, panels: Array, rests: Array, local: Places, to: IntArray
    ) -> None:
        """A front within a piece that takes pivots of both signs."""
        from fe_import.solver.fronts import gather_front

        columns, rest = self._views(front, panels, rests)
        gather_front(front, True, *self._gathered, columns, rest, rests, local, to)
        self._pivots(number, front, columns, rest)

    def _pivots(self, number: int, front: int, columns: Array, rest: Array) -> None:
        own, first = len(columns), self._layout.table[front, FIRST]
        found = signed_pivots(columns[:, :own].T, columns[:, own:], self._diagonal[first : first + own])
        if found is None:
            raise Doubtful
        self.negative[number] += found[0]
        taken = found[1].T @ columns[:, own:]
        for j in range(len(rest)):
            rest[j, j:] -= taken[j, j:]

    def _eliminate_one(self, number: int, panels: Array, rests: Array) -> None:
        """A front whose children are in other pieces."""
        from fe_import.solver import fronts

        front = self._layout.pieces[number].first
        columns, rest = self._views(front, panels, rests)
        wide = self._is_wide(self._layout.pieces[number])
        self._gather(front, columns, rest, wide)
        own, first = len(columns), int(self._layout.table[front, FIRST])
        diagonal = self._diagonal[first:]
        if wide:
            self._eliminate_wide(columns, rest, diagonal)
        elif fronts.factorize_block(columns, 0, own, self._limit, diagonal):
            if self._keep:
                raise SingularMatrix
            self._gather(front, columns, rest, wide)
            self._pivots(number, front, columns, rest)
        elif len(rest):
            fronts.divide_rows(columns, 0, own, own, own + len(rest))
            fronts.take_from_rest(rest, columns, own, 0, len(rest))
        if self._keep:
            fronts.invert_front(columns, own)
        for child in self._children(front):
            self._left.pop(child, None)
        self._told(front, front + 1)

    def _children(self, front: int) -> list[int]:
        table = self._layout.table
        return list(map(int, self._layout.children[table[front, CHILDREN] : table[front + 1, CHILDREN]]))

    def _gather(self, front: int, columns: Array, rest: Array, wide: bool) -> None:
        from fe_import.solver.fronts import extend_front, gather_front

        table, own = self._layout.table, len(columns)
        rows = self._layout.rows[table[front, ROWS] : table[front + 1, ROWS]]
        local, to = self._scratch(len(rows))
        if not gather_front(front, False, *self._gathered, columns, rest, np.zeros(0), local, to):
            raise OutsidePattern
        for child in self._children(front):
            if child not in self._left:
                continue
            left = self._left[child]
            to = local[self._layout.rows[table[child, ROWS] : table[child + 1, ROWS]]].astype(np.int64)
            if wide:
                side_by_side(
                    lambda ends: extend_front(columns, rest, own, to, left, *ends),  # noqa: B023
                    _strips(0, len(left)),
                )
            else:
                extend_front(columns, rest, own, to, left, 0, len(left))

    def _eliminate_wide(self, columns: Array, rest: Array, diagonal: Array) -> None:
        """One front by all threads, in strips that are the same whatever their number."""
        from fe_import.solver import fronts

        own, size = columns.shape
        for begin in range(0, own, fronts.BLOCK):
            end = min(begin + fronts.BLOCK, own)
            if begin:
                side_by_side(
                    lambda ends: fronts.take_from_rows(columns, begin, end, *ends),  # noqa: B023
                    _strips(begin, size),
                )
            if fronts.factorize_block(columns, begin, end, self._limit, diagonal[begin:]):
                raise SingularMatrix
            side_by_side(
                lambda ends: fronts.divide_rows(columns, begin, end, *ends),  # noqa: B023
                _strips(end, size),
            )
        side_by_side(lambda ends: fronts.take_from_rest(rest, columns, own, *ends), _strips(0, len(rest)))


def _strips(begin: int, end: int) -> list[tuple[int, int]]:
    """Ranges of rows or columns."""
    return [(low, min(low + _STRIP, end)) for low in range(begin, end, _STRIP)]


def _flat(matrix: sp.csc_array) -> tuple[IntArray, Places, Array]:
    """A sparse matrix as kernels take it."""
    return (
        np.ascontiguousarray(matrix.indptr, dtype=np.int64),
        np.ascontiguousarray(matrix.indices, dtype=np.int32),
        np.ascontiguousarray(matrix.data, dtype=float),
    )

