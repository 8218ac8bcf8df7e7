"""Forces along the free axis of joints and the joint coordinates: the formulas of `erls.equations.nodal.actuators`."""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array
from erls.equations.nodal.kernels.contract import Knots, Model, Work
from erls.equations.nodal.kernels.joints import frame_in_world, relative
from erls.maths.jit import inlined, part
from erls.maths.motions import bracket, pair_minus, transformed, transposed
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    add,
    dot,
    nine,
    plus,
    product,
    scaled,
    three,
    times,
    unit,
    vector,
)

_NONE = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@inlined
def _posed(model: Model, poses: Array, k: int) -> tuple[Vector, Rotation, Vector, Rotation]:
    """Pose of the outer frame in the inner one, and in the inner node."""
    inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
    frames = model.actuator_frames
    p, r = frame_in_world(poses, inner, frames, k, 0)
    end, end_turn = frame_in_world(poses, outer, frames, k, 12)
    place, turn = relative(p, r, end, end_turn)
    p, r = vector(frames, k, 0), nine(frames, k, 3)
    return place, turn, plus(p, times(r, place)), product(r, turn)


@inlined
def _coordinate(model: Model, k: int, place: Vector, turn: Rotation, near: float) -> float:
    """Joint coordinate on the turn next to ``near``."""
    if model.actuator_along[k] == 2:
        return place[2]
    angle = math.atan2(turn[3] - turn[1], turn[0] + turn[4])
    return angle + 2 * math.pi * round((near - angle) / (2 * math.pi))


@inlined
def _rows(model: Model, k: int, reach: Vector, axes: Rotation) -> tuple[Twist, Twist]:
    """Rate of the coordinate along the twists of the inner and the outer node."""
    along = model.actuator_along[k]
    n, m = unit(along), unit(along - 3)
    frames = model.actuator_frames
    outer = transposed(vector(frames, k, 12), nine(frames, k, 15), n, m)
    if model.actuator_nodes[k, 0] < 0:
        return _NONE, outer
    inner = transposed(reach, axes, n, m)
    return (scaled(-1.0, inner[0]), scaled(-1.0, inner[1])), outer


@part
def _along(row: Twist, values: Array, node: int) -> float:
    if node < 0:
        return 0.0
    v, w = three(values, 6 * node), three(values, 6 * node + 3)
    return dot(row[0], v) + dot(row[1], w)


@inlined
def _swing(model: Model, k: int, reach: Vector, axes: Rotation, twist: Array) -> float:
    """Acceleration of the coordinate at constant twists."""
    inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
    if inner < 0:
        return 0.0
    carried = transformed(reach, axes, three(twist, 6 * inner), three(twist, 6 * inner + 3))
    frames = model.actuator_frames
    end = transformed(
        vector(frames, k, 12), nine(frames, k, 15), three(twist, 6 * outer), three(twist, 6 * outer + 3)
    )
    apart = pair_minus(end, carried)
    v, w = bracket(apart[0], apart[1], carried[0], carried[1])
    if model.actuator_along[k] == 2:
        return v[2]
    return w[2]


@inlined
def _effort(model: Model, k: int, sample: Array, angle: float, rate: float) -> float:
    """What drive, spring, damper and friction give."""
    at = len(model.joint_nodes) + len(model.load_nodes) + 3 * k
    law = model.actuators
    torque: float = sample[at + 2] + law[k, 6] * (sample[at] - angle) + law[k, 7] * (sample[at + 1] - rate)
    torque = max(-law[k, 8], min(law[k, 8], torque))
    torque -= law[k, 1] * (angle - law[k, 2]) + law[k, 3] * rate
    if law[k, 4] != 0.0:
        torque -= law[k, 4] * math.tanh(rate / law[k, 5])
    return torque


@inlined
def actuator_forces(model: Model, work: Work, before: Array, sample: Array) -> None:
    """Add inertia of rotors less efforts to ``work.force``; coordinates near ``before`` go into ``work.turned``."""
    for k in range(len(model.actuator_nodes)):
        place, turn, reach, axes = _posed(model, work.poses, k)
        angle = _coordinate(model, k, place, turn, before[k])
        work.turned[k] = angle
        if not model.actuator_active[k]:
            continue
        inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
        first, second = _rows(model, k, reach, axes)
        rate = _along(first, work.twist, inner) + _along(second, work.twist, outer)
        gain = _along(first, work.rate, inner) + _along(second, work.rate, outer)
        gain += _swing(model, k, reach, axes, work.twist)
        balance = model.actuators[k, 0] * gain - _effort(model, k, sample, angle, rate)
        if inner >= 0:
            add(work.force, 6 * inner, scaled(balance, first[0]))
            add(work.force, 6 * inner + 3, scaled(balance, first[1]))
        add(work.force, 6 * outer, scaled(balance, second[0]))
        add(work.force, 6 * outer + 3, scaled(balance, second[1]))


@inlined
def actuator_derivatives(model: Model, work: Work, k: int) -> None:
    """Mass of the rotor, damping and stiffness of actuator k; a node that is the ground counts as one without share."""
    _, _, reach, axes = _posed(model, work.poses, k)
    inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
    first, second = _rows(model, k, reach, axes)
    rate = _along(first, work.twist, inner) + _along(second, work.twist, outer)
    law = model.actuators
    stiffness, damping = law[k, 1] + law[k, 6], law[k, 3] + law[k, 7]
    if law[k, 4] != 0.0:
        damping += law[k, 4] / law[k, 5] / math.cosh(min(abs(rate) / law[k, 5], 300.0)) ** 2
    for i in range(12):
        for j in range(12):
            both = _entry(first, second, i) * _entry(first, second, j)
            work.mass[i, j] = law[k, 0] * both
            work.damping[i, j] = damping * both
            work.stiffness[i, j] = stiffness * both


@part
def _entry(first: Twist, second: Twist, i: int) -> float:
    row = first if i < 6 else second
    i %= 6
    return row[0][i] if i < 3 else row[1][i - 3]


@inlined
def set_coordinates(model: Model, work: Work, before: Array) -> None:
    """Coordinates of all actuators near ``before``."""
    for k in range(len(model.actuator_nodes)):
        place, turn, _, _ = _posed(model, work.poses, k)
        work.turned[k] = _coordinate(model, k, place, turn, before[k])


@inlined
def store_coordinates(model: Model, work: Work, knots: Knots, at: int) -> None:
    """Coordinates, rates and accelerations of all actuators behind the frames of knot ``at``."""
    first_entry = knots.states.shape[2] - len(model.actuator_nodes)
    for k in range(len(model.actuator_nodes)):
        _, _, reach, axes = _posed(model, work.poses, k)
        inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
        first, second = _rows(model, k, reach, axes)
        column = first_entry + k
        knots.states[at, 0, column] = work.turned[k]
        knots.states[at, 1, column] = _along(first, work.twist, inner) + _along(second, work.twist, outer)
        gain = _along(first, work.rate, inner) + _along(second, work.rate, outer)
        knots.states[at, 2, column] = gain + _swing(model, k, reach, axes, work.twist)
