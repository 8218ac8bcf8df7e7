"""LU factors of a sparse matrix with a symmetric pattern, front by front, in place.

A front eliminates some unknowns at once: a dense matrix over these and over what they meet later, whose Schur
complement goes on to the front that eliminates the first of those. (I. S. Duff, J. K. Reid, ACM Trans. Math. Softw. 9
(1983) 302-325.) Rows are exchanged within the unknowns of a front alone, so that the pattern stays: leading blocks must
be regular, as those of M + K are, and of [[M + K, Bᵀ], [B, 0]] where conditions come after their unknowns. Which fronts
there are is found once, by `erls.maths.front_plan`.

Of a front with k unknowns that meets r later ones ``entries`` hold its first k rows (k, k + r), then what is below
(r, k).
"""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part
from erls.maths.so3 import Array
from erls.maths.views import matrix_at
from fe_import.model import IntArray

FIRST, OWN, BEGIN, LATER, COUNT, SCHUR, BELOW = range(7)
"""Columns of the table of fronts: its first unknown, how many it eliminates, where its entries begin, where the later
unknowns that it meets are listed, how many these are, where its Schur complement lies; how many fronts, itself
included, end in it.
"""


@part
def local(fronts: IntArray, later: IntArray, f: int, place: int) -> int:
    """Row of an unknown in a front."""
    first, own = fronts[f, FIRST], fronts[f, OWN]
    if place < first + own:
        return int(place - first)
    low, high = fronts[f, LATER], fronts[f, LATER] + fronts[f, COUNT] - 1
    while low < high:
        middle = (low + high) // 2
        if later[middle] < place:
            low = middle + 1
        else:
            high = middle
    return int(own + low - fronts[f, LATER])


@part
def spot(fronts: IntArray, later: IntArray, front_of: IntArray, row: int, column: int) -> tuple[int, int]:
    """Where the entry of two unknowns lies, and how far rows are apart there."""
    f = front_of[min(row, column)]
    i, j = local(fronts, later, f, row), local(fronts, later, f, column)
    own, width = fronts[f, OWN], fronts[f, OWN] + fronts[f, COUNT]
    if i < own:
        return int(fronts[f, BEGIN] + i * width + j), int(width)
    return int(fronts[f, BEGIN] + own * width + (i - own) * own + j), int(own)


@part
def scale(
    entries: Array, fronts: IntArray, later: IntArray, f: int, order: IntArray, left: Array, right: Array
) -> None:
    """Rows and columns of a front times what belongs to their unknowns, which ``order`` tells of each place."""
    first, own, count, listed = fronts[f, FIRST], fronts[f, OWN], fronts[f, COUNT], fronts[f, LATER]
    upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
    lower = matrix_at(entries, fronts[f, BEGIN] + own * (own + count), count, own)
    for p in range(own):
        row, column = left[order[first + p]], right[order[first + p]]
        for j in range(own):
            upper[p, j] *= row * right[order[first + j]]
        for j in range(count):
            upper[p, own + j] *= row * right[order[later[listed + j]]]
            lower[j, p] *= column * left[order[later[listed + j]]]


@part
def _pick_up(entries: Array, fronts: IntArray, into: IntArray, stack: Array, f: int, child: int, schur: Array) -> None:
    """Add the Schur complement of a front to the one where it ends."""
    own, count = fronts[f, OWN], fronts[f, COUNT]
    upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
    lower = matrix_at(entries, fronts[f, BEGIN] + own * (own + count), count, own)
    size, listed = fronts[child, COUNT], fronts[child, LATER]
    given = matrix_at(stack, fronts[child, SCHUR], size, size)
    for a in range(size):
        i = into[listed + a]
        for b in range(size):
            j = into[listed + b]
            if i < own:
                upper[i, j] += given[a, b]
            elif j < own:
                lower[i - own, j] += given[a, b]
            else:
                schur[i - own, j - own] += given[a, b]


@part
def _eliminate(upper: Array, first: int, own: int, pivots: Any) -> int:
    """Factors of the first rows of a front, with row exchanges among them; 0, or 1 + the row at which it broke down."""
    width = upper.shape[1]
    for p in range(own):
        best, largest = p, abs(upper[p, p])
        for i in range(p + 1, own):
            size = abs(upper[i, p])
            if size > largest:
                best, largest = i, size
        pivots[first + p] = best
        if not largest > 0.0:  # NaN too
            return p + 1
        if best != p:
            for j in range(width):
                kept = upper[p, j]
                upper[p, j] = upper[best, j]
                upper[best, j] = kept
        inverse = 1.0 / upper[p, p]
        for i in range(p + 1, own):
            share = upper[i, p] * inverse
            upper[i, p] = share
            if share != 0.0:
                for j in range(p + 1, width):
                    upper[i, j] -= share * upper[p, j]
    return 0


@part
def _sweep(upper: Array, lower: Array, schur: Array) -> None:
    """What is below, and the Schur complement; four rows at a time, which each are read once for them."""
    own, count = lower.shape[1], lower.shape[0]
    for i in range(count):
        for p in range(own):
            share = lower[i, p] / upper[p, p]
            lower[i, p] = share
            for j in range(p + 1, own):
                lower[i, j] -= share * upper[p, j]
        p = 0
        while p + 3 < own:
            a, b, c, d = lower[i, p], lower[i, p + 1], lower[i, p + 2], lower[i, p + 3]
            for j in range(count):
                first = a * upper[p, own + j] + b * upper[p + 1, own + j]
                schur[i, j] -= first + (c * upper[p + 2, own + j] + d * upper[p + 3, own + j])
            p += 4
        while p < own:
            a = lower[i, p]
            for j in range(count):
                schur[i, j] -= a * upper[p, own + j]
            p += 1


@part
def factor(entries: Array, fronts: IntArray, into: IntArray, stack: Array, pivots: Any) -> int:
    """Factor, with row exchanges (n,) as numbers of any kind; 0, or 1 + the unknown at which it broke down.

    ``into`` tells the row of each listed unknown in the front where its own one ends.
    """
    for f in range(len(fronts)):
        first, own, count = fronts[f, FIRST], fronts[f, OWN], fronts[f, COUNT]
        upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
        lower = matrix_at(entries, fronts[f, BEGIN] + own * (own + count), count, own)
        schur = matrix_at(stack, fronts[f, SCHUR], count, count)
        for i in range(count):
            for j in range(count):
                schur[i, j] = 0.0
        child = f - 1
        while child > f - fronts[f, BELOW]:
            _pick_up(entries, fronts, into, stack, f, child, schur)
            child -= fronts[child, BELOW]
        found = _eliminate(upper, first, own, pivots)
        if found != 0:
            return int(first + found)
        _sweep(upper, lower, schur)
    return 0


@part
def solve(entries: Array, fronts: IntArray, later: IntArray, pivots: Any, values: Array) -> None:
    """Solution in place of the right-hand side."""
    for f in range(len(fronts)):
        first, own, count, listed = fronts[f, FIRST], fronts[f, OWN], fronts[f, COUNT], fronts[f, LATER]
        upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
        lower = matrix_at(entries, fronts[f, BEGIN] + own * (own + count), count, own)
        _exchange(values, pivots, first, own)
        for i in range(1, own):
            total = values[first + i]
            for p in range(i):
                total -= upper[i, p] * values[first + p]
            values[first + i] = total
        for i in range(count):
            total = values[later[listed + i]]
            for p in range(own):
                total -= lower[i, p] * values[first + p]
            values[later[listed + i]] = total
    for f in range(len(fronts) - 1, -1, -1):
        first, own, count, listed = fronts[f, FIRST], fronts[f, OWN], fronts[f, COUNT], fronts[f, LATER]
        upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
        for p in range(own - 1, -1, -1):
            total = values[first + p]
            for j in range(p + 1, own):
                total -= upper[p, j] * values[first + j]
            for j in range(count):
                total -= upper[p, own + j] * values[later[listed + j]]
            values[first + p] = total / upper[p, p]


@part
def solve_transposed(entries: Array, fronts: IntArray, later: IntArray, pivots: Any, values: Array) -> None:
    """Solution with the transpose in place of the right-hand side: the steps of `solve` transposed, the last first."""
    for f in range(len(fronts)):
        first, own, count, listed = fronts[f, FIRST], fronts[f, OWN], fronts[f, COUNT], fronts[f, LATER]
        upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
        for p in range(own):
            share = values[first + p] / upper[p, p]
            values[first + p] = share
            for j in range(p + 1, own):
                values[first + j] -= upper[p, j] * share
            for j in range(count):
                values[later[listed + j]] -= upper[p, own + j] * share
    for f in range(len(fronts) - 1, -1, -1):
        first, own, count, listed = fronts[f, FIRST], fronts[f, OWN], fronts[f, COUNT], fronts[f, LATER]
        upper = matrix_at(entries, fronts[f, BEGIN], own, own + count)
        lower = matrix_at(entries, fronts[f, BEGIN] + own * (own + count), count, own)
        for i in range(count):
            share = values[later[listed + i]]
            for p in range(own):
                values[first + p] -= lower[i, p] * share
        for i in range(own - 1, 0, -1):
            share = values[first + i]
            for p in range(i):
                values[first + p] -= upper[i, p] * share
        for p in range(own - 1, -1, -1):
            _swap(values, first + p, first + int(pivots[first + p]))


@part
def _exchange(values: Array, pivots: Any, first: int, own: int) -> None:
    for p in range(own):
        _swap(values, first + p, first + int(pivots[first + p]))


@part
def _swap(values: Array, one: int, other: int) -> None:
    kept = values[one]
    values[one] = values[other]
    values[other] = kept
