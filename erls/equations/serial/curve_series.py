"""Curves over time at many times in one call."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.compiled_system import INTEGERS, MATRIX, REALS
from erls.equations.serial.time_curves import curve
from erls.maths.jit import ENABLED, kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray

_KIND: Any = None
if ENABLED:
    from numba import types

    _KIND = types.void(REALS, INTEGERS, types.int64, REALS, MATRIX)


@kernel(_KIND, counted=False)
def _series(reals: Array, integers: IntArray, at: int, t: Array, out: Array) -> None:
    for k in range(len(t)):
        out[k, 0], out[k, 1], out[k, 2] = curve(reals, integers, at, t[k])


def curves_at(reals: Array, integers: IntArray, at: int, t: Array) -> Array:
    """(k, 3) value, first and second derivative of the curve at that place, at k times."""
    found = np.empty((len(t), 3))
    _series(reals, integers, at, np.ascontiguousarray(t, dtype=float), found)
    return found
