"""LU factors of a band matrix with row exchanges, in place.

Row i of the table holds the entries of columns i − w to i + 2 w; w on either side belong to the matrix, the last
w make room for what row exchanges fill. (G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., sec. 4.3.)
"""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part
from erls.maths.so3 import Array


@part
def factor(band: Array, pivots: Any) -> int:
    """Factor, with row exchanges (n,) as numbers of any kind; 0, or 1 + the unknown at which it broke down."""
    n, width = len(band), (band.shape[1] - 1) // 3
    for k in range(n):
        last = min(k + width, n - 1)
        best, largest = k, abs(band[k, width])
        for i in range(k + 1, last + 1):
            size = abs(band[i, k - i + width])
            if size > largest:
                best, largest = i, size
        pivots[k] = best
        if not largest > 0.0:  # NaN too
            return k + 1
        end = min(k + 2 * width, n - 1)
        if best != k:
            for j in range(k, end + 1):
                kept = band[k, j - k + width]
                band[k, j - k + width] = band[best, j - best + width]
                band[best, j - best + width] = kept
        inverse = 1.0 / band[k, width]
        for i in range(k + 1, last + 1):
            share = band[i, k - i + width]
            if share != 0.0:
                share *= inverse
                band[i, k - i + width] = share
                for j in range(k + 1, end + 1):
                    band[i, j - i + width] -= share * band[k, j - k + width]
    return 0


@part
def solve(band: Array, pivots: Any, values: Array) -> None:
    """Solution in place of the right-hand side."""
    n, width = len(band), (band.shape[1] - 1) // 3
    for k in range(n):
        best = int(pivots[k])
        here = values[best]
        values[best] = values[k]
        values[k] = here
        if here != 0.0:
            for i in range(k + 1, min(k + width, n - 1) + 1):
                values[i] -= band[i, k - i + width] * here
    for k in range(n - 1, -1, -1):
        total = values[k]
        for j in range(k + 1, min(k + 2 * width, n - 1) + 1):
            total -= band[k, j - k + width] * values[j]
        values[k] = total / band[k, width]
