"""Derivatives of the forces of shells, `erls.equations.nodal.shell_forces`, by a complex step of their own source.

The material tangent takes steps of the strains, ∑ Bᵀ C B; the full one steps of the forces, with all that turns.
Neither strains nor forces, each in its own frame, change where all four nodes move rigidly: that gives what the last
one's coordinates do from those of the others, and saves a quarter of the steps.
"""

from __future__ import annotations

from typing import Any

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import BLOCKS, Model, Work, read_layout, read_model, read_work
from erls.equations.nodal.shell import PAIRS
from erls.equations.nodal.shell_forces import Frame, Frames, corners, inward, strains_at, wrenches
from erls.maths.jit import kernel, part
from erls.maths.motions import transformed
from erls.maths.vectors import (
    Twist,
    Vector,
    back_product,
    cross,
    minus,
    nine,
    plus,
    scaled,
    times,
    turned,
    unit,
    vector,
)

STEP = 1e-30
"""Complex steps: the square of one is nothing beside any number."""


@part
def _ahead(frame: Frame, way: Twist, size: Any) -> Any:
    """A frame that moves by a twist of its own times a complex number."""
    place, r = frame
    moved = scaled(size, times(r, way[0]))
    w = scaled(size, way[1])
    first, second, third = (r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8])  # rows x of R, x × w of R w̃
    a, b, c = plus(first, cross(first, w)), plus(second, cross(second, w)), plus(third, cross(third, w))
    return plus(place, moved), (a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])


@part
def _way(model: Model, e: int, k: int, j: int) -> Twist:
    """Twist of the frame of corner k as coordinate j of all nodes moves alone."""
    inside = j // 6 == k
    v, w = unit(j % 6 if inside else 3), unit(j % 6 - 3 if inside else 3)
    return transformed(vector(model.shell_frames, e, 12 * k), nine(model.shell_frames, e, 12 * k + 3), v, w)


@part
def _stepped(model: Model, e: int, frames: Frames, j: int) -> Any:
    size = 1j * STEP
    a, b, c, d = frames
    return (
        _ahead(a, _way(model, e, 0, j), size), _ahead(b, _way(model, e, 1, j), size),
        _ahead(c, _way(model, e, 2, j), size), _ahead(d, _way(model, e, 3, j), size),
    )  # fmt: skip


@part
def _complete(out: Array, count: int, model: Model, work: Work, e: int) -> None:
    """The last six of 24 columns from the others: any rigid motion of all nodes adds up to nothing."""
    node = model.shell_nodes[e, 3]
    for j in range(6):
        for i in range(count):
            out[i, 18 + j] = 0.0 * out[i, 0]
    for k in range(3):
        other = model.shell_nodes[e, k]
        back = nine(work.poses, other, 3)
        turn = back_product(back, nine(work.poses, node, 3))
        arm = turned(back, minus(vector(work.poses, node, 0), vector(work.poses, other, 0)))
        for j in range(6):
            w = times(turn, unit(j - 3))
            v = plus(times(turn, unit(j)), cross(arm, w))
            for i in range(count):
                row = out[i, 6 * k] * v[0] + out[i, 6 * k + 1] * v[1] + out[i, 6 * k + 2] * v[2]
                row += out[i, 6 * k + 3] * w[0] + out[i, 6 * k + 4] * w[1] + out[i, 6 * k + 5] * w[2]
                out[i, 18 + j] -= row


@part
def _imaginary(a: Any) -> Vector:
    return a[0].imag / STEP, a[1].imag / STEP, a[2].imag / STEP


@part
def _full(model: Model, work: Work, e: int, frames: Frames) -> None:
    """(24, 24) derivatives of the forces on the nodes."""
    out = work.corners
    for j in range(18):
        found = wrenches(model, e, _stepped(model, e, frames, j))
        for k in range(4):
            n, m = inward(model, e, k, (_imaginary(found[k][0]), _imaginary(found[k][1])))
            for i in range(3):
                out[6 * k + i, j], out[6 * k + 3 + i, j] = n[i], m[i]
    _complete(out, 24, model, work, e)


@part
def _material(model: Model, work: Work, e: int, frames: Frames) -> None:
    """(24, 24) without the change of the directions of forces."""
    out, rows, c = work.corners, work.strained, model.shell_stiffness
    for i in range(24):
        for j in range(24):
            out[i, j] = 0.0
    for point in range(4):
        for j in range(18):
            x = strains_at(model, e, _stepped(model, e, frames, j), point)
            rows[0, j], rows[1, j], rows[2, j] = x[0].imag / STEP, x[1].imag / STEP, x[2].imag / STEP
            rows[3, j], rows[4, j], rows[5, j] = x[3].imag / STEP, x[4].imag / STEP, x[5].imag / STEP
            rows[6, j], rows[7, j], rows[8, j] = x[6].imag / STEP, x[7].imag / STEP, x[8].imag / STEP
        _complete(rows, 9, model, work, e)
        for j in range(24):
            for p in range(9):
                stress = 0.0 * rows[0, j]
                for q in range(9):
                    stress += c[e, p, q] * rows[q, j]
                stress *= model.shell_areas[e, point]
                for i in range(24):
                    out[i, j] += rows[p, i] * stress


@kernel(BLOCKS, counted=False)
def shell_derivatives(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Stiffness of all shells into `Work.blocks`, by pairs of corners: a corner's own block in thirds."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    first = len(model.beam_nodes) + len(model.body_nodes) + len(model.load_nodes)
    first += len(model.actuator_nodes) + len(model.contact_nodes)
    for e in range(len(model.shell_nodes)):
        frames = corners(model, work.poses, e)
        if material == 1:
            _material(model, work, e, frames)
        else:
            _full(model, work, e, frames)
        for k in range(6):
            block = work.blocks[first + 6 * e + k, 2]
            for side in range(2):
                for other in range(2):
                    share = 1.0 / 3.0 if side == other else 1.0
                    row, column = 6 * PAIRS[k][side], 6 * PAIRS[k][other]
                    for i in range(6):
                        for j in range(6):
                            block[6 * side + i, 6 * other + j] = share * work.corners[row + i, column + j]
