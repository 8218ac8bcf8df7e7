"""Compiled elimination of fronts: every front is a small dense matrix that LAPACK factorizes.

A front gathers the entries of its own dofs and what eliminating its children left over for it, factorizes the own
part, and leaves a matrix over its rows to its parent (I. S. Duff & J. K. Reid, ACM Trans. Math. Software 9, 1983;
J. W. H. Liu, SIAM Review 34, 1992). Only lower triangles are meant. Matrices lie by columns: row j of an array is
column j of the matrix. A front's columns hold its own part (o, o), and below it the part across (r, o).

Diagonal blocks of the factor, `BLOCK` wide, are left inverted: a product is faster than a substitution where
right-hand sides are few.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fe_import.compiled.jit import helper, kernel
from fe_import.model import Array, IntArray
from fe_import.solver.blocks import cholesky, divide, invert, subtract_product, subtract_square
from fe_import.solver.layout import CHILDREN, FIRST, PANEL, REST, ROWS

BLOCK = 1024  # narrower ones cost slender links digits: substitution beside inverses is less exact than either
Places: TypeAlias = NDArray[np.int32]  # 32 bits
_MATRIX = "int64[::1], int32[::1], float64[::1]"
_TREE = "int64[:, ::1], int64[::1], int64[::1], int64[::1], int32[::1]"
_GATHERED = f"{_TREE}, {_MATRIX}, {_MATRIX}, float64"


@helper
def gather(
    columns: Array, own: int, factor: float, first: int, begin: int, table_rows: IntArray,
    order: IntArray, place: Places, starts: IntArray, indices: Places, data: Array, local: Places,
) -> bool:  # fmt: skip
    """Add entries of a matrix in the columns of a front, on and below the diagonal; False where one has no place."""
    size = columns.shape[1]
    for j in range(own):
        column, dof = columns[j], order[first + j]
        for at in range(starts[dof], starts[dof + 1]):
            row = place[indices[at]]
            if row < first + j:
                continue
            to = local[row]
            if row >= first + own and (to < own or to >= size or table_rows[begin + to - own] != row):
                return False
            column[to] += factor * data[at]
    return True


@helper
def extend(columns: Array, rest: Array, own: int, to: IntArray, left: Array, begin: int, end: int) -> None:
    """Add columns of what a child left over; its rows rise, so lower triangles stay lower triangles."""
    many = len(left)
    for j in range(begin, end):
        given, at = left[j], to[j]
        if at < own:
            taking = columns[at]
            for i in range(j, many):
                taking[to[i]] += given[i]
        else:
            taking = rest[at - own]
            for i in range(j, many):
                taking[to[i] - own] += given[i]


@helper
def gathered(
    front: int, children: bool, table: IntArray, rows: IntArray, below: IntArray, order: IntArray, place: Places,
    starts: IntArray, indices: Places, data: Array,
    mass_starts: IntArray, mass_indices: Places, mass_data: Array, shift: float,
    columns: Array, rest: Array, rests: Array, local: Places, to: IntArray,
) -> bool:  # fmt: skip
    """Columns and rest of a front, before it is eliminated; False where an entry has no place."""
    first, begin = table[front, FIRST], table[front, ROWS]
    own, across = table[front + 1, FIRST] - first, table[front + 1, ROWS] - begin
    columns[:, :] = 0.0
    for j in range(across):
        rest[j, j:] = 0.0
    for i in range(own):
        local[first + i] = i
    for i in range(across):
        local[rows[begin + i]] = own + i
    if not gather(columns, own, 1.0, first, begin, rows, order, place, starts, indices, data, local):
        return False
    if len(mass_data) and not gather(
        columns, own, -shift, first, begin, rows, order, place, mass_starts, mass_indices, mass_data, local
    ):
        return False
    if children:
        for each in range(table[front, CHILDREN], table[front + 1, CHILDREN]):
            child = below[each]
            low = table[child, ROWS]
            many = table[child + 1, ROWS] - low
            for i in range(many):
                to[i] = local[rows[low + i]]
            left = rests[table[child, REST] : table[child, REST] + many * many].reshape(many, many)
            extend(columns, rest, own, to, left, 0, many)
    return True


@helper
def too_small(columns: Array, own: int, limit: float, diagonal: Array) -> bool:
    """Whether a pivot is at most its limit, or no number."""
    sound = True
    for j in range(own):
        sound = sound and columns[j, j] ** 2 > limit * diagonal[j]
    return not sound


@helper
def invert_blocks(columns: Array, own: int) -> None:
    """Inverse triangles in the place of diagonal blocks."""
    for begin in range(0, own, BLOCK):
        end = min(begin + BLOCK, own)
        invert(columns[begin:end, begin:end])


@kernel(
    f"int64(int64, int64, {_GATHERED}, float64[::1], float64, boolean, float64[::1], float64[::1], int32[::1], "
    "int64[::1])"
)
def eliminate(
    front: int, stop: int, table: IntArray, rows: IntArray, below: IntArray, order: IntArray, place: Places,
    starts: IntArray, indices: Places, data: Array,
    mass_starts: IntArray, mass_indices: Places, mass_data: Array, shift: float,
    diagonal: Array, limit: float, keep: bool, panels: Array, rests: Array, local: Places, to: IntArray,
) -> int:  # fmt: skip
    """Eliminate fronts of a piece in turn.

    Parameters
    ----------
    front, stop : int
        The first of them, and the one after the last.
    table, rows, below : int arrays
        Of the layout: fronts, their rows, their children.
    order, place : (n,) int arrays
        The dof of each place, the place of each dof.
    starts, indices, data
        Of a sparse symmetric matrix K, both triangles.
    mass_starts, mass_indices, mass_data, shift
        Of M in K - shift M; nothing where there is no data.
    diagonal : (n,) array
        At each place, what pivots are compared with.
    limit : float
        Smallest pivot per diagonal entry.
    keep : bool
        Keep the columns of all fronts in ``panels``; or have the columns of one after the other there.
    panels, rests : arrays
        Of the piece.
    local : (n,) int array, to : int array
        Working memory; ``to`` as long as the most rows.

    Returns
    -------
    int
        The front after the last one that is done; -1 - front where a matrix has an entry that is not foreseen.
    """
    while front < stop:
        first = table[front, FIRST]
        own, across = table[front + 1, FIRST] - first, table[front + 1, ROWS] - table[front, ROWS]
        at = table[front, PANEL] if keep else 0
        columns = panels[at : at + own * (own + across)].reshape(own, own + across)
        at = table[front, REST]
        rest = rests[at : at + across * across].reshape(across, across)
        if not gathered(
            front, True, table, rows, below, order, place, starts, indices, data, mass_starts, mass_indices, mass_data,
            shift, columns, rest, rests, local, to,
        ):  # fmt: skip
            return -1 - front
        if cholesky(columns[:, :own]) != 0 or too_small(columns, own, limit, diagonal[first:]):
            return front
        if across:
            divide(columns[:, own:], columns[:, :own])
            subtract_square(rest[:, :], columns[:, own:])
        if keep:
            invert_blocks(columns, own)
        front += 1
    return front


@kernel(f"boolean(int64, boolean, {_GATHERED}, float64[:, ::1], float64[:, ::1], float64[::1], int32[::1], int64[::1])")
def gather_front(
    front: int, children: bool, table: IntArray, rows: IntArray, below: IntArray, order: IntArray, place: Places,
    starts: IntArray, indices: Places, data: Array,
    mass_starts: IntArray, mass_indices: Places, mass_data: Array, shift: float,
    columns: Array, rest: Array, rests: Array, local: Places, to: IntArray,
) -> bool:  # fmt: skip
    """One front, not eliminated, with what its children in the same piece left over if asked for."""
    return gathered(
        front, children, table, rows, below, order, place, starts, indices, data, mass_starts, mass_indices, mass_data,
        shift, columns, rest, rests, local, to,
    )  # fmt: skip


@kernel("void(float64[:, ::1], float64[:, ::1], int64, int64[::1], float64[:, ::1], int64, int64)")
def extend_front(columns: Array, rest: Array, own: int, to: IntArray, left: Array, begin: int, end: int) -> None:
    """Add columns ``begin`` to ``end`` of what a child left over, whose rows are at ``to``."""
    extend(columns, rest, own, to, left, begin, end)


@kernel("void(float64[:, ::1], int64, int64, int64, int64)")
def take_from_rows(columns: Array, begin: int, end: int, low: int, high: int) -> None:
    """Take what columns before ``begin`` leave over from columns ``begin`` to ``end``, rows ``low`` to ``high``."""
    subtract_product(columns[begin:end, low:high], columns[:begin, low:high], columns[:begin, begin:end])


@kernel("int64(float64[:, ::1], int64, int64, float64, float64[::1])")
def factorize_block(columns: Array, begin: int, end: int, limit: float, diagonal: Array) -> int:
    """Cholesky factor of a diagonal block, zero above it; not 0 where a pivot is at most its limit."""
    for j in range(begin, end):
        columns[j, begin:j] = 0.0
    square = columns[begin:end, begin:end]
    return 1 if cholesky(square) != 0 or too_small(square, end - begin, limit, diagonal) else 0


@kernel("void(float64[:, ::1], int64, int64, int64, int64)")
def divide_rows(columns: Array, begin: int, end: int, low: int, high: int) -> None:
    """Rows ``low`` to ``high`` of columns ``begin`` to ``end`` by the factor of their diagonal block."""
    divide(columns[begin:end, low:high], columns[begin:end, begin:end])


@kernel("void(float64[:, ::1], int64)")
def invert_front(columns: Array, own: int) -> None:
    """Inverse triangles in the place of diagonal blocks."""
    invert_blocks(columns, own)


@kernel("void(float64[:, ::1], float64[:, ::1], int64, int64, int64)")
def take_from_rest(rest: Array, columns: Array, own: int, begin: int, end: int) -> None:
    """Take what a front leaves over from columns ``begin`` to ``end`` of its rest."""
    subtract_product(rest[begin:end, begin:], columns[:, own + begin :], columns[:, own + begin : own + end])
