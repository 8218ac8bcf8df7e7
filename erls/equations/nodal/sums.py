"""Sums over elements and joints: forces and violations; and what elements know beside the poses."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.body_forces import body_forces, load_forces
from erls.equations.nodal.contract import (
    FORCES,
    REMEMBER,
    Layout,
    call_actuator_forces,
    call_beam_forces,
    call_bend_beams,
    call_contact_forces,
    call_shell_forces,
    call_spring_forces,
    call_turn_actuators,
    call_wind_springs,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.equations.nodal.joint_forces import joint_forces
from erls.equations.nodal.motion import compose, set_twists
from erls.maths.jit import kernel, part
from erls.maths.vectors import nine, put, three, times
from erls.maths.views import vector_at


@kernel(FORCES, counted=False)
def forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Residual and Bᵀλ (n,), violations (m,) of the state that `Work` tries; ``last`` is the configuration before."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    sample = vector_at(scratch, 0, known.samples)
    set_twists(model, work)
    for i in range(len(work.force)):
        work.force[i] = work.reaction[i] = 0.0
    if known.beam_forces >= 0:
        call_beam_forces(known.beam_forces, reals, integers, scratch, last)
    body_forces(model, work)
    load_forces(model, work, sample)
    if known.actuator_forces >= 0:
        call_actuator_forces(known.actuator_forces, reals, integers, scratch, last)
    if known.contact_forces >= 0:
        call_contact_forces(known.contact_forces, reals, integers, scratch, last)
    if known.shell_forces >= 0:
        call_shell_forces(known.shell_forces, reals, integers, scratch, last)
    if known.spring_forces >= 0:
        call_spring_forces(known.spring_forces, reals, integers, scratch, last)
    joint_forces(model, work, sample)
    if not model.local:
        for node in range(len(work.poses)):
            turn = nine(work.poses, node, 3)
            put(work.force, 6 * node, times(turn, three(work.force, 6 * node)))
            put(work.reaction, 6 * node, times(turn, three(work.reaction, 6 * node)))


@part
def _remember(known: Layout, reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    if known.bend_beams >= 0:
        call_bend_beams(known.bend_beams, reals, integers, scratch, last)
    if known.turn_actuators >= 0:
        call_turn_actuators(known.turn_actuators, reals, integers, scratch, last)
    if known.wind_springs >= 0:
        call_wind_springs(known.wind_springs, reals, integers, scratch, last)


@kernel(REMEMBER, counted=False)
def remember(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """What the poses of `Work` do not tell, next to ``last``: twists of beams, coordinates, torsion springs."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    _remember(known, reals, integers, scratch, last)


@kernel(REMEMBER, counted=False)
def move(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Poses ∘ exp(increment) from ``last`` into `Work`, with what they do not tell."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    compose(model, read_state(last, integers, known.state).poses, work.increment, work.poses)
    _remember(known, reals, integers, scratch, last)
