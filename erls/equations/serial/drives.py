"""Forces of drives, springs, dampers and friction in joints."""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.motion import step_pose
from erls.equations.serial.curves import curve
from erls.equations.serial.linear import add_bracket, add_transport, carry, carry_back, dot6
from erls.maths.jit import part


@part
def feed_forward(reals: Array, integers: IntArray, scratch: Array, t: float) -> None:
    """Torques that the rigid chain needs for the wanted motion of all joints, into EFFECTIVE of each link's memory.

    Recursive Newton-Euler method. It writes over the motion of the links: the first thing in an evaluation.
    """
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        memory, n = integers[record + at.MEMORY], 6 + integers[record + at.MODES]
        link = scratch[memory : memory + at.VECTORS]
        angle, rate, acceleration = reals[integers[record + at.FORCES] + at.HELD], 0.0, 0.0
        if integers[record + at.MOTION] >= 0:
            angle, rate, acceleration = curve(integers, reals, integers[record + at.MOTION], t)
        step_pose(reals, integers[record + at.STEP], integers[record + at.SLIDES], angle, link)
        screw = reals[integers[record + at.SCREW] : integers[record + at.SCREW] + 6]
        if k == 0:
            for i in range(6):
                link[at.POINT + i] = 0.0
                link[at.TWIST + i] = 0.0
            for i in range(3):
                link[at.POINT + i] = -reals[at.GRAVITY + i]
            carry(link, link, at.POINT, link, at.TWIST_RATE)
        else:
            start = integers[record - at.RECORD + at.MEMORY]
            before = scratch[start : start + at.VECTORS]
            carry(link, before, at.TWIST, link, at.TWIST)
            carry(link, before, at.TWIST_RATE, link, at.TWIST_RATE)
        for i in range(6):
            link[at.TWIST + i] += screw[i] * rate
            link[at.TWIST_RATE + i] += screw[i] * acceleration
        add_bracket(screw, 0, link, at.TWIST, -rate, link, at.TWIST_RATE)
        mass = integers[record + at.MASS]
        for i in range(6):
            momentum = force = 0.0
            for j in range(6):
                momentum += reals[mass + j * n + i] * link[at.TWIST + j]
                force += reals[mass + j * n + i] * link[at.TWIST_RATE + j]
            link[at.POINT + i] = momentum
            link[at.WRENCH + i] = force
        add_transport(link, at.TWIST, link, at.POINT, link, at.WRENCH)
        link[at.EFFECTIVE] = reals[integers[record + at.FORCES] + at.ROTOR] * acceleration
    for k in range(integers[at.LINKS] - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory = integers[record + at.MEMORY]
        link = scratch[memory : memory + at.VECTORS]
        link[at.EFFECTIVE] += dot6(reals, integers[record + at.SCREW], link, at.WRENCH)
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            carry_back(link, link, at.WRENCH, link, at.POINT)
            for i in range(6):
                scratch[start + at.WRENCH + i] += link[at.POINT + i]


@part
def effort(reals: Array, integers: IntArray, record: int, t: float, link: Array) -> float:
    """Force on a free joint; with feed-forward prepared by `feed_forward`."""
    joint = integers[record + at.FORCES]
    angle, rate = link[at.ANGLE], link[at.ANGLE + 1]
    limit = reals[joint + at.LIMIT]
    torque = max(-limit, min(limit, wanted(reals, integers, record, t, link)))
    torque -= reals[joint + at.SPRING] * (angle - reals[joint + at.REST]) + reals[joint + at.DAMPER] * rate
    if reals[joint + at.FRICTION] != 0.0:
        torque -= reals[joint + at.FRICTION] * math.tanh(rate / reals[joint + at.TRANSITION])
    return float(torque)


@part
def wanted(reals: Array, integers: IntArray, record: int, t: float, link: Array) -> float:
    """Force that the drive of a joint asks of its motor."""
    joint = integers[record + at.FORCES]
    torque = 0.0
    if integers[record + at.LOAD] >= 0:
        torque, _, _ = curve(integers, reals, integers[record + at.LOAD], t)
    elif integers[record + at.MOTION] >= 0:
        angle, rate, _ = curve(integers, reals, integers[record + at.MOTION], t)
        torque = reals[joint + at.GAIN] * (angle - link[at.ANGLE])
        torque += reals[joint + at.RATE_GAIN] * (rate - link[at.ANGLE + 1])
    if integers[record + at.FEED]:
        torque += link[at.EFFECTIVE]
    return float(torque)


@part
def gains(reals: Array, integers: IntArray, record: int, rate: float) -> tuple[float, float]:
    """-∂effort/∂angle and -∂effort/∂rate of a free joint."""
    joint = integers[record + at.FORCES]
    damping = reals[joint + at.DAMPER] + reals[joint + at.RATE_GAIN]
    if reals[joint + at.FRICTION] != 0.0:
        transition = reals[joint + at.TRANSITION]
        damping += reals[joint + at.FRICTION] / transition / math.cosh(min(abs(rate) / transition, 300.0)) ** 2
    return reals[joint + at.SPRING] + reals[joint + at.GAIN], damping
