"""Conditions of joints; mass, damping and stiffness of elements, and their weighted sum in the system's coordinates.

Velocities as in `erls.equations.nodal.motion`: on R³×SO(3) the chain rule over E v, E a + Ė v and Eᵀ f comes to them.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.body_forces import body_derivatives, load_derivatives
from erls.equations.nodal.contract import (
    BEAMS_APART,
    BLOCKS,
    CONDITIONS,
    SUMMED,
    Model,
    Work,
    call_actuator_derivatives,
    call_beam_derivatives,
    call_contact_derivatives,
    call_shell_derivatives,
    call_spring_derivatives,
    read_layout,
    read_model,
    read_work,
)
from erls.equations.nodal.joint_forces import joint_gradients, joint_stiffness
from erls.equations.nodal.motion import set_twists
from erls.maths.coefficients import stumpff, tangent_coefficients
from erls.maths.jit import kernel, part
from erls.maths.motions import series
from erls.maths.rotations import value
from erls.maths.vectors import cross, dot, minus, nine, plus, scaled, three, times, turned, unit
from erls.maths.views import vector_at


@part
def _conditions(model: Model, work: Work, sample: Array) -> None:
    set_twists(model, work)
    for j in range(len(model.joint_nodes)):
        joint_gradients(model, work, sample, j)
        for side in range(2):
            node = model.joint_nodes[j, side]
            if node < 0 or model.local:
                continue
            for row in range(model.joint_rows[j], model.joint_rows[j + 1]):
                for i in range(6):
                    work.bias[row] += work.gradient[row, 6 * side + i] * work.rate[6 * node + i]


@kernel(CONDITIONS, counted=False)
def conditions(reals: Array, integers: IntArray, scratch: Array) -> None:
    """Violation, gradient, Φ_t and, without accelerations, Φ̈ − B a of all conditions at `Work`'s poses and motion."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    _conditions(model, work, vector_at(scratch, 0, known.samples))


@kernel(BLOCKS, counted=False)
def blocks(reals: Array, integers: IntArray, scratch: Array, material: int) -> None:
    """Derivatives of forces by accelerations, velocities and increments of the nodes into `Work.blocks`, gradients of
    conditions; `Work` holds the state with `erls.equations.nodal.sums.forces` evaluated.

    With ``material``, internal forces count as if they did not turn with deformation. Inertia that changes with
    deformation is left out; with `BEAMS_APART` all of beams is.
    """
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    table, sample = work.blocks, vector_at(scratch, 0, known.samples)
    for e in range(table.shape[0]):
        for kind in range(3):
            for i in range(12):
                for j in range(12):
                    table[e, kind, i, j] = 0.0
    if known.beam_derivatives >= 0 and material != BEAMS_APART:
        call_beam_derivatives(known.beam_derivatives, reals, integers, scratch, material)
    at = len(model.beam_nodes)
    for k in range(len(model.body_nodes)):
        body_derivatives(model, work, k, table[at + k])
    at += len(model.body_nodes)
    for k in range(len(model.load_nodes)):
        load_derivatives(model, work, sample, k, table[at + k])
    if known.actuator_derivatives >= 0:
        call_actuator_derivatives(known.actuator_derivatives, reals, integers, scratch, material)
    if known.contact_derivatives >= 0:
        call_contact_derivatives(known.contact_derivatives, reals, integers, scratch, material)
    if known.shell_derivatives >= 0:
        call_shell_derivatives(known.shell_derivatives, reals, integers, scratch, material)
    if known.spring_derivatives >= 0:
        call_spring_derivatives(known.spring_derivatives, reals, integers, scratch, material)
    at = len(model.pairs) - len(model.joint_nodes)
    _conditions(model, work, sample)
    for j in range(len(model.joint_nodes)):
        joint_stiffness(model, work, sample, j, table[at + j])


@part
def _node_factors(model: Model, work: Work, to_a: float, to_v: float, to_q: float) -> None:
    """What stands to the right of M, C and K for each node, and what Eᵀ f adds as the node turns."""
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
                swing = scaled(to_q, cross(v, turning))  # of E v
                mass = plus(scaled(to_a, turned(turn, x)), scaled(to_v, cross(v, y)))
                mass = minus(mass, scaled(to_v, cross(w, turned(turn, x))))
                mass = plus(mass, minus(scaled(to_q, cross(a, turning)), cross(w, swing)))
                damping = plus(scaled(to_v, turned(turn, x)), swing)
                for i in range(3):
                    out[0, i, j], out[0, 3 + i, j] = mass[i], to_a * y[i]
                    out[1, i, j], out[1, 3 + i, j] = damping[i], to_v * y[i]
            for i in range(3):
                out[2, i, j], out[2, 3 + i, j] = to_q * moved[0][i], to_q * moved[1][i]
        if not model.local:
            # of Eᵀ f at fixed f: forces act in the world's axes by now
            force = scaled(to_q, turned(turn, plus(three(work.force, at), three(work.reaction, at))))
            for j in range(3):
                column = times(turn, cross(value(f[0], g[0], psi, unit(j)), force))
                for i in range(3):
                    work.turning[node, i, j] = column[i]


@kernel(SUMMED, counted=False)
def weighted(reals: Array, integers: IntArray, scratch: Array, to_a: float, to_v: float, to_q: float) -> None:
    """β' M + γ' C + κ K T of each element into `Work.whole`, T being the tangent of `Work.increment`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    _node_factors(model, work, to_a, to_v, to_q)
    for e in range(len(model.pairs)):
        block, out = work.blocks[e], work.whole[e]
        mass, damping, stiffness = block[0], block[1], block[2]
        for side in range(2):
            node = model.pairs[e, side]
            if node < 0:
                continue
            right = work.factors[node]
            for i in range(12):
                if model.pairs[e, i // 6] < 0:
                    continue
                for j in range(6):
                    at = 6 * side + j
                    total = 0.0 * out[i, at]
                    if model.local:
                        total = right[0, j, j] * mass[i, at] + right[1, j, j] * damping[i, at]
                    else:
                        for k in range(6):
                            total += right[0, k, j] * mass[i, 6 * side + k]
                            total += right[1, k, j] * damping[i, 6 * side + k]
                    for k in range(6):
                        share = right[2, k, j]
                        if share != 0.0:
                            total += share * stiffness[i, 6 * side + k]
                    out[i, at] = total
        if model.local:
            continue
        for side in range(2):
            node = model.pairs[e, side]
            if node < 0:
                continue
            turn, row = nine(work.poses, node, 3), 6 * side
            for j in range(12):
                column = times(turn, (out[row, j], out[row + 1, j], out[row + 2, j]))
                out[row, j], out[row + 1, j], out[row + 2, j] = column
