"""Points against planes, by the law of `erls.maths.contact_law`.

The rate of the gap is J ν with J = [-n at the place of the point, n at the point], each as a wrench of its node, and
velocities along the plane likewise. How these rows turn with motion is left out of the derivatives, and that friction
grows with depth.
"""

from __future__ import annotations

import numpy as np

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    ACTING,
    BLOCKS,
    ENERGIES,
    FORCES,
    Model,
    Work,
    read_layout,
    read_model,
    read_work,
)
from erls.equations.nodal.motion import set_twists
from erls.equations.nodal.rows import push, rate_along
from erls.maths.contact_law import (
    contact_energy,
    contact_force,
    contact_gains,
    elastic_force,
    friction_force,
    friction_gains,
)
from erls.maths.jit import kernel, part
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    add,
    cross,
    dot,
    minus,
    nine,
    plus,
    put,
    scaled,
    times,
    turned,
    vector,
)

_LAW, _FRICTION = 15, 19  # places in a row of `Model.contacts`


@part
def _placed(model: Model, poses: Array, k: int) -> tuple[Vector, Vector, float, Rotation]:
    """Point of contact k in the world, the same from what carries the plane, the gap, and the axes of that."""
    base, node = model.contact_nodes[k, 0], model.contact_nodes[k, 1]
    place = plus(vector(poses, node, 0), times(nine(poses, node, 3), vector(model.contacts, k, 0)))
    carrier = scaled(0.0, place)
    turn = nine(poses, node, 3)
    if base >= 0:
        carrier, turn = vector(poses, base, 0), nine(poses, base, 3)
    else:
        one, none = 1.0 + 0.0 * turn[0], 0.0 * turn[0]
        turn = (one, none, none, none, one, none, none, none, one)
    local = turned(turn, minus(place, carrier))
    gap = dot(vector(model.contacts, k, 6), minus(local, vector(model.contacts, k, 3)))
    return place, local, gap, turn


@part
def _row(model: Model, poses: Array, k: int, local: Vector, turn: Rotation, axis: Vector) -> tuple[Twist, Twist]:
    """Velocity along a direction, given in the axes of the plane's carrier, over the twists of that and of the node."""
    node = model.contact_nodes[k, 1]
    along = turned(nine(poses, node, 3), times(turn, axis))
    outer = along, cross(vector(model.contacts, k, 0), along)
    inner = scaled(-1.0, axis), scaled(-1.0, cross(local, axis))
    return inner, outer


@part
def _rate(model: Model, twist: Array, k: int, rows: tuple[Twist, Twist]) -> float:
    both = model.contact_nodes
    return rate_along(rows[0], twist, both[k, 0]) + rate_along(rows[1], twist, both[k, 1])


@part
def _known(model: Model, work: Work, k: int) -> tuple[float, float, float, float, float]:
    """Gap and its rate, normal force, and velocities along the two axes of the plane, of contact k."""
    _, local, gap, turn = _placed(model, work.poses, k)
    law = model.contacts[k, _LAW:]
    rate = _rate(model, work.twist, k, _row(model, work.poses, k, local, turn, vector(model.contacts, k, 6)))
    along = _rate(model, work.twist, k, _row(model, work.poses, k, local, turn, vector(model.contacts, k, 9)))
    across = _rate(model, work.twist, k, _row(model, work.poses, k, local, turn, vector(model.contacts, k, 12)))
    return gap, rate, contact_force(law, -gap, -rate), along, across


@part
def _strengths(model: Model, work: Work, k: int) -> Vector:
    """Force on the point along the three axes of the plane."""
    _, _, force, along, across = _known(model, work, k)
    if model.contacts[k, _FRICTION] == 0.0 or force.real <= 0.0:
        return force, 0.0 * force, 0.0 * force
    local = _placed(model, work.poses, k)[1]
    first, second = dot(vector(model.contacts, k, 9), local), dot(vector(model.contacts, k, 12), local)
    rub = friction_force(model.contacts[k, _FRICTION:], force, along, across, first, second)
    return force, rub[0], rub[1]


@kernel(FORCES, counted=False)
def contact_forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Subtract what contacts do from the force in `Work`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for k in range(len(model.contact_nodes)):
        _, local, gap, turn = _placed(model, work.poses, k)
        if gap.real >= 0.0:
            continue
        strengths = _strengths(model, work, k)
        for axis in range(3):
            inner, outer = _row(model, work.poses, k, local, turn, vector(model.contacts, k, 6 + 3 * axis))
            push(work.force, model.contact_nodes[k, 0], -strengths[axis], inner)
            push(work.force, model.contact_nodes[k, 1], -strengths[axis], outer)


@part
def _add_square(block: Array, line: Array, rows: tuple[Twist, Twist], stiffness: float, damping: float) -> None:
    """Add stiffness and damping along a row to a block (3, 12, 12)."""
    put(line, 0, rows[0][0])
    put(line, 3, rows[0][1])
    put(line, 6, rows[1][0])
    put(line, 9, rows[1][1])
    for i in range(12):
        for j in range(12):
            block[1, i, j] += damping * line[i] * line[j]
            block[2, i, j] += stiffness * line[i] * line[j]


@part
def _derivatives(model: Model, work: Work, k: int, block: Array) -> None:
    """Damping and stiffness of contact k into a block of zeros."""
    _, local, gap, turn = _placed(model, work.poses, k)
    if gap.real >= 0.0:
        return
    _, rate, force, along, across = _known(model, work, k)
    stiffness, damping = contact_gains(model.contacts[k, _LAW:], -gap, -rate)
    normal, first = vector(model.contacts, k, 6), vector(model.contacts, k, 9)
    second = vector(model.contacts, k, 12)
    _add_square(block, work.rows[0], _row(model, work.poses, k, local, turn, normal), stiffness, damping)
    if model.contacts[k, _FRICTION] == 0.0:
        return
    along_it, slip, hold = friction_gains(model.contacts[k, _FRICTION:], force, along, across)
    speed = np.sqrt(along * along + across * across)
    ahead = first
    if speed.real > 0.0:
        ahead = plus(scaled(along / speed, first), scaled(across / speed, second))
    aside = cross(normal, ahead)
    _add_square(block, work.rows[0], _row(model, work.poses, k, local, turn, ahead), hold, along_it)
    _add_square(block, work.rows[0], _row(model, work.poses, k, local, turn, aside), hold, slip)


@kernel(BLOCKS, counted=False)
def contact_derivatives(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Those of all contacts, next to what actuators have in `Work.blocks`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    first = len(model.beam_nodes) + len(model.body_nodes) + len(model.load_nodes) + len(model.actuator_nodes)
    for k in range(len(model.contact_nodes)):
        _derivatives(model, work, k, work.blocks[first + k])


@kernel(ENERGIES, counted=False)
def contact_energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Add the elastic energy of all contacts to that of what acts in joints."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for k in range(len(model.contact_nodes)):
        out[4] += contact_energy(model.contacts[k, _LAW:], -_placed(model, work.poses, k)[2])


@kernel(ACTING, counted=False)
def in_contacts(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """(c, 15) of each contact: gap and its rate, normal force, force on the point and its place in the world, elastic
    energy, the power that is not elastic; velocity along the two axes of the plane, and place there.
    """
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    set_twists(model, work)
    for k in range(len(model.contact_nodes)):
        place, local, gap, turn = _placed(model, work.poses, k)
        _, rate, force, along, across = _known(model, work, k)
        strengths, law = _strengths(model, work, k), model.contacts[k, _LAW:]
        out[k, 0], out[k, 1], out[k, 2] = gap, rate, force
        put(out[k], 3, scaled(0.0, place))
        for axis in range(3):
            add(out[k], 3, scaled(strengths[axis], times(turn, vector(model.contacts, k, 6 + 3 * axis))))
        put(out[k], 6, place)
        out[k, 9] = contact_energy(law, -gap)
        out[k, 10] = (force - elastic_force(law, -gap)) * rate + strengths[1] * along + strengths[2] * across
        out[k, 11], out[k, 12] = along, across
        out[k, 13], out[k, 14] = dot(vector(model.contacts, k, 9), local), dot(vector(model.contacts, k, 12), local)
