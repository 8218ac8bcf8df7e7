"""The nearest state that closes the loops, and how far a run comes from closing them and from a dead point."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops import layout as at
from erls.equations.loops.closure import CLOSURE
from erls.maths.dense import backward, cholesky, dot, forward
from erls.maths.jit import ENABLED, kernel, part

_CLOSED = 1e-14  # of the size of the mechanism
_POLISH = 4

CLOSE: Any = None
WATCH: Any = None
if ENABLED:
    from numba import types as _t

    _constants = (contract.pointer(CLOSURE), contract.REALS, contract.INTEGERS, contract.REALS)
    CLOSE = _t.int64(*_constants, _t.float64, contract.REALS, contract.REALS)
    WATCH = _t.void(*_constants, contract.REALS, contract.MATRIX, contract.REALS, _t.float64[:, :, ::1])


@part
def _move(reals: Array, integers: IntArray, scratch: Array, place: int, out: Array) -> int:
    """Take from ``out`` the smallest change in metres that makes up for what starts at ``place`` (m,)."""
    n = len(out)
    r = at.place(integers, at.KEPT)
    gradient = scratch[at.span(integers, at.GRADIENT, r * n)].reshape(r, n)
    scaled = scratch[at.span(integers, at.SPREAD, r * n)].reshape(r, n)
    flexible = scratch[at.span(integers, at.FLEXIBLE, r * r)].reshape(r, r)
    wrong = scratch[at.span(integers, at.REDUCED, r)]
    metres = reals[at.place(integers, at.METRES) : at.place(integers, at.METRES) + n]
    for condition in range(at.place(integers, at.CONDITIONS)):
        k = at.place_of(integers, condition)
        if k >= 0:
            scale = at.row_scale(reals, integers, condition)
            wrong[k] = scale * scratch[place + condition]
            for j in range(n):
                scaled[k, j] = scale * gradient[k, j] / metres[j]
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


@kernel(CLOSE, counted=False)
def close(
    closure: Callable[..., None], reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array
) -> int:
    """Move a state to the nearest one, in metres, that closes the loops; 1 where there is none nearby."""
    m = at.place(integers, at.CONDITIONS)
    limit = _CLOSED * reals[at.place(integers, at.NUMBERS) + at.REACH]
    place = at.place(integers, at.VIOLATION)
    for _ in range(_POLISH):
        closure(reals, integers, scratch, t, y, v)
        worst = 0.0
        for condition in range(m):
            if at.place_of(integers, condition) >= 0:
                gap = abs(scratch[place + condition]) * at.row_scale(reals, integers, condition)
                worst = max(worst, gap)
        if worst <= limit:
            break
        if _move(reals, integers, scratch, place, y):
            return 1
    else:
        closure(reals, integers, scratch, t, y, v)
    return _move(reals, integers, scratch, place + m, v)


@kernel(WATCH, counted=False)
def watch(
    closure: Callable[..., None],
    reals: Array,
    integers: IntArray,
    scratch: Array,
    times: Array,
    places: Array,
    gaps: Array,
    squares: Array,
) -> None:
    """At each of ``places`` (k, n) the largest opening [m], and the products (k, r, r) of the rows in metres."""
    n = places.shape[1]
    r, m = at.place(integers, at.KEPT), at.place(integers, at.CONDITIONS)
    gradient = scratch[at.span(integers, at.GRADIENT, r * n)].reshape(r, n)
    metres = reals[at.place(integers, at.METRES) : at.place(integers, at.METRES) + n]
    violation = at.place(integers, at.VIOLATION)
    for k in range(len(times)):
        closure(reals, integers, scratch, times[k], places[k], places[k])
        gaps[k] = 0.0
        for condition in range(m):
            scale, used = at.row_scale(reals, integers, condition), at.place_of(integers, condition)
            gaps[k] = max(gaps[k], scale * abs(scratch[violation + condition]))
            if used >= 0:
                for j in range(n):
                    gradient[used, j] *= scale / metres[j]
        for i in range(r):
            for j in range(r):
                squares[k, i, j] = dot(gradient[i], gradient[j])
