"""Couplings of joint coordinates (`erls.mechanism.couplings`) as frames that lie e apart along z, and the circuits of
motors (`erls.mechanism.circuits`): place and rate along z are those of the joint, the row is that of the charge, on
which a voltage acts; the turn's rate is the current, and its row that of the joint.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops.records import (
    CLOSING_JOINT,
    COORDINATE,
    LOOP_STATE,
    RATE,
    TURNING,
    ClosingJoint,
    Loops,
    LoopState,
    read_closing_joint,
    read_loop_state,
)
from erls.equations.serial.time_curves import curve, passed, read_part
from erls.maths.jit import part
from erls.maths.products import clear

_ALONG, _ABOUT = 2, 5  # an elastic coupling acts along either, a condition along the former


@part
def link_circuit(joint: ClosingJoint, y: Array, v: Array, state: LoopState) -> None:
    """Place and rate of a motor's joint, its current, and both rows."""
    at, charge = joint.columns[0], joint.columns[1]
    state.moves[:, :] = 0.0
    state.moves[_ALONG, charge] = state.moves[_ABOUT, at] = 1.0
    clear(state.pose)
    clear(state.twist)
    clear(state.twist_rate)
    state.pose[0] = state.pose[4] = state.pose[8] = 1.0
    state.pose[9], state.pose[11] = y[charge], y[at]
    state.twist[_ALONG], state.twist[_ABOUT] = v[at], v[charge]


@part
def gyrate(joint: ClosingJoint, state: LoopState, out: Array) -> None:
    """Add g ω to the charge and -g i to the joint of a residual."""
    charge, turn = state.moves[_ALONG], state.moves[_ABOUT]
    for i in range(len(out)):
        out[i] += joint.gyration * (charge[i] * state.twist[_ALONG] - turn[i] * state.twist[_ABOUT])


@part
def gyration_gains(
    joint: ClosingJoint, state: LoopState, stiffness: float, damping: float, k: Array, c: Array
) -> None:
    """Derivatives of `gyrate`, and of a voltage by place and rate of the joint."""
    charge, turn = state.moves[_ALONG], state.moves[_ABOUT]
    for i in range(len(k)):
        for j in range(len(k)):
            both = charge[i] * turn[j]
            k[i, j] += stiffness * both
            c[i, j] += (damping + joint.gyration) * both
            c[j, i] -= joint.gyration * both


@part
def lift(reals: Array, integers: IntArray, at: int, place: Any, origin: float, period: float) -> Any:
    """Value of a cam's curve at a coordinate, and its first and second derivative by it; ``period`` 0: it has none."""
    if period.real > 0.0:
        place = place - period * np.floor((place.real - origin.real) / period.real)
    term = read_part(reals, integers, at + 1)
    piece = passed(term.knots, place.real)
    x, row = place - term.knots[max(piece - 1, 0)], term.pieces[piece]
    value = slope = half = 0.0 * x
    for i in range(len(row) - 1, -1, -1):
        half = half * x + slope
        slope = slope * x + value
        value = value * x + row[i]
    return value, slope, 2 * half


@part
def couple(
    loops: Loops, reals: Array, integers: IntArray, scratch: Array, joint: ClosingJoint, t: float, y: Array, v: Array,
    state: LoopState,
) -> None:  # fmt: skip
    """Pose, twist, its derivative and rows, as of a closing joint; joints that it names were seen to before."""
    row = state.moves[_ALONG]
    state.moves[:, :] = 0.0
    value, rate, bias = -joint.offset, 0.0 * joint.offset, 0.0 * joint.offset
    for k in range(len(joint.factors)):
        factor, at, slope = joint.factors[k], joint.columns[k], 1.0 + 0.0 * joint.offset
        other = read_loop_state(scratch, integers, loops.states + max(joint.others[k], 0) * LOOP_STATE)
        if joint.others[k] >= 0:
            place, speed, turning = other.effort[COORDINATE], other.effort[RATE], other.effort[TURNING]
        elif joint.curves[k] >= 0:
            place, speed, turning = curve(reals, integers, joint.curves[k], t)
        else:
            place, speed, turning = y[at], v[at], 0.0 * v[at]
        if joint.cams[k] >= 0:
            place, slope, bend = lift(reals, integers, joint.cams[k], place, joint.origins[k], joint.periods[k])
            speed, turning = slope * speed, slope * turning + bend * speed * speed
        if joint.others[k] >= 0:
            along = read_closing_joint(reals, integers, loops.first + joint.others[k] * CLOSING_JOINT).along
            for j in range(len(row)):
                row[j] += factor * slope * other.moves[along, j]
        else:
            row[at] += factor * slope
        value += factor * place
        rate += factor * speed
        bias += factor * turning
    for j in range(len(row)):
        state.moves[_ABOUT, j] = row[j]
    clear(state.pose)
    clear(state.twist)
    clear(state.twist_rate)
    state.pose[0] = state.pose[4] = state.pose[8] = 1.0
    state.pose[11] = value
    state.twist[_ALONG] = state.twist[_ABOUT] = rate
    state.twist_rate[_ALONG] = state.twist_rate[_ABOUT] = bias
