"""The scaled iteration matrix of a nodal system as a band, with the scales of `erls.maths.saddle`."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.blocks import blocks, weighted
from erls.equations.nodal.contract import FACTOR, Model, Work
from erls.maths import band
from erls.maths.jit import kernel, part
from erls.maths.vectors import Rotation, nine, times

_ONE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@part
def _enter(band: Array, place: IntArray, row: int, column: int, entry: float) -> None:
    width = (band.shape[1] - 1) // 3
    band[place[row], place[column] - place[row] + width] += entry


@part
def _add_element(band: Array, place: IntArray, pairs: IntArray, e: int, whole: Array) -> None:
    """Enter the weighted sum of element e between two nodes, of which the ground has no share."""
    for side in range(2):
        for other in range(2):
            row, column = 6 * pairs[e, side], 6 * pairs[e, other]
            if row < 0 or column < 0:
                continue
            for i in range(6):
                for j in range(6):
                    _enter(band, place, row + i, column + j, whole[6 * side + i, 6 * other + j])


@part
def _add_condition(
    band: Array, place: IntArray, column: int, at: int, turn: Rotation, gradient: Array, of_q: Array
) -> None:
    """A node's share, its velocities from ``at`` on, of row B T and column Bᵀ of a condition."""
    linear = times(turn, (gradient[0], gradient[1], gradient[2]))
    for i in range(6):
        entry = linear[i] if i < 3 else gradient[i]
        _enter(band, place, at + i, column, entry)
        total = 0.0 * entry
        for k in range(6):
            total += gradient[k] * of_q[k, i]
        _enter(band, place, column, at + i, total)


@part
def _largest(turn: Rotation, gradient: Array, metres: Array, at: int) -> float:
    """Largest derivative of a condition by a displacement of a node."""
    linear = times(turn, (gradient[0], gradient[1], gradient[2]))
    size = 0.0
    for i in range(6):
        size = max(size, abs(linear[i] if i < 3 else gradient[i]) / metres[at + i])
    return size


@part
def _scale(
    band: Array, order: IntArray, inertia: Array, metres: Array, period: float, left: Array, right: Array
) -> None:
    """Units of `erls.maths.saddle`: metres, and newtons per mass."""
    n = len(metres)
    mass = 0.0
    for i in range(n):
        mass = max(mass, inertia[i] / metres[i] ** 2)
    force = period**2 / (mass if mass > 0.0 else 1.0)
    for i in range(n):
        left[i], right[i] = force / metres[i], 1.0 / metres[i]
    for i in range(n, len(order)):
        right[i] = left[i] / force
    width, size = (band.shape[1] - 1) // 3, len(band)
    for i in range(size):
        scale = left[order[i]]
        for j in range(max(0, i - width), min(size, i + width + 1)):
            band[i, j - i + width] *= scale * right[order[j]]


@kernel(FACTOR, counted=False)
def iteration_matrix(model: Model, work: Work, sample: Array, to_a: float, to_v: float, period: float) -> int:
    """Factor [[β' M + γ' C + K T, Bᵀ], [B T, 0]]; 0, or 1 + the number of the unknown that is to blame.

    ``work`` holds the state with `forces` evaluated.
    """
    table = work.band
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            table[i, j] = 0.0
    for i in range(len(work.force)):
        work.inertia[i] = 0.0
    blocks(model, work, sample, 0)
    weighted(model, work, to_a, to_v, 1.0)
    for e in range(len(model.pairs)):
        _add_element(table, model.place, model.pairs, e, work.whole[e])
        for side in range(2):
            node = model.pairs[e, side]
            if node >= 0:
                for i in range(6):
                    work.inertia[6 * node + i] += work.blocks[e, 0, 6 * side + i, 6 * side + i]
    if not model.local:
        for node in range(len(work.poses)):
            for i in range(3):
                for j in range(3):
                    _enter(table, model.place, 6 * node + i, 6 * node + 3 + j, work.turning[node, i, j])
    for j in range(len(model.joint_nodes)):
        for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
            size = 0.0
            for side in range(2):
                node = model.joint_nodes[j, side]
                if node < 0:
                    continue
                turn, gradient = _ONE, work.gradient[row, 6 * side : 6 * side + 6]
                if not model.local:
                    turn = nine(work.poses, node, 3)
                size = max(size, _largest(turn, gradient, model.metres, 6 * node))
                place = model.place
                _add_condition(table, place, len(work.force) + row, 6 * node, turn, gradient, work.factors[node, 2])
            # so that the largest derivative by a displacement is one
            work.left[len(work.force) + row] = 1.0 / size if size > 0.0 else 1.0
    _scale(table, model.order, work.inertia, model.metres, period, work.left, work.right)
    found = band.factor(table, work.pivots)
    if found == 0:
        return 0
    for i in range(len(model.place)):
        if model.place[i] == found - 1:
            return i + 1
    return int(found)
