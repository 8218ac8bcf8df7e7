"""What reports and runs keep of a state: energies, frames, what acts in joints."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.actuator_forces import acting, actuator_energy, store_coordinates
from erls.equations.nodal.beam_forces import beam_energy
from erls.equations.nodal.body_forces import body_energy
from erls.equations.nodal.contract import ACTING, ENERGIES, KNOT, read_layout, read_model, read_work
from erls.equations.nodal.motion import set_twists
from erls.equations.nodal.spring_forces import spring_energy, winding_energy
from erls.maths.jit import kernel
from erls.maths.vectors import cross, dot, nine, plus, put, scaled, three, times, vector
from erls.maths.views import vector_at


@kernel(ENERGIES, counted=False)
def energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Kinetic, elastic of beams, gravity, springs, springs in joints; loads count as work done from outside."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    set_twists(model, work)
    for i in range(5):
        out[i] = 0.0
    for e in range(len(model.beam_nodes)):
        kinetic, elastic, gravity = beam_energy(model, work, e)
        out[0] += kinetic
        out[1] += elastic
        out[2] += gravity
    for k in range(len(model.body_nodes)):
        kinetic, gravity = body_energy(model, work, k)
        out[0] += kinetic
        out[2] += gravity
    out[3] = spring_energy(model.spring_nodes, model.springs, work.poses) + winding_energy(model.windings, work.wound)
    for k in range(len(model.actuator_nodes)):
        kinetic, spring = actuator_energy(model, work, k)
        out[0] += kinetic
        out[4] += spring


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
    store_coordinates(model, work, out)


@kernel(ACTING, counted=False)
def in_joints(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """(a, 10) coordinate, rate, acceleration, effort and wrench of each actuator."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    sample = vector_at(scratch, 0, known.samples)
    set_twists(model, work)
    for k in range(len(model.actuator_nodes)):
        acting(model, work, sample, k, out[k])
