"""What reports and runs keep of a state: energies, frames; what acts in joints is in `actuator_forces`."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.body_forces import body_energy
from erls.equations.nodal.contract import (
    ENERGIES,
    KNOT,
    call_actuator_energies,
    call_beam_energies,
    call_contact_energies,
    call_shell_energies,
    call_spring_energies,
    call_store_actuators,
    read_layout,
    read_model,
    read_work,
)
from erls.equations.nodal.motion import set_twists
from erls.maths.jit import kernel
from erls.maths.vectors import cross, dot, nine, plus, put, scaled, three, times, vector


@kernel(ENERGIES, counted=False)
def energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Kinetic, elastic of beams and shells, gravity, springs, what is elastic in joints and contacts.

    Loads are work from outside.
    """
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    set_twists(model, work)
    for i in range(5):
        out[i] = 0.0
    if known.beam_energies >= 0:
        call_beam_energies(known.beam_energies, reals, integers, scratch, out)
    for k in range(len(model.body_nodes)):
        kinetic, gravity = body_energy(model, work, k)
        out[0] += kinetic
        out[2] += gravity
    if known.shell_energies >= 0:
        call_shell_energies(known.shell_energies, reals, integers, scratch, out)
    if known.spring_energies >= 0:
        call_spring_energies(known.spring_energies, reals, integers, scratch, out)
    if known.contact_energies >= 0:
        call_contact_energies(known.contact_energies, reals, integers, scratch, out)
    if known.actuator_energies >= 0:
        call_actuator_energies(known.actuator_energies, reals, integers, scratch, out)


@kernel(KNOT, counted=False)
def knot(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Positions and rotation matrices, then joint coordinates, with first and second derivative (3, s)."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    set_twists(model, work)
    for node in range(len(work.poses)):
        v, w = three(work.twist, 6 * node), three(work.twist, 6 * node + 3)
        push, gain = three(work.rate, 6 * node), three(work.rate, 6 * node + 3)
        turn, entry = nine(work.poses, node, 3), 12 * node
        for i in range(12):
            out[0, entry + i] = work.poses[node, i]
        put(out[1], entry, times(turn, v))
        put(out[2], entry, times(turn, plus(push, cross(w, v))))
        speed = dot(w, w)
        for i in range(3):
            row = vector(work.poses, node, 3 + 3 * i)
            put(out[1], entry + 3 + 3 * i, cross(row, w))
            second = plus(cross(row, gain), plus(scaled(dot(row, w), w), scaled(-speed, row)))
            put(out[2], entry + 3 + 3 * i, second)
    if known.store_actuators >= 0:
        call_store_actuators(known.store_actuators, reals, integers, scratch, out)
