"""Sections at the ends of beam elements: their frames, what carries twists and wrenches between them and nodes."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.contract import Model
from erls.maths.jit import part
from erls.maths.motions import transformed, transposed
from erls.maths.vectors import Rotation, Twist, Vector, nine, plus, product, times, unit, vector

NONE = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@part
def section(model: Model, poses: Array, e: int, side: int) -> tuple[Vector, Rotation]:
    """Frame of the section at an end in the world."""
    node = model.beam_nodes[e, side]
    turn = nine(poses, node, 3)
    place = plus(vector(poses, node, 0), times(turn, vector(model.beam_frames, e, 12 * side)))
    return place, product(turn, nine(model.beam_frames, e, 12 * side + 3))


@part
def inward(model: Model, e: int, side: int, force: Twist) -> Twist:
    """Wrench on a section as one on its node."""
    frames = model.beam_frames
    return transposed(vector(frames, e, 12 * side), nine(frames, e, 12 * side + 3), force[0], force[1])


@part
def outward(model: Model, e: int, side: int, table: Array) -> Twist:
    """Twist of a section from those of the nodes."""
    at, frames = 6 * model.beam_nodes[e, side], model.beam_frames
    v, w = (table[at], table[at + 1], table[at + 2]), (table[at + 3], table[at + 4], table[at + 5])
    return transformed(vector(frames, e, 12 * side), nine(frames, e, 12 * side + 3), v, w)


@part
def unit_twist(model: Model, e: int, j: int) -> tuple[Twist, Twist]:
    """Twists of both sections when coordinate j of the nodes moves alone."""
    side = j // 6
    frames = model.beam_frames
    moved = transformed(vector(frames, e, 12 * side), nine(frames, e, 12 * side + 3), unit(j % 6), unit(j % 6 - 3))
    if side == 0:
        return moved, NONE
    return NONE, moved
