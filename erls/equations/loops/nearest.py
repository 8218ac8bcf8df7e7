"""The nearest state that closes the loops, and how far a run comes from closing them and from a dead point."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops.records import LoopRoom, Loops, call_closure, read_loop_room, read_loops
from erls.maths.dense import backward, cholesky, dot, forward
from erls.maths.jit import ENABLED, kernel, part

_CLOSED = 1e-14  # of the size of the mechanism
_POLISH = 4

CLOSE: Any = None
WATCH: Any = None
if ENABLED:
    from numba import types as _t

    _constants = (contract.REALS, contract.INTEGERS, contract.REALS)
    CLOSE = _t.int64(*_constants, _t.float64, contract.REALS, contract.REALS)
    WATCH = _t.void(*_constants, contract.REALS, contract.MATRIX, contract.REALS, _t.float64[:, :, ::1])


@part
def _move(loops: Loops, room: LoopRoom, given: Array, out: Array) -> int:
    """Take from ``out`` the smallest change in metres that makes up for what is ``given`` (m,)."""
    scaled, flexible, wrong, metres = room.spread, room.flexible, room.wrong, loops.metres
    r, n = scaled.shape
    for condition in range(loops.conditions):
        k = loops.used[condition]
        if k >= 0:
            scale = loops.scales[condition]
            wrong[k] = scale * given[condition]
            for j in range(n):
                scaled[k, j] = scale * room.gradient[k, j] / metres[j]
    for i in range(r):
        for j in range(i + 1):
            flexible[j, i] = dot(scaled[i], scaled[j])
    if cholesky(flexible, 0.0) != 0:
        return 1
    forward(flexible, wrong)
    backward(flexible, wrong)
    for k in range(r):
        for j in range(n):
            out[j] -= scaled[k, j] * wrong[k] / metres[j]
    return 0


@part
def largest_gap(scales: Array, used: IntArray, violation: Array, every: bool) -> Any:
    """Largest opening [m], of ``every`` condition or of those in use."""
    worst = 0.0
    for condition in range(len(scales)):
        if every or used[condition] >= 0:
            worst = max(worst, abs(violation[condition]) * scales[condition].real)
    return worst


@kernel(CLOSE, counted=False)
def close(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array) -> int:
    """Move a state to the nearest one, in metres, that closes the loops; 1 where there is none nearby."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    for _ in range(_POLISH):
        call_closure(loops.closure, reals, integers, scratch, t, y, v)
        if largest_gap(loops.scales, loops.used, room.violation, False) <= _CLOSED * loops.reach.real:
            break
        if _move(loops, room, room.violation, y):
            return 1
    else:
        call_closure(loops.closure, reals, integers, scratch, t, y, v)
    return int(_move(loops, room, room.rate, v))


@kernel(WATCH, counted=False)
def watch(
    reals: Array, integers: IntArray, scratch: Array, times: Array, places: Array, gaps: Array, squares: Array
) -> None:
    """At each of ``places`` (k, n) the largest opening [m], and the products (k, r, r) of the rows in metres."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    gradient, n = room.gradient, places.shape[1]
    for k in range(len(times)):
        call_closure(loops.closure, reals, integers, scratch, times[k], places[k], places[k])
        gaps[k] = largest_gap(loops.scales, loops.used, room.violation, True)
        for condition in range(loops.conditions):
            used = loops.used[condition]
            if used >= 0:
                for j in range(n):
                    gradient[used, j] *= loops.scales[condition] / loops.metres[j]
        for i in range(loops.kept):
            for j in range(loops.kept):
                squares[k, i, j] = dot(gradient[i], gradient[j])
