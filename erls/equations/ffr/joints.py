"""Forces of drives, springs, dampers and friction in joints; stiffness and damping of a chain, all on the diagonals."""

from __future__ import annotations

import math

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls.layout import DAMPER, FRICTION, GAIN, LIMIT, RATE_GAIN, REST, SPRING, TRANSITION
from erls.equations.ffr import layout as at
from erls.equations.ffr.feed_forward import feed_forward
from erls.equations.serial.curves import curve
from erls.maths.jit import kernel, part


@part
def wanted(reals: Array, integers: IntArray, record: int, t: float, angle: float, rate: float, feed: float) -> float:
    """Force that the drive of a joint asks of its motor, ``feed`` what `erls.equations.ffr.feed_forward` found."""
    joint = integers[record + at.FORCES]
    torque = 0.0
    if integers[record + at.LOAD] >= 0:
        torque, _, _ = curve(integers, reals, integers[record + at.LOAD], t)
    elif integers[record + at.MOTION] >= 0:
        goal, goal_rate, _ = curve(integers, reals, integers[record + at.MOTION], t)
        torque = reals[joint + GAIN] * (goal - angle) + reals[joint + RATE_GAIN] * (goal_rate - rate)
    if integers[record + at.FEED]:
        torque += feed
    return float(torque)


@part
def effort(reals: Array, integers: IntArray, record: int, t: float, link: Array) -> float:
    """Force on a free joint."""
    joint = integers[record + at.FORCES]
    angle, rate, limit = link[at.ANGLE], link[at.ANGLE + 1], reals[joint + LIMIT]
    torque = max(-limit, min(limit, wanted(reals, integers, record, t, angle, rate, link[at.EFFECTIVE])))
    torque -= reals[joint + SPRING] * (angle - reals[joint + REST]) + reals[joint + DAMPER] * rate
    if reals[joint + FRICTION] != 0.0:
        torque -= reals[joint + FRICTION] * math.tanh(rate / reals[joint + TRANSITION])
    return float(torque)


@part
def gains(
    reals: Array, integers: IntArray, record: int, t: float, angle: float, rate: float, feed: float
) -> tuple[float, float]:
    """-∂effort/∂angle and -∂effort/∂rate of a free joint."""
    joint = integers[record + at.FORCES]
    stiffness, damping = reals[joint + SPRING], reals[joint + DAMPER]
    if reals[joint + FRICTION] != 0.0:
        transition = reals[joint + TRANSITION]
        damping += reals[joint + FRICTION] / transition / math.cosh(min(abs(rate) / transition, 300.0)) ** 2
    if abs(wanted(reals, integers, record, t, angle, rate, feed)) <= reals[joint + LIMIT]:  # else it gives no more
        stiffness += reals[joint + GAIN]
        damping += reals[joint + RATE_GAIN]
    return stiffness, damping


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Of modes, joint springs, dampers, friction and controllers; see `erls.equations.compiled_system`."""
    k[:, :] = 0.0
    c[:, :] = 0.0
    if integers[at.FEED_FORWARD]:
        feed_forward(reals, integers, scratch, t)
    for link in range(integers[at.LINKS]):
        record = at.HEADER + link * at.RECORD
        first = integers[record + at.FIRST_MODE]
        for i in range(integers[record + at.MODES]):
            k[first + i, first + i] = reals[integers[record + at.STIFFNESS] + i]
            c[first + i, first + i] = reals[integers[record + at.DAMPING] + i]
        place = integers[record + at.JOINT]
        if place >= 0 and integers[record + at.EFFORT]:
            feed = scratch[integers[record + at.MEMORY] + at.EFFECTIVE]
            k[place, place], c[place, place] = gains(reals, integers, record, t, y[place], v[place], feed)
