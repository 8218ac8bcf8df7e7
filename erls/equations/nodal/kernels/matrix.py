"""The scaled iteration matrix of a nodal system as a band.

The conventions are those of `erls.equations.nodal.assembly` and `erls.maths.saddle`; velocities as in
`erls.equations.nodal.kernels.system`.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.kernels.actuators import actuator_derivatives
from erls.equations.nodal.kernels.beam import beam_derivatives
from erls.equations.nodal.kernels.bodies import body_derivatives, load_derivatives
from erls.equations.nodal.kernels.contract import FACTOR, Model, Work
from erls.equations.nodal.kernels.joints import joint_derivatives
from erls.maths import band
from erls.maths.coefficients import stumpff, tangent_coefficients
from erls.maths.jit import inlined, kernel, part
from erls.maths.motions import series
from erls.maths.rotations import value
from erls.maths.vectors import (
    Vector,
    cross,
    dot,
    minus,
    nine,
    plus,
    scaled,
    three,
    times,
    turned,
    unit,
)

_ZERO = (0.0, 0.0, 0.0)
GROUND = -1


@inlined
def _node_factors(model: Model, work: Work, to_a: float, to_v: float) -> None:
    """What stands to the right of M, C and K for each node; on R³×SO(3) the chain rule over E v, E a + Ė v, Eᵀ f."""
    for node in range(len(work.poses)):
        at = 6 * node
        out = work.factors[node]
        for kind in range(3):
            for i in range(6):
                for j in range(6):
                    out[kind, i, j] = 0.0
        u, psi = three(work.increment, at), three(work.increment, at + 3)
        f, g = tangent_coefficients(stumpff(dot(psi, psi)))
        turn = nine(work.poses, node, 3)
        v, w = three(work.twist, at), three(work.twist, at + 3)
        a = plus(three(work.rate, at), cross(w, v))  # E a on R³×SO(3)
        for j in range(6):
            x, y = unit(j), unit(j - 3)
            if model.local:
                out[0, j, j], out[1, j, j] = to_a, to_v
                moved = series(f, g, u, psi, x, y)
            else:
                turning = value(f[0], g[0], psi, y)
                moved = turned(turn, x), turning
                swing = cross(v, turning)  # of E v
                mass = plus(scaled(to_a, turned(turn, x)), scaled(to_v, cross(v, y)))
                mass = minus(mass, scaled(to_v, cross(w, turned(turn, x))))
                mass = plus(mass, minus(cross(a, turning), cross(w, swing)))
                damping = plus(scaled(to_v, turned(turn, x)), swing)
                for i in range(3):
                    out[0, i, j], out[0, 3 + i, j] = mass[i], to_a * y[i]
                    out[1, i, j], out[1, 3 + i, j] = damping[i], to_v * y[i]
            for i in range(3):
                out[2, i, j], out[2, 3 + i, j] = moved[0][i], moved[1][i]
        if not model.local:
            # of Eᵀ f at fixed f: forces act in the world's axes by now
            force = turned(turn, plus(three(work.force, at), three(work.reaction, at)))
            for j in range(3):
                column = times(turn, cross(value(f[0], g[0], psi, unit(j)), force))
                for i in range(3):
                    _enter(model, work, at + i, at + 3 + j, column[i])


@inlined
def _enter(model: Model, work: Work, row: int, column: int, entry: float) -> None:
    place, width = model.place[row], (work.band.shape[1] - 1) // 3
    work.band[place, model.place[column] - place + width] += entry


@inlined
def _add_blocks(model: Model, work: Work, first: int, second: int) -> None:
    """Add M X + C Y + K Z of one element between two nodes, of which the ground has no share."""
    for row_side in range(2):
        node = first if row_side == 0 else second
        if node < 0:
            continue
        for i in range(6):
            work.inertia[6 * node + i] += work.mass[6 * row_side + i, 6 * row_side + i]
        turn = nine(work.poses, node, 3)
        for side in range(2):
            other = first if side == 0 else second
            if other < 0:
                continue
            right = work.factors[other]
            for j in range(6):
                above, below = _ZERO, _ZERO
                if model.local:
                    above = _own(work, 6 * row_side, 6 * side + j, right[0, j, j], right[1, j, j])
                    below = _own(work, 6 * row_side + 3, 6 * side + j, right[0, j, j], right[1, j, j])
                    for k in range(6):
                        share = right[2, k, j]
                        if share != 0.0:
                            above = plus(above, scaled(share, _three(work.stiffness, 6 * row_side, 6 * side + k)))
                            below = plus(below, scaled(share, _three(work.stiffness, 6 * row_side + 3, 6 * side + k)))
                else:
                    for k in range(6):
                        at = 6 * side + k
                        above = plus(above, _mixed(work, 6 * row_side, at, right, k, j))
                        below = plus(below, _mixed(work, 6 * row_side + 3, at, right, k, j))
                    above = times(turn, above)
                for i in range(3):
                    _enter(model, work, 6 * node + i, 6 * other + j, above[i])
                    _enter(model, work, 6 * node + 3 + i, 6 * other + j, below[i])


@part
def _three(table: Array, row: int, column: int) -> Vector:
    return table[row, column], table[row + 1, column], table[row + 2, column]


@inlined
def _own(work: Work, row: int, column: int, to_a: float, to_v: float) -> Vector:
    return plus(scaled(to_a, _three(work.mass, row, column)), scaled(to_v, _three(work.damping, row, column)))


@inlined
def _mixed(work: Work, row: int, column: int, right: Array, k: int, j: int) -> Vector:
    mass, damping = _three(work.mass, row, column), _three(work.damping, row, column)
    found = plus(scaled(right[0, k, j], mass), scaled(right[1, k, j], damping))
    return plus(found, scaled(right[2, k, j], _three(work.stiffness, row, column)))


@inlined
def _add_condition(model: Model, work: Work, j: int, row: int) -> None:
    """Row B T and column Bᵀ of a condition; its scale, so that the largest derivative by a displacement is one."""
    n = len(work.force)
    size = 0.0
    for side in range(2):
        node = model.joint_nodes[j, side]
        if node < 0:
            continue
        right = work.factors[node]
        linear = (
            work.gradient[row, 6 * side],
            work.gradient[row, 6 * side + 1],
            work.gradient[row, 6 * side + 2],
        )
        if not model.local:
            linear = times(nine(work.poses, node, 3), linear)
        for i in range(6):
            entry = linear[i] if i < 3 else work.gradient[row, 6 * side + i]
            size = max(size, abs(entry) / model.metres[6 * node + i])
            _enter(model, work, 6 * node + i, n + row, entry)
            total = 0.0
            for k in range(6):
                total += work.gradient[row, 6 * side + k] * right[2, k, i]
            _enter(model, work, n + row, 6 * node + i, total)
    work.left[n + row] = 1.0 / size if size > 0.0 else 1.0


@inlined
def _scale(model: Model, work: Work, period: float) -> None:
    """Units of `erls.maths.saddle`: metres, and newtons per mass."""
    n = len(work.force)
    mass = 0.0
    for i in range(n):
        mass = max(mass, work.inertia[i] / model.metres[i] ** 2)
    force = period**2 / (mass if mass > 0.0 else 1.0)
    for i in range(n):
        work.left[i], work.right[i] = force / model.metres[i], 1.0 / model.metres[i]
    for i in range(n, len(model.place)):
        work.right[i] = work.left[i] / force
    table = work.band
    width = (table.shape[1] - 1) // 3
    size = len(table)
    for i in range(size):
        left = work.left[model.order[i]]
        for j in range(max(0, i - width), min(size, i + width + 1)):
            table[i, j - i + width] *= left * work.right[model.order[j]]


@kernel(FACTOR, counted=False)
def iteration_matrix(model: Model, work: Work, sample: Array, to_a: float, to_v: float, period: float) -> int:
    """Factor [[β' M + γ' C + K T, Bᵀ], [B T, 0]]; 0, or 1 + the number of the unknown that is to blame.

    ``work`` holds the state with `forces` evaluated.
    """
    table = work.band
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            table[i, j] = 0.0
    n = len(work.force)
    for i in range(n):
        work.inertia[i] = 0.0
    _node_factors(model, work, to_a, to_v)
    for e in range(len(model.beam_nodes)):
        beam_derivatives(model, work, e)
        _add_blocks(model, work, model.beam_nodes[e, 0], model.beam_nodes[e, 1])
    for k in range(len(model.body_nodes)):
        body_derivatives(model, work, k)
        _add_blocks(model, work, model.body_nodes[k], GROUND)
    for k in range(len(model.load_nodes)):
        load_derivatives(model, work, sample, k)
        _add_blocks(model, work, model.load_nodes[k], GROUND)
    for k in range(len(model.actuator_nodes)):
        if model.actuator_active[k]:
            actuator_derivatives(model, work, k)
            _add_blocks(model, work, model.actuator_nodes[k, 0], model.actuator_nodes[k, 1])
    for j in range(len(model.joint_nodes)):
        joint_derivatives(model, work, sample, j)
        _add_blocks(model, work, model.joint_nodes[j, 0], model.joint_nodes[j, 1])
        for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
            _add_condition(model, work, j, row)
    _scale(model, work, period)
    found = band.factor(table, work.pivots)
    if found == 0:
        return 0
    for i in range(len(model.place)):
        if model.place[i] == found - 1:
            return i + 1
    return found
