"""Products with tall fields, strips of rows side by side.

Strips are the same whatever the number of threads, and so are the results, to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array
from fe_import.solver.threads import side_by_side

_STRIP = 2**14  # rows
_LARGE = 1_000_000  # entries of a matrix that are worth threads


def times(symmetric: Any, fields: Array) -> Array:
    """A x for a sparse symmetric matrix (n, n), both triangles, or whatever can be multiplied; fields (n, k)."""
    if not isinstance(symmetric, sp.csc_array) or symmetric.nnz < _LARGE or symmetric.indices.dtype != np.int32:
        return np.asarray(symmetric @ fields)
    from fe_import.solver.row_products import rows_times

    given, result = np.ascontiguousarray(fields, dtype=float), np.empty(fields.shape)
    starts, indices, data = symmetric.indptr.astype(np.int64, copy=False), symmetric.indices, symmetric.data

    def fill(ends: tuple[int, int]) -> None:
        rows_times(*ends, starts, indices, data, given, result)  # columns, which are those of rows

    side_by_side(fill, strips(len(fields)))
    return result


def along(blocks: Sequence[Array], fields: Array) -> Array:
    """(b, k) products of the vectors of blocks (n, p) with fields (n, k)."""
    return np.concatenate(side_by_side(lambda block: block.T @ fields, blocks))


def take_out(fields: Array, blocks: Sequence[Array], parts: Array) -> None:
    """fields - blocks parts, in place: (n, k), (n, p) of each block, (b, k)."""

    def take(ends: tuple[int, int]) -> None:
        row, strip = 0, slice(*ends)
        for block in blocks:
            fields[strip] -= block[strip] @ parts[row : row + block.shape[1]]
            row += block.shape[1]

    side_by_side(take, strips(len(fields)))


def combined(fields: Array, change: Array) -> Array:
    """(n, m) combinations of fields (n, k) by a change (k, m)."""
    result = np.empty((len(fields), change.shape[1]))
    side_by_side(
        lambda ends: np.matmul(fields[slice(*ends)], change, out=result[slice(*ends)]), strips(len(fields))
    )
    return result


def strips(count: int) -> list[tuple[int, int]]:
    """Ranges of rows."""
    return [(low, min(low + _STRIP, count)) for low in range(0, count, _STRIP)]
