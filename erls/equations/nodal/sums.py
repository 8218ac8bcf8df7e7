"""Sums over elements and joints: forces and violations; and what elements know beside the poses."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.actuator_forces import actuator_forces, set_coordinates
from erls.equations.nodal.beam_forces import beam_forces, bend
from erls.equations.nodal.body_forces import body_forces, load_forces
from erls.equations.nodal.contract import (
    FORCES,
    REMEMBER,
    Model,
    State,
    Work,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.equations.nodal.joint_forces import joint_forces
from erls.equations.nodal.motion import compose, set_twists
from erls.equations.nodal.spring_forces import spring_forces, wind, winding_forces
from erls.maths.jit import kernel, part
from erls.maths.vectors import nine, put, three, times
from erls.maths.views import vector_at


@kernel(FORCES, counted=False)
def forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Residual and Bᵀλ (n,), violations (m,) of the state that `Work` tries; ``last`` is the configuration before."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before, sample = read_state(last, integers, known.state), vector_at(scratch, 0, known.samples)
    set_twists(model, work)
    for i in range(len(work.force)):
        work.force[i] = work.reaction[i] = 0.0
    beam_forces(model, work, before.bent)
    body_forces(model, work)
    load_forces(model, work, sample)
    actuator_forces(model, work, before.turned, sample)
    spring_forces(model.spring_nodes, model.springs, work.poses, work.twist, work.force)
    wind(model.winding_nodes, model.winding_frames, work.poses, before.wound, work.wound)
    frames, laws = model.winding_frames, model.windings
    winding_forces(model.winding_nodes, frames, laws, work.poses, work.wound, work.twist, work.force)
    joint_forces(model, work, sample)
    if not model.local:
        for node in range(len(work.poses)):
            turn = nine(work.poses, node, 3)
            put(work.force, 6 * node, times(turn, three(work.force, 6 * node)))
            put(work.reaction, 6 * node, times(turn, three(work.reaction, 6 * node)))


@part
def _remember(model: Model, work: Work, before: State) -> None:
    for e in range(len(model.beam_nodes)):
        bend(model, work.poses, before.bent, work.bent, e)
    set_coordinates(model, work, before.turned)
    wind(model.winding_nodes, model.winding_frames, work.poses, before.wound, work.wound)


@kernel(REMEMBER, counted=False)
def remember(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """What the poses of `Work` do not tell, next to ``last``: twists of beams, coordinates, torsion springs."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    _remember(model, work, read_state(last, integers, known.state))


@kernel(REMEMBER, counted=False)
def move(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Poses ∘ exp(increment) from ``last`` into `Work`, with what they do not tell."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before = read_state(last, integers, known.state)
    compose(model, before.poses, work.increment, work.poses)
    _remember(model, work, before)
