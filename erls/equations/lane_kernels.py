"""A loop over states in eightfold numbers (`erls.maths.lanes`), to be compiled with the equations of a formulation.

Each has a module of its own for it, whose source, with all that it imports, tells compiled code on disk apart:
``forces = lane_kernel(__name__, residual)``.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import types

from erls.equations.compiled_system import INTEGERS, MATRIX, REALS
from erls.maths.jit import any_scalar, kernel
from erls.maths.lanes import as_lanes
from erls.maths.so3 import Array
from fe_import.model import IntArray

residual: Any = None  # that of a formulation takes its place
_STACK = types.float64[:, :, ::1]
_KIND = types.void(REALS, INTEGERS, MATRIX, MATRIX, _STACK, _STACK, _STACK, _STACK, INTEGERS)


def _forces(
    reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, a: Array, out: Array, done: IntArray
) -> None:  # fmt: skip
    """Forces out of balance ``out`` (j, n, 8) of 8 j states; ``done`` [0] says how many eights there are already."""
    work, times, forces = as_lanes(scratch), as_lanes(t), as_lanes(out)
    places, rates, accelerations = as_lanes(y), as_lanes(v), as_lanes(a)
    for k in range(done[0], len(times)):
        residual(reals, integers, work, times[k], places[k], rates[k], accelerations[k], forces[k])
        done[0] = k + 1


def lane_kernel(module: str, own: Any) -> Callable[..., None]:
    """``forces`` of a formulation, for its module of that name; ``own`` is its residual."""
    names = {**globals(), "__name__": module, "residual": any_scalar(own)}
    return kernel(_KIND, counted=False)(FunctionType(_forces.__code__, names, "_forces"))
