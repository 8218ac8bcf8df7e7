"""A chain whose fast modes follow statically: what its functions do, with second-order displacements or without.

The formulas, and when iterations end, are those of `erls.equations.quasi_static.formulation`. ``bends`` is None where
links have no second-order displacements, which leaves them out of the compiled code.
"""

from __future__ import annotations

import math
from typing import Any

from erls.equations.erls.anchored_segments import fill_anchored
from erls.equations.erls.balance import balance
from erls.equations.erls.segments import fill
from erls.equations.quasi_static.records import REDUCED, Reduced, ReducedState, read_reduced, read_reduced_state
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import part
from erls.maths.products import add_columns, add_rows, clear, copy_matrix, dot
from erls.maths.so3 import Array
from fe_import.model import IntArray

MOST = 6  # evaluations with everything
NEAR = 0.05  # of the first correction: what the last one may be
CORRECTIONS = 3  # of an acceleration


@part
def _forces(
    reals: Array, integers: IntArray, scratch: Array, at: int, t: float, y: Array, v: Array, a: Array, out: Array,
    bends: Any,
) -> None:  # fmt: skip
    """Forces out of balance of the chain whose `Serial` stands at that place."""
    balance(reals, integers, scratch, t, y, v, a, out, bends, at)


@part
def set_motion(given: Reduced, state: ReducedState, y: Array, v: Array, a: Array) -> None:
    """Motion of all modes by the slow coordinates; zero acceleration where ``a`` is empty."""
    for values, out in ((y, state.place), (v, state.rate), (a, state.acceleration)):
        clear(out)
        add_columns(given.slow, values, 1.0, out)


@part
def _weigh(reals: Array, integers: IntArray, scratch: Array, at: int, t: float, bends: Any) -> float:
    """Correction of η towards balance in the motion that is set; its size, as the root of twice its strain energy."""
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    state = read_reduced_state(scratch, integers, given.state)
    _forces(reals, integers, scratch, at, t, state.place, state.rate, state.acceleration, state.force, bends)
    size = 0.0
    for j in range(len(given.kappa)):
        state.change[j] = -dot(given.static[j], state.force) / given.kappa[j]
        size += given.kappa[j] * state.change[j] ** 2
    return math.sqrt(size)


@part
def _steps_around(lapse: float, ends: Array, t: float) -> tuple[float, float]:
    """Steps back and forth from a time, which do not reach over one at which forces jump."""
    back = forth = lapse
    for end in ends:
        if end <= t:
            back = min(lapse, (t - end) / 2)
        if end >= t:
            forth = min(lapse, (end - t) / 2)
            break
    if back + forth < lapse / 2:
        return -lapse, lapse
    return -back, forth


@part
def _estimate(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, bends: Any
) -> float:
    """η and its rate from the light chain; the size of the first correction."""
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    state = read_reduced_state(scratch, integers, given.state)
    set_motion(given, state, y, v, a)
    first = _weigh(reals, integers, scratch, given.light, t, bends)
    for j in range(len(state.eta)):
        state.eta[j] = state.change[j]
    back, forth = _steps_around(given.lapse, given.ends, t)
    for side in range(2):
        step = back if side == 0 else forth
        for j in range(len(y)):
            push = a[j] if len(a) > 0 else 0.0
            state.near_place[j] = y[j] + step * v[j] + step * step / 2 * push
            state.near_rate[j] = v[j] + step * push
            state.near_acceleration[j] = push - step * given.squares[j] * v[j]
        set_motion(given, state, state.near_place, state.near_rate, state.near_acceleration)
        add_columns(given.static, state.eta, 1.0, state.place)
        _weigh(reals, integers, scratch, given.light, t + step, bends)
        for j in range(len(state.eta)):
            if side == 0:
                state.found[j] = state.eta[j] + state.change[j]
            else:
                state.found_rate[j] = (state.eta[j] + state.change[j] - state.found[j]) / (forth - back)
                state.found[j] -= back * state.found_rate[j]
    return first


@part
def put_residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array, bends: Any
) -> None:
    """Wᵀ (M a - f) where the static modes are in balance; an empty ``a`` stands for zeros."""
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    state = read_reduced_state(scratch, integers, given.state)
    first = 0.0
    if len(given.kappa) > 0:
        first = _estimate(reals, integers, scratch, t, y, v, a, bends)
    set_motion(given, state, y, v, a)
    add_columns(given.static, state.found, 1.0, state.place)
    add_columns(given.static, state.found_rate, 1.0, state.rate)
    for _ in range(MOST):
        if _weigh(reals, integers, scratch, integers[0], t, bends) <= NEAR * first:
            break
        add_columns(given.static, state.change, 1.0, state.place)
    clear(out)
    add_rows(given.slow, state.force, 1.0, out)


@part
def _set_masses(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, bends: Any) -> None:
    """``masses`` = Wᵀ M W."""
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    state = read_reduced_state(scratch, integers, given.state)
    clear(state.place)
    add_columns(given.slow, y, 1.0, state.place)
    if bends is None:
        fill(reals, integers, scratch, t, state.place, state.matrix)
    else:
        fill_anchored(reals, integers, scratch, t, state.place, state.matrix)
    for j in range(len(y)):
        clear(state.half[j])
        add_rows(state.matrix, given.slow[j], 1.0, state.half[j])
    for i in range(len(y)):
        for j in range(i + 1):
            state.masses[i, j] = state.masses[j, i] = dot(given.slow[i], state.half[j])


@part
def put_masses(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array, bends: Any
) -> None:
    """Wᵀ M W."""
    _set_masses(reals, integers, scratch, t, y, bends)
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    copy_matrix(read_reduced_state(scratch, integers, given.state).masses, out)


@part
def put_acceleration(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array, bends: Any
) -> int:
    """Where the residual is zero; the status of `erls.equations.compiled_system`."""
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    state = read_reduced_state(scratch, integers, given.state)
    _set_masses(reals, integers, scratch, t, y, bends)
    copy_matrix(state.masses, state.factor)
    status = cholesky(state.factor, 0.0)
    if status != 0:
        return int(status)
    clear(out)
    for _ in range(CORRECTIONS):
        put_residual(reals, integers, scratch, t, y, v, out, state.left, bends)
        forward(state.factor, state.left)
        backward(state.factor, state.left)
        for j in range(len(out)):
            out[j] -= state.left[j]
    return 0
