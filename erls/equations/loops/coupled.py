"""Couplings of joint coordinates (`erls.mechanism.couplings`) as frames that lie e apart along z."""

from __future__ import annotations

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
from erls.equations.serial.time_curves import curve
from erls.maths.jit import part
from erls.maths.products import clear

_ALONG, _ABOUT = 2, 5  # an elastic coupling acts along either, a condition along the former


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
        factor, at = joint.factors[k], joint.columns[k]
        if joint.others[k] >= 0:
            other = read_loop_state(scratch, integers, loops.states + joint.others[k] * LOOP_STATE)
            along = read_closing_joint(reals, integers, loops.first + joint.others[k] * CLOSING_JOINT).along
            place, speed, turning = other.effort[COORDINATE], other.effort[RATE], other.effort[TURNING]
            for j in range(len(row)):
                row[j] += factor * other.moves[along, j]
        else:
            if joint.curves[k] >= 0:
                place, speed, turning = curve(reals, integers, joint.curves[k], t)
            else:
                place, speed, turning = y[at], v[at], 0.0 * v[at]
            row[at] += factor
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
