"""A tree with closed loops at many states in one call: conditions, and forces with given ones in place of loops."""

from __future__ import annotations

from erls.equations.compiled_system import INTEGERS, MATRIX, REALS
from erls.equations.loops.records import call_closure, call_forces, read_loop_room, read_loops
from erls.maths.jit import ENABLED, kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray

if ENABLED:
    from numba import types as _t

    _HELD = _t.void(REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX)
    _GRADIENTS = _t.void(REALS, INTEGERS, REALS, REALS, MATRIX, _t.float64[:, :, ::1])
    _MOTIONS = _t.void(REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, _t.float64[:, :, ::1])
else:
    _HELD = _GRADIENTS = _MOTIONS = None


@kernel(_HELD, counted=False)
def held(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: Array,
    y: Array,
    v: Array,
    a: Array,
    multipliers: Array,
    out: Array,
) -> None:
    """Rows (n,) of ``out``: M a - f + Φ_yᵀ λ, with multipliers λ (r,) of the conditions in use."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    for k in range(len(t)):
        call_forces(loops.forces, reals, integers, scratch, t[k], y[k], v[k], a[k], out[k])
        for row in range(loops.kept):
            for i in range(out.shape[1]):
                out[k, i] += room.gradient[row, i] * multipliers[k, row]


@kernel(_GRADIENTS, counted=False)
def gradients(reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, out: Array) -> None:
    """Φ_y (r, n) of the conditions in use."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    for k in range(len(t)):
        call_closure(loops.closure, reals, integers, scratch, t[k], y[k], y[k])  # the rates do not matter
        for row in range(loops.kept):
            for i in range(out.shape[2]):
                out[k, row, i] = room.gradient[row, i]


@kernel(_MOTIONS, counted=False)
def motions(reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array) -> None:
    """Rows (r, 3 + n) of ``out``: Φ, Φ̇, Φ̈ at zero accelerations, and Φ_y of the conditions in use."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    for k in range(len(t)):
        call_closure(loops.closure, reals, integers, scratch, t[k], y[k], v[k])
        for condition in range(loops.conditions):
            row = loops.used[condition]
            if row >= 0:
                found = out[k, row]
                found[0], found[1] = room.violation[condition], room.rate[condition]
                found[2] = room.bias[condition]
                for i in range(y.shape[1]):
                    found[3 + i] = room.gradient[row, i]
