"""Compiled products of sparse symmetric matrices with fields."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fe_import.compiled.jit import kernel
from fe_import.model import Array, IntArray


@kernel("void(int64, int64, int64[::1], int32[::1], float64[::1], float64[:, ::1], float64[:, ::1])")
def rows_times(
    first: int, stop: int, starts: IntArray, indices: NDArray[np.int32], data: Array, fields: Array,
    result: Array,
) -> None:  # fmt: skip
    """Rows ``first`` to ``stop`` of A x; four sums at a time stay in registers."""
    width = np.uint64(fields.shape[1])
    flat = fields.reshape(-1)
    four, one, two, three = np.uint64(4), np.uint64(1), np.uint64(2), np.uint64(3)
    for i in range(first, stop):
        j = np.uint64(0)
        while j + four <= width:
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for at in range(starts[i], starts[i + 1]):
                factor, place = data[at], np.uint64(indices[at]) * width + j
                a += factor * flat[place]
                b += factor * flat[place + one]
                c += factor * flat[place + two]
                d += factor * flat[place + three]
            result[i, j], result[i, j + one], result[i, j + two], result[i, j + three] = a, b, c, d
            j += four
        while j < width:
            a = 0.0
            for at in range(starts[i], starts[i + 1]):
                a += data[at] * flat[np.uint64(indices[at]) * width + j]
            result[i, j] = a
            j += one
