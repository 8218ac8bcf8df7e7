"""Joints as conditions on the pose of an outer frame relative to an inner one, D = (Q, p), and their forces.

Conditions are linear in the entries of p and Q, less what a thread advances: c · p + ⟨C, Q⟩ - h ψ(Q) = 0
(`erls.mechanism.joint_types`, `erls.maths.screws`). With the relative twist η of the outer frame, in its axes,
ṗ = Q η_v and Q̇ = Q η̃_ω. Only relative motion enters, so that a rigid motion of both frames changes nothing. Along a
prescribed coordinate s(t) the inner frame runs ahead by exp(s ξ̂), ξ along or about the joint's z axis, or both.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.contract import Model, Work
from erls.maths.coefficients import stumpff
from erls.maths.jit import part
from erls.maths.motions import (
    bracket,
    cobracket,
    pair_minus,
    pair_plus,
    pair_scaled,
    transformed,
    transposed,
)
from erls.maths.rotations import exponential
from erls.maths.screws import off_thread, turn_gradient, turn_gradient_change
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
    three,
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


@part
def _ahead(model: Model, j: int, coordinate: float) -> tuple[Vector, Rotation]:
    """Frame of the inner node that runs ahead by a prescribed coordinate."""
    p, r = vector(model.joint_frames, j, 0), nine(model.joint_frames, j, 3)
    along, about = model.joint_drives[j, 0], model.joint_drives[j, 1]
    if along.real == 0.0 and about.real == 0.0:
        return p, r
    slide, turn = along * coordinate, about * coordinate
    psi = (0.0, 0.0, turn)
    c = stumpff(turn * turn)
    return plus(p, times(r, (0.0, 0.0, slide))), product(r, exponential(psi, c[0], c[1]))


@part
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


@part
def _along(model: Model, row: int, turn: Rotation) -> Twist:
    """Derivative of a condition along the relative twist."""
    pull = turned(turn, vector(model.conditions, row, 0))
    about = axial(back_product(turn, nine(model.conditions, row, 3)))
    if model.pitches[row].real != 0.0:
        about = minus(about, scaled(model.pitches[row], turn_gradient(turn)))
    return pull, about


@part
def _violation(model: Model, row: int, place: Vector, turn: Rotation) -> float:
    violation = _linear(model.conditions, row, place, turn)
    if model.pitches[row].real != 0.0:
        violation = off_thread(violation, model.pitches[row], turn)
    return violation


@part
def _linear(conditions: Array, row: int, place: Vector, turn: Rotation) -> float:
    violation: float = dot(vector(conditions, row, 0), place)
    entries = nine(conditions, row, 3)
    for k in range(9):
        violation += entries[k] * turn[k]
    return violation


@part
def joint_forces(model: Model, work: Work, sample: Array) -> None:
    """Violations of all conditions, and the forces Bᵀλ in node axes, added to ``work.reaction``."""
    for j in range(len(model.joint_nodes)):
        place, turn, reach, axes = _posed(model, work.poses, j, sample[3 * j])
        force = _ZERO, _ZERO
        for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
            if model.released[row].real != 0.0:
                work.violation[row] = 0.0
                continue
            work.violation[row] = _violation(model, row, place, turn)
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


@part
def joint_gradients(model: Model, work: Work, sample: Array, j: int) -> None:
    """Violation and gradient of each condition of joint j, and its derivatives along the motion at ``work``'s twists:
    Φ_t in ``work.drift``, Φ̈ − B a in ``work.bias`` (accelerations of the twists on R³×SO(3) included).
    """
    place, turn, reach, axes = _posed(model, work.poses, j, sample[3 * j])
    p, r = vector(model.joint_frames, j, 12), nine(model.joint_frames, j, 15)
    carried, own = _twist(model, work.twist, j, reach, axes)
    axis = (0.0, 0.0, model.joint_drives[j, 0]), (0.0, 0.0, model.joint_drives[j, 1])
    drive = pair_scaled(sample[3 * j + 1], axis)
    moved = transformed(place, turn, drive[0], drive[1])  # of the driven frame, as seen in the outer one
    inner = pair_plus(carried, moved)
    apart = pair_minus(own, inner)
    # the inner frame's twist changes as it turns ahead, and as the outer frame moves against it
    base, base_axes = _ahead(model, j, sample[3 * j])
    held = _of_node(work.twist, model.joint_nodes[j, 0], base, base_axes)
    change = pair_minus(pair_scaled(sample[3 * j + 2], axis), bracket(drive[0], drive[1], held[0], held[1]))
    change = transformed(place, turn, change[0], change[1])
    bend = pair_minus(bracket(apart[0], apart[1], inner[0], inner[1]), change)
    swing = times(turn, cross(apart[1], apart[0]))
    curve = product(product(turn, _tilde(apart[1])), _tilde(apart[1]))
    for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
        if model.released[row].real != 0.0:
            work.violation[row] = work.drift[row] = work.bias[row] = 0.0
            for i in range(12):
                work.gradient[row, i] = 0.0
            continue
        work.violation[row] = _violation(model, row, place, turn)
        along, about = _along(model, row, turn)
        n, m = transposed(reach, axes, along, about)
        end, end_moment = transposed(p, r, along, about)
        for i in range(3):
            work.gradient[row, i], work.gradient[row, 3 + i] = -n[i], -m[i]
            work.gradient[row, 6 + i], work.gradient[row, 9 + i] = end[i], end_moment[i]
        work.drift[row] = -dot(along, moved[0]) - dot(about, moved[1])
        bias = _linear(model.conditions, row, swing, curve) + dot(along, bend[0]) + dot(about, bend[1])
        if model.pitches[row].real != 0.0:
            bias -= model.pitches[row] * dot(turn_gradient_change(turn, apart[1]), apart[1])
        work.bias[row] = bias


@part
def _tilde(a: Vector) -> Rotation:
    return 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0


@part
def _of_node(values: Array, node: int, p: Vector, r: Rotation) -> Twist:
    """Twist of a frame of a node; the ground rests."""
    if node < 0:
        return (0.0 * p[0], 0.0 * p[0], 0.0 * p[0]), (0.0 * p[0], 0.0 * p[0], 0.0 * p[0])
    return transformed(p, r, three(values, 6 * node), three(values, 6 * node + 3))


@part
def _twist(model: Model, values: Array, j: int, reach: Vector, axes: Rotation) -> tuple[Twist, Twist]:
    """Twists of the outer frame as carried by the inner node, and by its own."""
    frames = model.joint_frames
    own = _of_node(values, model.joint_nodes[j, 1], vector(frames, j, 12), nine(frames, j, 15))
    return _of_node(values, model.joint_nodes[j, 0], reach, axes), own


@part
def joint_stiffness(model: Model, work: Work, sample: Array, j: int, block: Array) -> None:
    """Derivative of Bᵀλ of joint j by increments of both nodes into a block of zeros."""
    _, turn, reach, axes = _posed(model, work.poses, j, sample[3 * j])
    p, r = vector(model.joint_frames, j, 12), nine(model.joint_frames, j, 15)
    pull, entries, thread = _ZERO, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0
    for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
        if model.released[row].real != 0.0:
            continue
        strength = work.multipliers[row]
        pull = plus(pull, scaled(strength, vector(model.conditions, row, 0)))
        thread += strength * model.pitches[row]
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
    if thread.real != 0.0:
        moment = minus(moment, scaled(thread, turn_gradient(turn)))
    for k in range(12):
        a, b = unit(k % 6), unit(k % 6 - 3)
        if k < 6:
            v, w = transformed(reach, axes, a, b)
            v, w = scaled(-1.0, v), scaled(-1.0, w)
        else:
            v, w = transformed(p, r, a, b)
        pushed = cross(force, w), minus(times(spread, w), scaled(trace, w))
        if thread.real != 0.0:
            pushed = pushed[0], minus(pushed[1], scaled(thread, turn_gradient_change(turn, w)))
        # the inner node's share of the wrench turns with the relative pose
        inner = pair_minus(cobracket(v, w, force, moment), pushed)
        n, m = transposed(reach, axes, inner[0], inner[1])
        end, end_moment = transposed(p, r, pushed[0], pushed[1])
        for i in range(3):
            block[2, i, k], block[2, 3 + i, k] = n[i], m[i]
            block[2, 6 + i, k], block[2, 9 + i, k] = end[i], end_moment[i]
