"""Forces and mass matrices of a compiled system at many states, in one call: most calls cost more than what they do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from erls.equations.compiled_system import (
    MASS_MATRIX,
    RESIDUAL,
    CompiledSystem,
    call_mass_matrix,
    call_residual,
)
from erls.maths.calls import handed
from erls.maths.jit import ENABLED, kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray

if ENABLED:
    from numba import types as _t

    from erls.equations.compiled_system import INTEGERS, MATRIX, REALS

    _RESIDUALS = _t.void(_t.int64, REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, MATRIX, MATRIX)
    _LEAVING = _t.void(_t.int64, REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, MATRIX, INTEGERS, REALS, MATRIX)
    _MASSES = _t.void(_t.int64, REALS, INTEGERS, REALS, REALS, MATRIX, _t.float64[:, :, ::1])
else:
    _RESIDUALS = _MASSES = _LEAVING = None


@kernel(_RESIDUALS, counted=False)
def residuals(
    function: Any,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: Array,
    y: Array,
    v: Array,
    a: Array,
    out: Array,
) -> None:
    """Rows of ``out``, by the function at an address."""
    for k in range(len(t)):
        call_residual(function, reals, integers, scratch, t[k], y[k], v[k], a[k], out[k])


@kernel(_LEAVING, counted=False)
def leavings(
    function: Any,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: Array,
    y: Array,
    v: Array,
    a: Array,
    places: IntArray,
    spare: Array,
    out: Array,
) -> None:
    """Rows of ``out``: what residuals, which go into ``spare`` (n,), leave in some places."""
    for k in range(len(t)):
        call_residual(function, reals, integers, scratch, t[k], y[k], v[k], a[k], spare)
        for i in range(len(places)):
            out[k, i] = scratch[places[i]]


@kernel(_MASSES, counted=False)
def masses(
    function: Any, reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, out: Array
) -> None:
    """Matrices of ``out``, by the function at an address."""
    for k in range(len(t)):
        call_mass_matrix(function, reals, integers, scratch, t[k], y[k], out[k])


def residual_series(system: CompiledSystem, t: Array, y: Array, v: Array, a: Array, function: Any = None) -> Array:
    """(k, n) forces out of balance at states.

    Parameters
    ----------
    system : CompiledSystem
    t : (k,) array
        [s]
    y, v, a : (k, n) arrays
        Coordinates, rates, accelerations; (k, 0) in place of the last for accelerations of zero.
    function : callable, optional
        Another one of the same signature in place of the residual of the system.
    """
    out = np.empty((len(t), system.size))
    address = handed(function or system.residual, RESIDUAL)
    t, y, v, a = (np.ascontiguousarray(x, dtype=float) for x in (t, y, v, a))
    residuals(address, system.reals, system.integers, system.scratch, t, y, v, a, out)
    return out


def residuals_leaving(
    residual: Any, reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array,
    places: IntArray, a: Array | None = None,
) -> Array:  # fmt: skip
    """(k, p) what a residual at states (k, n) leaves in p places of its working memory.

    ``residual`` is a function, or its address; accelerations (k, n) are zero unless given.
    """
    out = np.empty((len(t), len(places)))
    a = y[:, :0] if a is None else a
    t, y, v, a = (np.ascontiguousarray(x, dtype=float) for x in (t, y, v, a))
    address = handed(residual, RESIDUAL)
    leavings(address, reals, integers, scratch, t, y, v, a, places, np.empty(y.shape[1]), out)
    return out


def places_within(memory: Array, views: Sequence[Array]) -> IntArray | None:
    """(p,) places in flat memory of all numbers of some views, one after the other; None where one lies elsewhere."""
    numbers = np.arange(memory.size)
    found = []
    for view in views:
        first = (view.__array_interface__["data"][0] - memory.__array_interface__["data"][0]) // memory.itemsize
        last = first + sum((n - 1) * step for n, step in zip(view.shape, view.strides, strict=True)) // memory.itemsize
        if view.dtype != memory.dtype or not 0 <= first <= last < memory.size:
            return None
        steps = [step // memory.itemsize * numbers.itemsize for step in view.strides]
        found.append(np.lib.stride_tricks.as_strided(numbers[first:], view.shape, steps).ravel())
    return np.concatenate(found) if found else numbers[:0]


def mass_series(system: CompiledSystem, t: Array, y: Array) -> Array:
    """(k, n, n) mass matrices at places (k, n) and times (k,) [s]."""
    out = np.empty((len(t), system.size, system.size))
    address = handed(system.mass_matrix, MASS_MATRIX)
    t, y = (np.ascontiguousarray(x, dtype=float) for x in (t, y))
    masses(address, system.reals, system.integers, system.scratch, t, y, out)
    return out
