"""Conditions of joints, their forces and derivatives: the formulas of `erls.equations.nodal.joints`."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.kernels.contract import Model, Work
from erls.maths.coefficients import stumpff
from erls.maths.jit import inlined, part
from erls.maths.motions import cobracket, pair_minus, transformed, transposed
from erls.maths.rotations import exponential
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    add,
    axial,
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

_ZERO = (0.0, 0.0, 0.0)


@part
def frame_in_world(poses: Array, node: int, frames: Array, row: int, at: int) -> tuple[Vector, Rotation]:
    """A frame of a node, or of the ground where the node is negative."""
    place, turn = vector(frames, row, at), nine(frames, row, at + 3)
    if node < 0:
        return place, turn
    own = nine(poses, node, 3)
    return plus(vector(poses, node, 0), times(own, place)), product(own, turn)


@part
def relative(
    p: Vector, r: Rotation, place: Vector, turn: Rotation
) -> tuple[Vector, Rotation]:
    """Pose of the second frame in the first."""
    return turned(r, minus(place, p)), back_product(r, turn)


@inlined
def _ahead(model: Model, j: int, coordinate: float) -> tuple[Vector, Rotation]:
    """Frame of the inner node that runs ahead by a prescribed coordinate."""
    p, r = vector(model.joint_frames, j, 0), nine(model.joint_frames, j, 3)
    if model.joint_driven[j] < 0:
        return p, r
    s = model.joint_sign[j] * coordinate
    if model.joint_driven[j] == 2:
        return plus(p, times(r, (0.0, 0.0, s))), r
    psi = (0.0, 0.0, s)
    c = stumpff(s * s)
    return p, product(r, exponential(psi, c[0], c[1]))


@inlined
def _posed(model: Model, poses: Array, j: int, coordinate: float) -> tuple[Vector, Rotation, Vector, Rotation]:
    """Pose D of the outer frame in the inner one, and that of the outer frame in the inner node."""
    inner, outer = model.joint_nodes[j, 0], model.joint_nodes[j, 1]
    p, r = _ahead(model, j, coordinate)
    base, axes = p, r
    if inner >= 0:
        own = nine(poses, inner, 3)
        base, axes = plus(vector(poses, inner, 0), times(own, p)), product(own, r)
    end, end_turn = frame_in_world(poses, outer, model.joint_frames, j, 12)
    place, turn = relative(base, axes, end, end_turn)
    return place, turn, plus(p, times(r, place)), product(r, turn)


@inlined
def _along(model: Model, row: int, turn: Rotation) -> Twist:
    """Derivative of a condition along the relative twist."""
    pull = turned(turn, vector(model.conditions, row, 0))
    return pull, axial(back_product(turn, nine(model.conditions, row, 3)))


@inlined
def joint_forces(model: Model, work: Work, sample: Array) -> None:
    """Violations of all conditions, and the forces Bᵀλ in node axes, added to ``work.reaction``."""
    for j in range(len(model.joint_nodes)):
        place, turn, reach, axes = _posed(model, work.poses, j, sample[j])
        force = _ZERO, _ZERO
        for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
            c, entries = vector(model.conditions, row, 0), nine(model.conditions, row, 3)
            violation = dot(c, place)
            for k in range(9):
                violation += entries[k] * turn[k]
            work.violation[row] = violation
            along, about = _along(model, row, turn)
            strength = work.multipliers[row]
            force = plus(force[0], scaled(strength, along)), plus(force[1], scaled(strength, about))
        inner, outer = model.joint_nodes[j, 0], model.joint_nodes[j, 1]
        if inner >= 0:
            n, m = transposed(reach, axes, force[0], force[1])
            add(work.reaction, 6 * inner, scaled(-1.0, n))
            add(work.reaction, 6 * inner + 3, scaled(-1.0, m))
        if outer >= 0:
            frames = model.joint_frames
            n, m = transposed(vector(frames, j, 12), nine(frames, j, 15), force[0], force[1])
            add(work.reaction, 6 * outer, n)
            add(work.reaction, 6 * outer + 3, m)


@inlined
def joint_derivatives(model: Model, work: Work, sample: Array, j: int) -> None:
    """Gradients of the joint's conditions in ``work.gradient``, stiffness of Bᵀλ in ``work.stiffness``."""
    _, turn, reach, axes = _posed(model, work.poses, j, sample[j])
    p, r = vector(model.joint_frames, j, 12), nine(model.joint_frames, j, 15)
    pull, entries = _ZERO, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
        along, about = _along(model, row, turn)
        n, m = transposed(reach, axes, along, about)
        end, end_moment = transposed(p, r, along, about)
        for i in range(3):
            work.gradient[row, i], work.gradient[row, 3 + i] = -n[i], -m[i]
            work.gradient[row, 6 + i], work.gradient[row, 9 + i] = end[i], end_moment[i]
        strength = work.multipliers[row]
        pull = plus(pull, scaled(strength, vector(model.conditions, row, 0)))
        c = nine(model.conditions, row, 3)
        entries = (
            entries[0] + strength * c[0],
            entries[1] + strength * c[1],
            entries[2] + strength * c[2],
            entries[3] + strength * c[3],
            entries[4] + strength * c[4],
            entries[5] + strength * c[5],
            entries[6] + strength * c[6],
            entries[7] + strength * c[7],
            entries[8] + strength * c[8],
        )
    force, spread = turned(turn, pull), back_product(turn, entries)
    trace = spread[0] + spread[4] + spread[8]
    moment = axial(spread)
    for k in range(12):
        a, b = unit(k % 6), unit(k % 6 - 3)
        if k < 6:
            v, w = transformed(reach, axes, a, b)
            v, w = scaled(-1.0, v), scaled(-1.0, w)
        else:
            v, w = transformed(p, r, a, b)
        pushed = cross(force, w), minus(times(spread, w), scaled(trace, w))
        # the inner node's share of the wrench turns with the relative pose
        inner = pair_minus(cobracket(v, w, force, moment), pushed)
        n, m = transposed(reach, axes, inner[0], inner[1])
        end, end_moment = transposed(p, r, pushed[0], pushed[1])
        for i in range(3):
            work.stiffness[i, k], work.stiffness[3 + i, k] = n[i], m[i]
            work.stiffness[6 + i, k], work.stiffness[9 + i, k] = end[i], end_moment[i]
            for row in range(i, 12, 3):
                work.mass[row, k] = work.damping[row, k] = 0.0

