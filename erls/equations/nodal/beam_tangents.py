"""Exact derivatives of the forces of beams: also those that iterations leave out, of inertia as an element bends.

Forces on the sections depend on the twist d of the element, on the twists of its sections and their rates, and on the
direction of the weight in the first section. By d they are differentiated through a complex step of their own source
(`erls.equations.nodal.beam_forces.between`), six for an element, and by nodes through ḋ = P ν; by velocities in
`erls.equations.nodal.beam_derivatives`.
"""

from __future__ import annotations

from typing import Any

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.beam_derivatives import elastic_derivatives, inertia_derivatives, set_rows
from erls.equations.nodal.beam_ends import inward
from erls.equations.nodal.beam_forces import between
from erls.equations.nodal.contract import TANGENTS, Model, Work, read_layout, read_model, read_work
from erls.maths.jit import kernel, part
from erls.maths.vectors import Twist, vector

STEP = 1e-30
"""Complex steps: the square of one is nothing beside any number."""


@part
def _ahead(x: Any, k: int) -> Any:
    """A complex step along axis k, none of the three for any other number."""
    none, step = 0.0j, 1j * STEP
    return x[0] + (step if k == 0 else none), x[1] + (step if k == 1 else none), x[2] + (step if k == 2 else none)


@part
def _slope(force: Twist) -> Twist:
    n, m = force
    linear = n[0].imag / STEP, n[1].imag / STEP, n[2].imag / STEP
    return linear, (m[0].imag / STEP, m[1].imag / STEP, m[2].imag / STEP)


@part
def _by_bending(model: Model, work: Work, e: int, stiffness: Array) -> None:
    """Add what forces change with d."""
    u, psi, rows = vector(work.bent, e, 0), vector(work.bent, e, 3), work.rows
    for k in range(6):
        forces = between(model, work, e, _ahead(u, k), _ahead(psi, k - 3))
        for side in range(2):
            n, m = inward(model, e, side, _slope(forces[0] if side == 0 else forces[1]))
            for i in range(3):
                for j in range(12):
                    stiffness[6 * side + i, j] += n[i] * rows[k, j]
                    stiffness[6 * side + 3 + i, j] += m[i] * rows[k, j]


@kernel(TANGENTS, counted=False)
def beam_tangents(reals: Array, integers: IntArray, scratch: Array, poses: Array, motion: Array) -> None:
    """Blocks of all elements, the first ones of `Work.blocks`, which are zeros."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for e in range(len(model.beam_nodes)):
        u, psi = vector(work.bent, e, 0), vector(work.bent, e, 3)
        set_rows(model, work, e, u, psi)
        if model.beam_moving[e]:
            inertia_derivatives(model, work, e, work.blocks[e], u, psi, 1)
            _by_bending(model, work, e, work.blocks[e, 2])
        else:
            elastic_derivatives(model, work, e, work.blocks[e, 2], u, psi, 0)
