"""Motion of joints, and the forces of drives, springs, dampers, friction, stops and rotors along them."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.serial.records import Joint, JointState, Serial, call_turn_by_vector
from erls.equations.serial.time_curves import curve
from erls.maths.contact_law import stop_energy, stop_force, stop_gains
from erls.maths.jit import part
from erls.maths.so3 import Array
from fe_import.model import IntArray


@part
def step_pose(step: Array, coordinate: Any, pose: Array) -> None:
    """Pose (12,) over a joint at its coordinate; ``step`` as of `Joint`."""
    c, s = np.cos(coordinate), np.sin(coordinate)
    for i in range(12):
        pose[i] = step[0, i] + c * step[1, i] + s * step[2, i] + coordinate * step[3, i]


@part
def set_coordinate(
    joint: Joint, state: JointState, reals: Array, integers: IntArray, t: float, y: Array, v: Array, a: Array
) -> None:
    """θ, θ̇, θ̈ from the state or, prescribed, from time; θ̈ = 0 where it is free and ``a`` is empty."""
    coordinate = state.coordinate
    if joint.place >= 0:
        coordinate[0], coordinate[1] = y[joint.place], v[joint.place]
        coordinate[2] = a[joint.place] if len(a) else 0.0
    else:
        coordinate[0], coordinate[1], coordinate[2] = curve(reals, integers, joint.motion, t)


@part
def move_joint(
    serial: Serial, k: int, joint: Joint, state: JointState, reals: Array, integers: IntArray, scratch: Array,
    t: float, y: Array, v: Array, a: Array,
) -> None:  # fmt: skip
    """Coordinate, pose and motion of joint k; a rotation vector moves all three of its joints with the first one."""
    if joint.component > 0:
        return
    set_coordinate(joint, state, reals, integers, t, y, v, a)
    if joint.component == 0:
        joints, states = serial.joints, serial.joint_states
        call_turn_by_vector(serial.vectors, joints, states, k, reals, integers, scratch, t, y, v, a)
        return
    step_pose(joint.step, state.coordinate[0], state.pose)
    rate, acceleration = state.coordinate[1], state.coordinate[2]
    for i in range(6):
        state.screw[i] = joint.screw[i]
        state.twist[i], state.twist_rate[i] = joint.screw[i] * rate, joint.screw[i] * acceleration


@part
def _saturated(x: Any) -> Any:
    """tanh x; that of large complex numbers overflows in compiled code."""
    if abs(x.real) < 20.0:
        return np.tanh(x)
    return 0.0 * x + (1.0 if x.real > 0.0 else -1.0)


@part
def wanted(joint: Joint, reals: Array, integers: IntArray, t: float, angle: Any, rate: Any, feed: Any) -> Any:
    """Force that the drive of a joint asks of its motor; ``feed`` is what `feed_forward` found."""
    force = 0.0 * angle
    if joint.load >= 0:
        force += curve(reals, integers, joint.load, t)[0]
    if joint.motion >= 0:
        goal, goal_rate, _ = curve(reals, integers, joint.motion, t)
        force += joint.gain * (goal - angle) + joint.rate_gain * (goal_rate - rate)
    if joint.feeds:
        force += feed
    return force


@part
def effort(joint: Joint, reals: Array, integers: IntArray, t: float, angle: Any, rate: Any, feed: Any) -> Any:
    """Force of drive, spring, damper, friction and stops along a joint."""
    force = wanted(joint, reals, integers, t, angle, rate, feed)
    if force.real > joint.most.real:
        force = 0.0 * force + joint.most
    elif force.real < joint.least.real:
        force = 0.0 * force + joint.least
    force -= joint.stiffness * (angle - joint.rest) + joint.damping * rate - joint.rubbing
    if joint.friction != 0.0:
        force -= joint.friction * _saturated(rate / joint.transition)
    if len(joint.stops) > 0:
        force += stop_force(joint.stops, angle, rate)[0]
    return force


@part
def elastic_effort(joint: Joint, angle: Any) -> Any:
    """What of it follows from `joint_energy`."""
    force = -joint.stiffness * (angle - joint.rest)
    if len(joint.stops) > 0:
        force += stop_force(joint.stops, angle, 0.0 * angle)[1]
    return force


@part
def joint_energy(joint: Joint, angle: Any) -> Any:
    """Elastic energy of spring and stops."""
    energy = joint.stiffness * (angle - joint.rest) ** 2 / 2
    if len(joint.stops) > 0:
        energy += stop_energy(joint.stops, angle)
    return energy


@part
def gains(
    joint: Joint, reals: Array, integers: IntArray, t: float, angle: Any, rate: Any, feed: Any
) -> tuple[Any, Any]:
    """-∂effort/∂angle and -∂effort/∂rate."""
    stiffness, damping = joint.stiffness, joint.damping
    if joint.friction != 0.0:
        ratio = rate / joint.transition
        if abs(ratio.real) < 300.0:  # beyond, cosh overflows
            damping += joint.friction / joint.transition / np.cosh(ratio) ** 2
    if len(joint.stops) > 0:
        pushed, damped = stop_gains(joint.stops, angle, rate)
        stiffness += pushed
        damping += damped
    asked = wanted(joint, reals, integers, t, angle, rate, feed).real
    if joint.least.real <= asked <= joint.most.real:  # else it gives no more
        stiffness += joint.gain
        damping += joint.rate_gain
    return stiffness, damping
