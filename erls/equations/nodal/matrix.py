"""The scaled iteration matrix of a nodal system as a band or in fronts, with the scales of `erls.maths.saddle`;
functions of `erls.equations.stepped`.

Either way entries of a few neighbouring rows and columns lie in rows at equal distances: `_spot` tells where.
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    Factors,
    Model,
    Work,
    call_blocks,
    call_weighted,
    read_factors,
    read_layout,
    read_model,
    read_work,
)
from erls.maths import band, fronts
from erls.maths.jit import kernel, part
from erls.maths.vectors import Rotation, nine, times
from erls.maths.views import matrix_at

_ONE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@part
def _spot(model: Model, row: int, column: int) -> tuple[int, int]:
    """Where the entry of two unknowns lies, and the distance to the same column of the next row."""
    i, j, width = model.place[row], model.place[column], model.band
    if width < 0:
        at, apart = fronts.spot(model.fronts, model.later, model.front_of, i, j)
        return at, apart
    return int(i * (3 * width + 1) + j - i + width), int(3 * width)


@part
def _add_element(entries: Array, model: Model, e: int, whole: Array) -> None:
    """Enter the weighted sum of element e between two nodes, of which the ground has no share."""
    for side in range(2):
        for other in range(2):
            row, column = 6 * model.pairs[e, side], 6 * model.pairs[e, other]
            if row < 0 or column < 0:
                continue
            at, apart = _spot(model, row, column)
            for i in range(6):
                for j in range(6):
                    entries[at + i * apart + j] += whole[6 * side + i, 6 * other + j]


@part
def _add_condition(
    entries: Array, model: Model, column: int, at: int, turn: Rotation, gradient: Array, of_q: Array, beta: float
) -> None:
    """A node's share, its velocities from ``at`` on, of row B T and column Bᵀ of a condition; ``of_q`` is β T."""
    linear = times(turn, (gradient[0], gradient[1], gradient[2]))
    down, apart = _spot(model, at, column)
    along, _ = _spot(model, column, at)
    for i in range(6):
        entry = linear[i] if i < 3 else gradient[i]
        entries[down + i * apart] += entry
        total = 0.0 * entry
        for k in range(6):
            total += gradient[k] * of_q[k, i]
        entries[along + i] += total / beta


@part
def _largest(turn: Rotation, gradient: Array, metres: Array, at: int) -> float:
    """Largest derivative of a condition by a displacement of a node."""
    linear = times(turn, (gradient[0], gradient[1], gradient[2]))
    size = 0.0
    for i in range(6):
        size = max(size, abs(linear[i] if i < 3 else gradient[i]) / metres[at + i])
    return size


@part
def _units(inertia: Array, metres: Array, left: Array, right: Array) -> None:
    """Of `erls.maths.saddle`: metres, and newtons per mass."""
    n = len(metres)
    mass = 0.0
    for i in range(n):
        mass = max(mass, inertia[i] / metres[i] ** 2)
    force = 1.0 / (mass if mass > 0.0 else 1.0)
    for i in range(n):
        left[i], right[i] = force / metres[i], 1.0 / metres[i]
    for i in range(n, len(left)):
        right[i] = left[i] / force


@part
def _scale(entries: Array, model: Model, left: Array, right: Array) -> None:
    order, width, size = model.order, model.band, len(model.order)
    if width < 0:
        for f in range(len(model.fronts)):
            fronts.scale(entries, model.fronts, model.later, f, order, left, right)
        return
    table = matrix_at(entries, 0, size, 3 * width + 1)
    for i in range(size):
        scale = left[order[i]]
        for j in range(max(0, i - width), min(size, i + width + 1)):
            table[i, j - i + width] *= scale * right[order[j]]


@part
def _factor(model: Model, room: Factors) -> int:
    if model.band < 0:
        found = fronts.factor(room.entries, model.fronts, model.into, room.stack, room.pivots)
    else:
        found = band.factor(matrix_at(room.entries, 0, len(model.order), 3 * model.band + 1), room.pivots)
    return int(found)


@part
def _add_joints(model: Model, work: Work, beta: float, entries: Array, left: Array) -> None:
    """Rows and columns of all conditions, and their scales."""
    n = len(work.force)
    for j in range(len(model.joint_nodes)):
        for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
            size = 0.0
            if model.released[row].real != 0.0:  # its multiplier does not change
                entries[_spot(model, n + row, n + row)[0]] += 1.0
            for side in range(2):
                node = model.joint_nodes[j, side]
                if node < 0:
                    continue
                turn, gradient = _ONE, work.gradient[row, 6 * side : 6 * side + 6]
                if not model.local:
                    turn = nine(work.poses, node, 3)
                size = max(size, _largest(turn, gradient, model.metres, 6 * node))
                _add_condition(entries, model, n + row, 6 * node, turn, gradient, work.factors[node, 2], beta)
            # so that the largest derivative by a displacement is one
            left[n + row] = 1.0 / size if size > 0.0 else 1.0


@part
def factored(reals: Array, integers: IntArray, scratch: Array, alpha: float, beta: float, factors: Array) -> int:
    """Factors of [[M + α C + β K T, Bᵀ], [B T, 0]] from the blocks of a state; 0, or 1 + the number of an unknown."""
    own = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, own.model), read_work(scratch, integers, own.work)
    room = read_factors(factors, integers, own.factors)
    n = len(work.force)
    for i in range(len(room.entries)):
        room.entries[i] = 0.0
    for i in range(n):
        work.inertia[i] = 0.0
    call_weighted(own.weighted, reals, integers, scratch, 1.0, alpha, beta)
    for e in range(len(model.pairs)):
        _add_element(room.entries, model, e, work.whole[e])
        for side in range(2):
            node = model.pairs[e, side]
            if node >= 0:
                for i in range(6):
                    work.inertia[6 * node + i] += work.blocks[e, 0, 6 * side + i, 6 * side + i]
    if not model.local:
        for node in range(len(work.poses)):
            at, apart = _spot(model, 6 * node, 6 * node + 3)
            for i in range(3):
                for j in range(3):
                    room.entries[at + i * apart + j] += work.turning[node, i, j]
    _add_joints(model, work, beta, room.entries, room.left)
    _units(work.inertia, model.metres, room.left, room.right)
    _scale(room.entries, model, room.left, room.right)
    for k in range(len(room.gap)):
        room.force[k], room.gap[k] = 1.0 / room.right[n + k], room.left[n + k]
    found = _factor(model, room)
    if found == 0:
        return 0
    for i in range(len(model.place)):
        if model.place[i] == found - 1:
            return i + 1
    return int(found)


@kernel(contract.FACTOR, counted=False)
def factor(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    q: Array,
    v: Array,
    alpha: float,
    beta: float,
    factors: Array,
) -> int:
    """Factor [[M + α C + β K T, Bᵀ], [B T, 0]] at the state whose residual was found last; see `stepped`."""
    own = read_layout(reals, integers, integers[len(integers) - 1])
    call_blocks(own.blocks, reals, integers, scratch, 0)
    return factored(reals, integers, scratch, alpha, beta, factors)


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """Replace [b; Φ] by [x; β λ]."""
    own = read_layout(reals, integers, integers[len(integers) - 1])
    model, room = read_model(reals, integers, own.model), read_factors(factors, integers, own.factors)
    order = model.order
    for i in range(len(order)):
        room.ordered[i] = room.left[order[i]] * b[order[i]]
    if model.band < 0:
        fronts.solve(room.entries, model.fronts, model.later, room.pivots, room.ordered)
    else:
        band.solve(matrix_at(room.entries, 0, len(order), 3 * model.band + 1), room.pivots, room.ordered)
    for i in range(len(order)):
        b[order[i]] = room.right[order[i]] * room.ordered[i]
