"""Loops over states in eightfold numbers (`erls.maths.lanes`), to be compiled with the equations of a formulation.

Each has a module of its own for them, whose source, with all that it imports, tells compiled code on disk apart:
``forces, tangents, masses = lane_kernels(__name__, residual, mass_matrix)``.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import types

from erls.equations.compiled_system import INTEGERS, MATRIX, REALS
from erls.maths.jit import any_scalar, kernel
from erls.maths.lanes import as_duals, as_lanes
from erls.maths.so3 import Array
from fe_import.model import IntArray

residual: Any = None  # those of a formulation take their places
mass_matrix: Any = None
_STACK, _PILE = types.float64[:, :, ::1], types.float64[:, :, :, ::1]
_CONSTANTS = REALS, INTEGERS, MATRIX
_KINDS = {
    "_forces": types.void(*_CONSTANTS, MATRIX, _STACK, _STACK, _STACK, _STACK, INTEGERS),
    "_masses": types.void(*_CONSTANTS, MATRIX, _STACK, _PILE, INTEGERS),
    "_tangents": types.void(*_CONSTANTS, _STACK, MATRIX, REALS, MATRIX, MATRIX, MATRIX, _STACK, _STACK),
}


def _forces(
    reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, a: Array, out: Array, done: IntArray
) -> None:  # fmt: skip
    """Forces out of balance ``out`` (j, n, 8) of 8 j states; ``done`` [0] says how many eights there are already."""
    work, times, forces = as_lanes(scratch), as_lanes(t), as_lanes(out)
    places, rates, accelerations = as_lanes(y), as_lanes(v), as_lanes(a)
    for k in range(done[0], len(times)):
        residual(reals, integers, work, times[k], places[k], rates[k], accelerations[k], forces[k])
        done[0] = k + 1


def _masses(
    reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, out: Array, done: IntArray
) -> None:  # fmt: skip
    """Mass matrices ``out`` (j, n, n, 8) at 8 j places; ``done`` as of forces."""
    work, times, places, matrices = as_lanes(scratch), as_lanes(t), as_lanes(y), as_lanes(out)
    for k in range(done[0], len(times)):
        mass_matrix(reals, integers, work, times[k], places[k], matrices[k])
        done[0] = k + 1


def _tangents(
    reals: Array, integers: IntArray, scratch: Array, own: Array, time: Array, t: Array, y: Array, v: Array, a: Array,
    stiffness: Array, damping: Array,
) -> None:  # fmt: skip
    """∂R/∂y and ∂R/∂v (k, n, n) of forces R out of balance at k states; ``own`` (4, n, 8) and ``time`` (1, 8) start as
    zeros.
    """
    n, ways = y.shape[1], own.shape[2] - 1
    work, now = as_duals(scratch), as_duals(time)
    place, rate, acceleration, forces = as_duals(own[0]), as_duals(own[1]), as_duals(own[2]), as_duals(own[3])
    for k in range(len(t)):
        time[0, 0] = t[k]
        for i in range(n):
            own[0, i, 0], own[1, i, 0], own[2, i, 0] = y[k, i], v[k, i], a[k, i]
        for first in range(0, 2 * n, ways):  # y and v one after the other
            end = min(first + ways, 2 * n)
            for j in range(first, end):
                own[j // n, j % n, 1 + j - first] = 1.0
            residual(reals, integers, work, now[0], place, rate, acceleration, forces)
            for j in range(first, end):
                own[j // n, j % n, 1 + j - first] = 0.0
                found = stiffness[k] if j < n else damping[k]
                for i in range(n):
                    found[i, j % n] = own[3, i, 1 + j - first]


def lane_kernels(module: str, own: Any, own_mass: Any) -> tuple[Callable[..., None], ...]:
    """``forces``, ``tangents`` and ``masses`` of a formulation, for its module of that name; ``own`` is its residual,
    ``own_mass`` its mass matrix.
    """
    kinds = {"residual": any_scalar(own), "mass_matrix": any_scalar(own_mass)}
    names = {**globals(), "__name__": module, **kinds}

    def made(function: Any) -> Callable[..., None]:
        name = function.__name__
        return kernel(_KINDS[name], counted=False)(FunctionType(function.__code__, names, name))

    return made(_forces), made(_tangents), made(_masses)
