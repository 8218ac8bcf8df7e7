"""Exact derivatives of what acts in joints: complex steps of its own source, coordinate by coordinate.

Iterations do without what turns of the lines of action do, off the ways that joints leave, and without what speeds
change of the acceleration of a rotor; derivatives by the place of a joint go such ways.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.actuator_forces import actuate
from erls.equations.nodal.beam_tangents import STEP
from erls.equations.nodal.contract import TANGENTS, Model, Work, read_layout, read_model, read_work
from erls.maths.jit import kernel, part
from erls.maths.vectors import cross, unit, vector
from erls.maths.views import vector_at

_TWIST, _RATE, _FORCE = range(3)  # rows of complex memory


@part
def _ahead(work: Work, node: int, j: int, kind: int, poses: Array, motion: Array, step: complex) -> None:
    """Move coordinate j of a node: its velocity (``kind`` 1), or its place (2)."""
    if kind == 1:
        motion[_TWIST, 6 * node + j] += step
        return
    if j < 3:
        turn = vector(work.poses, node, 3), vector(work.poses, node, 6), vector(work.poses, node, 9)
        for i in range(3):
            poses[node, i] += step * turn[i][j]
        return
    for i in range(3):  # rows of R ψ̃
        row = cross(vector(work.poses, node, 3 + 3 * i), unit(j - 3))
        for k in range(3):
            poses[node, 3 + 3 * i + k] += step * row[k]


@part
def _still(work: Work, node: int, poses: Array, motion: Array) -> None:
    """The state of a node, as it is."""
    for i in range(12):
        poses[node, i] = work.poses[node, i]
    for i in range(6 * node, 6 * node + 6):
        motion[_TWIST, i], motion[_RATE, i], motion[_FORCE, i] = work.twist[i], work.rate[i], 0.0


@part
def _columns(model: Model, work: Work, sample: Array, e: int, k: int, poses: Array, motion: Array) -> None:
    """Damping and stiffness of actuator k into the block of element e."""
    block, pair = work.blocks[e], model.pairs[e]
    for side in range(2):
        if pair[side] >= 0:
            _still(work, pair[side], poses, motion)
    for kind in range(1, 3):
        for side in range(2):
            if pair[side] < 0:
                continue
            for j in range(6):
                _ahead(work, pair[side], j, kind, poses, motion, 1j * STEP)
                near = work.turned[k]
                actuate(model, poses, motion[_TWIST], motion[_RATE], sample, k, near, motion[_FORCE])
                for other in range(2):
                    if pair[other] >= 0:
                        for i in range(6):
                            slope = motion[_FORCE, 6 * pair[other] + i].imag / STEP
                            block[kind, 6 * other + i, 6 * side + j] = slope
                        _still(work, pair[other], poses, motion)


@kernel(TANGENTS, counted=False)
def actuator_tangents(reals: Array, integers: IntArray, scratch: Array, poses: Array, motion: Array) -> None:
    """Damping and stiffness of all actuators into `Work.blocks`, where their mass is known; ``poses`` (k, 12) and
    ``motion`` (3, n) are memory.
    """
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    sample = vector_at(scratch, 0, known.samples)
    first = len(model.beam_nodes) + len(model.body_nodes) + len(model.load_nodes)
    for k in range(len(model.actuator_nodes)):
        if model.actuator_active[k]:
            _columns(model, work, sample, first + k, k, poses, motion)
