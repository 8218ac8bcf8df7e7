"""Forces and mass matrices of a compiled system at many states, in one call: most calls cost more than what they do."""

from __future__ import annotations

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
    _LEAVING = _t.void(_t.int64, REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, INTEGERS, REALS, MATRIX)
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
    places: IntArray,
    spare: Array,
    out: Array,
) -> None:
    """Rows of ``out``: what residuals at accelerations of zero, which go into ``spare`` (n,), leave in some places."""
    for k in range(len(t)):
        call_residual(function, reals, integers, scratch, t[k], y[k], v[k], y[k, :0], spare)
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
    places: IntArray,
) -> Array:  # fmt: skip
    """(k, p) what a residual at states (k, n) and accelerations of zero leaves in p places of its working memory.

    ``residual`` is a function, or its address.
    """
    out = np.empty((len(t), len(places)))
    t, y, v = (np.ascontiguousarray(x, dtype=float) for x in (t, y, v))
    address = handed(residual, RESIDUAL)
    leavings(address, reals, integers, scratch, t, y, v, places, np.empty(y.shape[1]), out)
    return out


def mass_series(system: CompiledSystem, t: Array, y: Array) -> Array:
    """(k, n, n) mass matrices at places (k, n) and times (k,) [s]."""
    out = np.empty((len(t), system.size, system.size))
    address = handed(system.mass_matrix, MASS_MATRIX)
    t, y = (np.ascontiguousarray(x, dtype=float) for x in (t, y))
    masses(address, system.reals, system.integers, system.scratch, t, y, out)
    return out
