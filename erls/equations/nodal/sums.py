"""Sums over elements and joints: forces and violations; and what elements know beside the poses."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.actuator_forces import actuator_forces, set_coordinates
from erls.equations.nodal.beam_forces import beam_forces, bend
from erls.equations.nodal.body_forces import body_forces, load_forces
from erls.equations.nodal.contract import FORCES, REMEMBER, Model, State, Work
from erls.equations.nodal.joint_forces import joint_forces
from erls.equations.nodal.motion import compose, set_twists
from erls.equations.nodal.spring_forces import spring_forces, wind, winding_forces
from erls.maths.jit import kernel
from erls.maths.vectors import nine, put, three, times


@kernel(FORCES, counted=False)
def forces(model: Model, work: Work, before: State, sample: Array) -> None:
    """Residual and Bᵀλ (n,), violations (m,) of the state that ``work`` tries."""
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


@kernel(REMEMBER, counted=False)
def remember(model: Model, work: Work, before: State) -> None:
    """What ``work``'s poses do not tell: twists of beams, joint coordinates and torsion springs, next to ``before``."""
    for e in range(len(model.beam_nodes)):
        bend(model, work.poses, before.bent, work.bent, e)
    set_coordinates(model, work, before.turned)
    wind(model.winding_nodes, model.winding_frames, work.poses, before.wound, work.wound)


@kernel(REMEMBER, counted=False)
def move(model: Model, work: Work, before: State) -> None:
    """Poses ∘ exp(increment) from ``before`` into ``work``, with what they do not tell."""
    compose(model, before.poses, work.increment, work.poses)
    remember(model, work, before)
