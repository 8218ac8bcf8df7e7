"""Forces along the free axis of joints: drives, springs, dampers, friction, stops, rotors; and the joint coordinates.

With the pose D of a joint's outer frame relative to its inner one, and the relative twist η in the outer frame's axes,
the rate of the joint coordinate is η's entry about or along z, a row over the twists of both nodes. Forces act along
that row. It does not change along the joint's own motion; with other motions it does, which the joint forbids.
"""

from __future__ import annotations

import math

import numpy as np

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    ACTING,
    BLOCKS,
    ENERGIES,
    FORCES,
    KNOT,
    REMEMBER,
    Model,
    Work,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.equations.nodal.joint_forces import frame_in_world, relative
from erls.equations.nodal.motion import set_twists
from erls.equations.nodal.rows import outer_product, push, rate_along
from erls.maths.coefficients import angle_of
from erls.maths.contact_law import stop_energy, stop_force, stop_gains
from erls.maths.jit import kernel, part
from erls.maths.motions import bracket, pair_minus, transformed, transposed
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    nine,
    plus,
    product,
    put,
    scaled,
    three,
    times,
    unit,
    vector,
)
from erls.maths.views import vector_at

_STOPS = 11  # first of six columns of `Model.actuators`; their stiffness is 0 where there are none
_NONE = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@part
def posed(model: Model, poses: Array, k: int) -> tuple[Vector, Rotation, Vector, Rotation]:
    """Pose of the outer frame in the inner one, and in the inner node."""
    inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
    frames = model.actuator_frames
    p, r = frame_in_world(poses, inner, frames, k, 0)
    end, end_turn = frame_in_world(poses, outer, frames, k, 12)
    place, turn = relative(p, r, end, end_turn)
    p, r = vector(frames, k, 0), nine(frames, k, 3)
    return place, turn, plus(p, times(r, place)), product(r, turn)


@part
def coordinate_of(model: Model, k: int, place: Vector, turn: Rotation, near: float) -> float:
    """Joint coordinate on the turn next to ``near``."""
    if model.actuator_along[k] == 2:
        return place[2]
    angle = angle_of(turn[3] - turn[1], turn[0] + turn[4])
    turns: float = np.round((near - angle).real / (2 * math.pi))
    return angle + 2 * math.pi * turns


@part
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


@part
def _effort(model: Model, k: int, sample: Array, angle: float, rate: float) -> float:
    """What drive, spring, damper and friction give."""
    at = 3 * len(model.joint_nodes) + len(model.load_nodes) + 3 * k
    law = model.actuators
    torque: float = sample[at + 2] + law[k, 6] * (sample[at] - angle) + law[k, 7] * (sample[at + 1] - rate)
    if torque.real > law[k, 9].real:
        torque = law[k, 9]
    elif torque.real < law[k, 8].real:
        torque = law[k, 8]
    torque -= law[k, 1] * (angle - law[k, 2]) + law[k, 3] * rate - law[k, 10]
    if law[k, 4] != 0.0:
        torque -= law[k, 4] * np.tanh(rate / law[k, 5])
    if law[k, _STOPS + 2] != 0.0:
        torque += stop_force(law[k, _STOPS:], angle, rate)[0]
    return torque


@part
def _turning(
    model: Model, twist: Array, change: Array, k: int, reach: Vector, axes: Rotation
) -> tuple[Twist, Twist, float, float]:
    """Rows of the coordinate's rate over the twists of both nodes, the rate and its own rate."""
    inner, outer = model.actuator_nodes[k, 0], model.actuator_nodes[k, 1]
    first, second = _rows(model, k, reach, axes)
    rate = rate_along(first, twist, inner) + rate_along(second, twist, outer)
    gain = rate_along(first, change, inner) + rate_along(second, change, outer)
    return first, second, rate, gain + _swing(model, k, reach, axes, twist)


@part
def actuate(
    model: Model, poses: Array, twist: Array, change: Array, sample: Array, k: int, near: float, force: Array
) -> float:
    """Add inertia of the rotor less the effort of actuator k, at twists and their rates, to ``force``; its coordinate,
    which lies next to ``near``.
    """
    place, turn, reach, axes = posed(model, poses, k)
    angle = coordinate_of(model, k, place, turn, near)
    if model.actuator_active[k]:
        first, second, rate, gain = _turning(model, twist, change, k, reach, axes)
        balance = model.actuators[k, 0] * gain - _effort(model, k, sample, angle, rate)
        push(force, model.actuator_nodes[k, 0], balance, first)
        push(force, model.actuator_nodes[k, 1], balance, second)
    return angle


@kernel(FORCES, counted=False)
def actuator_forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Add inertia of rotors less efforts to the force in `Work`, which gets the coordinates near those of ``last``."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before, sample = read_state(last, integers, known.state).turned, vector_at(scratch, 0, known.samples)
    for k in range(len(model.actuator_nodes)):
        work.turned[k] = actuate(model, work.poses, work.twist, work.rate, sample, k, before[k], work.force)


@part
def _derivatives(model: Model, work: Work, k: int, block: Array) -> None:
    """Mass of the rotor; damping of dampers, friction and gains; stiffness of springs and gains into a block."""
    if not model.actuator_active[k]:
        return
    _, _, reach, axes = posed(model, work.poses, k)
    first, second, rate, _ = _turning(model, work.twist, work.rate, k, reach, axes)
    law = model.actuators
    stiffness, damping = law[k, 1], law[k, 3]
    if law[k, 8].real < law[k, 9].real:  # else it gives its limit
        stiffness, damping = stiffness + law[k, 6], damping + law[k, 7]
    if law[k, 4] != 0.0:
        damping += law[k, 4] / law[k, 5] / np.cosh(min(abs(rate / law[k, 5]), 300.0)) ** 2
    if law[k, _STOPS + 2] != 0.0:
        pushed, damped = stop_gains(law[k, _STOPS:], work.turned[k], rate)
        stiffness, damping = stiffness + pushed, damping + damped
    outer_product(block, work.rows[0], first, second, stiffness, damping, law[k, 0])


@kernel(BLOCKS, counted=False)
def actuator_derivatives(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Those of all actuators, next to what beams, bodies and loads have in `Work.blocks`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    first = len(model.beam_nodes) + len(model.body_nodes) + len(model.load_nodes)
    for k in range(len(model.actuator_nodes)):
        _derivatives(model, work, k, work.blocks[first + k])


@part
def _energy(model: Model, work: Work, k: int) -> tuple[float, float]:
    """Of the rotor, and of spring and stops."""
    _, _, reach, axes = posed(model, work.poses, k)
    _, _, rate, _ = _turning(model, work.twist, work.rate, k, reach, axes)
    law = model.actuators
    stored = 0.5 * law[k, 1] * (work.turned[k] - law[k, 2]) ** 2
    if law[k, _STOPS + 2] != 0.0:
        stored += stop_energy(law[k, _STOPS:], work.turned[k])
    return 0.5 * law[k, 0] * rate * rate, stored


@kernel(ENERGIES, counted=False)
def actuator_energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Add kinetic energy of rotors, and that of springs in joints."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for k in range(len(model.actuator_nodes)):
        kinetic, spring = _energy(model, work, k)
        out[0] += kinetic
        out[4] += spring


@part
def _acting(model: Model, work: Work, sample: Array, k: int, out: Array) -> None:
    """Of actuator k (10,): coordinate, rate, acceleration, effort, and the wrench on the outer node in its axes."""
    _, _, reach, axes = posed(model, work.poses, k)
    _, second, rate, gain = _turning(model, work.twist, work.rate, k, reach, axes)
    effort = 0.0 * rate
    if model.actuator_active[k]:
        effort = _effort(model, k, sample, work.turned[k], rate)
    strength = effort - model.actuators[k, 0] * gain
    out[0], out[1], out[2], out[3] = work.turned[k], rate, gain, effort
    put(out, 4, scaled(strength, second[0]))
    put(out, 7, scaled(strength, second[1]))


@kernel(ACTING, counted=False)
def in_joints(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """(a, 10) coordinate, rate, acceleration, effort and wrench of each actuator."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    sample = vector_at(scratch, 0, known.samples)
    set_twists(model, work)
    for k in range(len(model.actuator_nodes)):
        _acting(model, work, sample, k, out[k])


@kernel(REMEMBER, counted=False)
def turn_actuators(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Coordinates at the poses of `Work`, near those of ``last``."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before = read_state(last, integers, known.state).turned
    for k in range(len(model.actuator_nodes)):
        place, turn, _, _ = posed(model, work.poses, k)
        work.turned[k] = coordinate_of(model, k, place, turn, before[k])


@kernel(KNOT, counted=False)
def store_actuators(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Coordinates, rates and accelerations of all actuators at the end of a knot (3, s)."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    first_entry = out.shape[1] - len(model.actuator_nodes)
    for k in range(len(model.actuator_nodes)):
        _, _, reach, axes = posed(model, work.poses, k)
        _, _, rate, gain = _turning(model, work.twist, work.rate, k, reach, axes)
        column = first_entry + k
        out[0, column], out[1, column], out[2, column] = work.turned[k], rate, gain
