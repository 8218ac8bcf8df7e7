"""Torques that the rigid chain needs for the wanted motion of all joints (`erls.mechanism.rigid_dynamics`)."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls.layout import HELD, ROTOR
from erls.equations.ffr import layout as at
from erls.equations.ffr.motion import step_pose
from erls.equations.serial.curves import curve
from erls.equations.serial.linear import add_bracket, add_transport, carry, carry_back, dot6
from erls.maths.jit import part


@part
def feed_forward(reals: Array, integers: IntArray, scratch: Array, t: float) -> None:
    """Into EFFECTIVE of each link's memory; it writes over the motion of the links: the first thing in an evaluation.

    Recursive Newton-Euler method, with the weight as an acceleration of the ground.
    """
    links = integers[at.LINKS]
    for k in range(links):
        record = at.HEADER + k * at.RECORD
        memory = integers[record + at.MEMORY]
        link = scratch[memory : memory + at.VECTORS]
        frame, joint = link[at.FRAME : at.FRAME + 12], link[at.POINT : at.POINT + 6]
        wrench, momentum = link[at.WRENCH : at.WRENCH + 6], link[at.MOMENTUM : at.MOMENTUM + 6]
        angle, rate, acceleration = reals[integers[record + at.FORCES] + HELD], 0.0, 0.0
        if integers[record + at.MOTION] >= 0:
            angle, rate, acceleration = curve(integers, reals, integers[record + at.MOTION], t)
        step_pose(reals, integers[record + at.RIGID_STEP], integers[record + at.SLIDES], angle, link)
        if k == 0:
            for i in range(6):
                frame[i] = joint[i] = 0.0
            for i in range(3):
                joint[i] = -reals[at.GRAVITY + i]
            carry(link, joint, 0, frame, 6)
        else:
            before = scratch[integers[record - at.RECORD + at.MEMORY] + at.FRAME :]
            carry(link, before, 0, frame, 0)
            carry(link, before, 6, frame, 6)
        screw = integers[record + at.RIGID_SCREW]
        for i in range(6):
            joint[i] = reals[screw + i] * rate
        add_bracket(frame, 0, joint, 0, 1.0, frame, 6)
        for i in range(6):
            frame[i] += joint[i]
            frame[6 + i] += reals[screw + i] * acceleration
        rigid = integers[record + at.RIGID]
        for i in range(6):
            momentum[i] = wrench[i] = 0.0
            for j in range(6):
                momentum[i] += reals[rigid + 6 * i + j] * frame[j]
                wrench[i] += reals[rigid + 6 * i + j] * frame[6 + j]
        add_transport(frame, 0, momentum, 0, wrench, 0)
        link[at.EFFECTIVE] = reals[integers[record + at.FORCES] + ROTOR] * acceleration
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory = integers[record + at.MEMORY]
        link = scratch[memory : memory + at.VECTORS]
        link[at.EFFECTIVE] += dot6(reals, integers[record + at.RIGID_SCREW], link, at.WRENCH)
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            carry_back(link, link, at.WRENCH, link, at.POINT)
            for i in range(6):
                scratch[start + at.WRENCH + i] += link[at.POINT + i]
