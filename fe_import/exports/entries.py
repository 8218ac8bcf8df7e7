"""Entries (row, column, value) of a file -> a sparse matrix with both triangles, duplicates refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray

MOST_ROWS = 50_000_000  # 64-bit keys of pairs of rows stay exact, and no link is larger


def matrix_of_entries(
    rows: IntArray, columns: IntArray, values: Array, size: int, place: Callable[[int], str], *, triangle: bool
) -> sp.csc_array:
    """A square matrix from its entries in any order.

    Parameters
    ----------
    rows, columns : (n,) int arrays
        From 0.
    values : (n,) array
    size : int
        Rows of the matrix.
    place : callable
        ``place(k)`` names file and line of entry k, for messages.
    triangle : bool
        The file holds one triangle of a symmetric matrix, each pair (i, j) once, on whichever side; otherwise all
        entries.

    Returns
    -------
    (size, size) sparse CSC
        Both triangles; entries that are zero are left out.

    Raises
    ------
    FEImportError
        ``EXPORT``: an index out of range, or an entry given twice.
    """
    if size > MOST_ROWS:
        raise FEImportError(
            Cause.EXPORT, "the matrix is too large", where=place(0), value=size, limit=MOST_ROWS, remedy="reduce it"
        )
    outside = (np.minimum(rows, columns) < 0) | (np.maximum(rows, columns) >= size)
    if outside.any():
        first = int(outside.argmax())
        raise FEImportError(
            Cause.EXPORT,
            "this entry lies outside of the matrix (rows and columns count from 1)",
            where=place(first),
            value=f"row {rows[first] + 1}, column {columns[first] + 1}",
            limit=f"1 ... {size}",
            remedy="check that matrix and dofs come from one export",
        )
    _refuse_duplicates(rows, columns, size, place, triangle)
    kept = values != 0
    rows, columns, values = rows[kept], columns[kept], values[kept]
    if triangle:
        off = rows != columns
        rows, columns = np.concatenate([rows, columns[off]]), np.concatenate([columns, rows[off]])
        values = np.concatenate([values, values[off]])
    return sp.csc_array((values, (rows, columns)), shape=(size, size))


def _refuse_duplicates(
    rows: IntArray, columns: IntArray, size: int, place: Callable[[int], str], triangle: bool
) -> None:
    first, second = (np.minimum(rows, columns), np.maximum(rows, columns)) if triangle else (rows, columns)
    key = second * size + first
    if (np.diff(key) > 0).all():  # as most programs write them
        return
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    if len(same):
        one, other = (int(order[same[0] + k]) for k in (0, 1))
        both = "one triangle of a symmetric matrix needs each pair once" if triangle else "an entry stands once"
        raise FEImportError(
            Cause.EXPORT,
            f"this entry stands at {place(one)} already",
            where=place(other),
            value=f"row {rows[other] + 1}, column {columns[other] + 1}",
            remedy=f"export again; {both}",
        )
