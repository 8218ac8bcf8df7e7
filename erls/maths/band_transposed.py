"""Solutions with the transpose of a band matrix that `erls.maths.band` factored."""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part
from erls.maths.so3 import Array


@part
def solve_transposed(band: Array, pivots: Any, values: Array) -> None:
    """Solution in place of the right-hand side: the steps of `erls.maths.band.solve` transposed, the last one first."""
    n, width = len(band), (band.shape[1] - 1) // 3
    for k in range(n):
        total = values[k]
        for j in range(max(0, k - 2 * width), k):
            total -= band[j, k - j + width] * values[j]
        values[k] = total / band[k, width]
    for k in range(n - 1, -1, -1):
        total = values[k]
        for i in range(k + 1, min(k + width, n - 1) + 1):
            total -= band[i, k - i + width] * values[i]
        best = int(pivots[k])
        values[k] = values[best]
        values[best] = total
