"""Springs and dampers along the line between two points, and about an axis; one side may be the ground.

With the points' distance l and the direction n from the first to the second, the tension is N = k (l − l₀) + c l̇, and
l̇ = J ν with J = [−n at the first point, n at the second], each as a wrench of its node.

About an axis a, with ψ = log(R₁ᵀ R₂) of frames that coincide as built, the angle is α = a · ψ, whole turns counted;
about the axis of a revolute joint it is the joint's angle. α̇ = w · (ω₂ − Rᵀ ω₁) with w = T⁻ᵀ(ψ) a, and the moment is
k (α − α₀) + c α̇. How rates change with direction is left out of the derivatives.
"""

from __future__ import annotations

import numpy as np

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    BLOCKS,
    ENERGIES,
    FORCES,
    REMEMBER,
    Model,
    Work,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.equations.nodal.rows import outer_product, push, rate_along
from erls.maths.coefficients import inverse_coefficient
from erls.maths.jit import kernel, part
from erls.maths.rotations import first, logarithm_near, value
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    back_product,
    cross,
    dot,
    minus,
    nine,
    plus,
    product,
    scaled,
    times,
    turned,
    unit,
    vector,
)


@part
def _end(poses: Array, node: int, arm: Vector) -> Vector:
    """A point of a node, or of the ground, in the world."""
    if node < 0:
        return arm
    return plus(vector(poses, node, 0), times(nine(poses, node, 3), arm))


@part
def _stretched(nodes: IntArray, springs: Array, poses: Array, k: int) -> tuple[float, Vector]:
    """Length of spring k, and the direction from its first point to the second."""
    second = _end(poses, nodes[k, 1], vector(springs, k, 3))
    apart = minus(second, _end(poses, nodes[k, 0], vector(springs, k, 0)))
    length = np.sqrt(dot(apart, apart))
    return length, scaled(1.0 / length if length.real > 1e-300 else 1e300, apart)


@part
def _line_row(nodes: IntArray, springs: Array, poses: Array, k: int, side: int, direction: Vector) -> Twist:
    """Rate of the length of spring k over the twist of one of its nodes; zero for the ground."""
    if nodes[k, side] < 0:
        return scaled(0.0, direction), scaled(0.0, direction)
    local = scaled(2.0 * side - 1.0, turned(nine(poses, nodes[k, side], 3), direction))
    return local, cross(vector(springs, k, 3 * side), local)


@part
def _tension(
    nodes: IntArray, springs: Array, poses: Array, twist: Array, k: int
) -> tuple[float, float, Vector, Twist, Twist]:
    """Tension and length of spring k, its direction, and the rate of its length over the twists of both nodes."""
    length, direction = _stretched(nodes, springs, poses, k)
    inner = _line_row(nodes, springs, poses, k, 0, direction)
    outer = _line_row(nodes, springs, poses, k, 1, direction)
    rate = rate_along(inner, twist, nodes[k, 0]) + rate_along(outer, twist, nodes[k, 1])
    tension = springs[k, 6] * (length - springs[k, 8]) + springs[k, 7] * rate
    return tension, length, direction, inner, outer


@part
def _pull(nodes: IntArray, springs: Array, poses: Array, twist: Array, force: Array) -> None:
    """Add tensions to ``force``."""
    for k in range(len(nodes)):
        tension, _, _, inner, outer = _tension(nodes, springs, poses, twist, k)
        push(force, nodes[k, 0], tension, inner)
        push(force, nodes[k, 1], tension, outer)


@part
def _line_derivatives(
    nodes: IntArray, springs: Array, poses: Array, twist: Array, line: Array, k: int, block: Array, material: int
) -> None:
    """Damping and stiffness of spring k into a block of zeros; ``line`` (12,) is memory."""
    tension, length, direction, inner, outer = _tension(nodes, springs, poses, twist, k)
    outer_product(block, line, inner, outer, springs[k, 6], springs[k, 7], 0.0)
    if material:
        return
    for j in range(12):
        side = j // 6
        if nodes[k, side] < 0:
            continue
        x, y = unit(j % 6), unit(j % 6 - 3)
        sign, turn, arm = 2.0 * side - 1.0, nine(poses, nodes[k, side], 3), vector(springs, k, 3 * side)
        spread = scaled(sign, times(turn, plus(x, cross(y, arm))))  # of the distance, in the world's axes
        swing = scaled(1.0 / length, minus(spread, scaled(dot(direction, spread), direction)))
        for end in range(2):
            node = nodes[k, end]
            if node < 0:
                continue
            back, lever = nine(poses, node, 3), vector(springs, k, 3 * end)
            change = turned(back, swing)
            if end == side:
                change = plus(change, cross(turned(back, direction), y))
            change = scaled(tension * (2.0 * end - 1.0), change)
            moment = cross(lever, change)
            for i in range(3):
                block[2, 6 * end + i, j] += change[i]
                block[2, 6 * end + 3 + i, j] += moment[i]


@part
def _line_energy(nodes: IntArray, springs: Array, poses: Array) -> float:
    """Of all springs."""
    total = 0.0
    for k in range(len(nodes)):
        length, _ = _stretched(nodes, springs, poses, k)
        total += 0.5 * springs[k, 6] * (length - springs[k, 8]) ** 2
    return total


@part
def _axes(poses: Array, node: int, frames: Array, k: int, at: int) -> Rotation:
    """Axes of a torsion spring in the world."""
    if node < 0:
        return nine(frames, k, at)
    return product(nine(poses, node, 3), nine(frames, k, at))


@part
def _wind(nodes: IntArray, frames: Array, poses: Array, before: Array, out: Array) -> None:
    """ψ of all torsion springs near those in ``before`` into ``out``."""
    for k in range(len(nodes)):
        turn = back_product(_axes(poses, nodes[k, 0], frames, k, 0), _axes(poses, nodes[k, 1], frames, k, 9))
        out[k, 0], out[k, 1], out[k, 2] = logarithm_near(turn, vector(before, k, 0))


@part
def _winding(
    nodes: IntArray, frames: Array, laws: Array, poses: Array, wound: Array, twist: Array, k: int
) -> tuple[float, Rotation, Vector, Twist, Twist]:
    """Moment of torsion spring k, turn of its second frame in the first, w, and the rate of the angle over the twists
    of both nodes.
    """
    turn = back_product(_axes(poses, nodes[k, 0], frames, k, 0), _axes(poses, nodes[k, 1], frames, k, 9))
    psi, axis = vector(wound, k, 0), vector(laws, k, 0)
    w = value(-0.5, inverse_coefficient(dot(psi, psi))[0], psi, axis)
    none = scaled(0.0, w)
    first_w, second_w = scaled(-1.0, times(nine(frames, k, 0), times(turn, w))), times(nine(frames, k, 9), w)
    inner, outer = (none, first_w if nodes[k, 0] >= 0 else none), (none, second_w if nodes[k, 1] >= 0 else none)
    rate = rate_along(inner, twist, nodes[k, 0]) + rate_along(outer, twist, nodes[k, 1])
    return laws[k, 3] * (dot(axis, psi) - laws[k, 5]) + laws[k, 4] * rate, turn, w, inner, outer


@part
def _twist_back(
    nodes: IntArray, frames: Array, laws: Array, poses: Array, wound: Array, twist: Array, force: Array
) -> None:
    """Add moments of torsion springs to ``force``."""
    for k in range(len(nodes)):
        moment, _, _, inner, outer = _winding(nodes, frames, laws, poses, wound, twist, k)
        push(force, nodes[k, 0], moment, inner)
        push(force, nodes[k, 1], moment, outer)


@part
def _turn_derivatives(model: Model, work: Work, k: int, block: Array, material: int) -> None:
    """Damping and stiffness of torsion spring k into a block of zeros."""
    nodes, frames, laws = model.winding_nodes, model.winding_frames, model.windings
    moment, turn, w, inner, outer = _winding(nodes, frames, laws, work.poses, work.wound, work.twist, k)
    outer_product(block, work.rows[0], inner, outer, laws[k, 3], laws[k, 4], 0.0)
    if material:
        return
    first_axes, second_axes = nine(frames, k, 0), nine(frames, k, 9)
    psi, axis = vector(work.wound, k, 0), vector(laws, k, 0)
    b = inverse_coefficient(dot(psi, psi))
    for j in range(3):
        for side in range(2):
            if nodes[k, side] < 0:
                continue
            turning = turned(second_axes, unit(j))  # of the second frame against the first, in its axes
            if side == 0:
                turning = scaled(-1.0, turned(turn, turned(first_axes, unit(j))))
            change = first(-0.5, 0.0, b[0], b[1], psi, value(0.5, b[0], psi, turning), axis)
            on_second = scaled(moment, times(second_axes, change))
            on_first = scaled(-moment, times(first_axes, times(turn, minus(change, cross(w, turning)))))
            for i in range(3):
                if nodes[k, 0] >= 0:
                    block[2, 3 + i, 6 * side + 3 + j] += on_first[i]
                if nodes[k, 1] >= 0:
                    block[2, 9 + i, 6 * side + 3 + j] += on_second[i]


@part
def _turn_energy(laws: Array, wound: Array) -> float:
    """Of all torsion springs."""
    total = 0.0
    for k in range(len(laws)):
        turned_by = dot(vector(laws, k, 0), vector(wound, k, 0)) - laws[k, 5]
        total += 0.5 * laws[k, 3] * turned_by * turned_by
    return total


@kernel(FORCES, counted=False)
def spring_forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Add tensions and moments to the force in `Work`, which gets turns of torsion springs near those of ``last``."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    nodes, frames, wound = model.winding_nodes, model.winding_frames, read_state(last, integers, known.state).wound
    _pull(model.spring_nodes, model.springs, work.poses, work.twist, work.force)
    _wind(nodes, frames, work.poses, wound, work.wound)
    _twist_back(nodes, frames, model.windings, work.poses, work.wound, work.twist, work.force)


@kernel(REMEMBER, counted=False)
def wind_springs(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Turns of torsion springs at the poses of `Work`, near those of ``last``."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    wound = read_state(last, integers, known.state).wound
    _wind(model.winding_nodes, model.winding_frames, work.poses, wound, work.wound)


@kernel(BLOCKS, counted=False)
def spring_derivatives(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Damping and stiffness of all springs, the last elements, into `Work.blocks`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    nodes, laws, windings = model.spring_nodes, model.springs, len(model.winding_nodes)
    first = len(model.pairs) - len(model.joint_nodes) - windings
    for k in range(len(nodes)):
        block = work.blocks[first - len(nodes) + k]
        _line_derivatives(nodes, laws, work.poses, work.twist, work.rows[0], k, block, material)
    for k in range(windings):
        _turn_derivatives(model, work, k, work.blocks[first + k], material)


@kernel(ENERGIES, counted=False)
def spring_energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Energy of all springs."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    out[3] = _line_energy(model.spring_nodes, model.springs, work.poses) + _turn_energy(model.windings, work.wound)
