"""Constraints that say nothing new, found by rank."""

from __future__ import annotations

import numpy as np

from erls.lie.so3 import Array

_DEPENDENT = 1e-9  # of a row's size; rounding over a chain is far below, a closing joint out of line far above


def redundant_rows(matrix: Array) -> list[int]:
    """Rows of a constraint matrix (m, n) that follow from those before them.

    Of two equal conditions the later joint's is found: the one that closes a loop.
    """
    kept = np.zeros((0, matrix.shape[1]))
    result: list[int] = []
    for k, row in enumerate(matrix):
        rest = row.copy()
        for _ in range(2):  # once more against rounding
            rest -= kept.T @ (kept @ rest)
        size = float(np.linalg.norm(rest))
        if size <= _DEPENDENT * float(np.linalg.norm(row)):
            result.append(k)
        else:
            kept = np.vstack([kept, rest / size])
    return result
