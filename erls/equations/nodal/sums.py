"""Configurations, and sums over elements and joints: forces, violations, energies, and what a run keeps.

Elements speak in twists and wrenches of the node axes, as on SE(3). On R³×SO(3) a node's velocity is [u; ω] with u in
the world's axes: ν = E [u; ω], E = diag(Rᵀ, 1), ν̇ = E a + Ė v, forces are Eᵀ f.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.actuator_forces import (
    acting,
    actuator_energy,
    actuator_forces,
    set_coordinates,
    store_coordinates,
)
from erls.equations.nodal.beam_forces import beam_energy, beam_forces, bend
from erls.equations.nodal.body_forces import body_energy, body_forces, load_forces
from erls.equations.nodal.contract import (
    ACTING,
    CONDITIONS,
    ENERGIES,
    FORCES,
    KNOT,
    REMEMBER,
    Model,
    State,
    Work,
)
from erls.equations.nodal.joint_forces import joint_forces, joint_gradients
from erls.equations.nodal.spring_forces import (
    spring_energy,
    spring_forces,
    wind,
    winding_energy,
    winding_forces,
)
from erls.maths.coefficients import stumpff
from erls.maths.jit import inlined, kernel
from erls.maths.rotations import exponential, value
from erls.maths.vectors import (
    cross,
    dot,
    minus,
    nine,
    plus,
    product,
    put,
    scaled,
    three,
    times,
    turned,
    vector,
)


@inlined
def compose(model: Model, start: Array, increment: Array, out: Array) -> None:
    """Poses ∘ exp(increment), their rotations orthogonal to rounding however many steps were made."""
    for node in range(len(start)):
        u, psi = three(increment, 6 * node), three(increment, 6 * node + 3)
        c = stumpff(dot(psi, psi))
        turn = nine(start, node, 3)
        if model.local:
            u = times(turn, value(c[1], c[2], psi, u))
        place = plus(vector(start, node, 0), u)
        r = product(turn, exponential(psi, c[0], c[1]))
        x, y, z = (r[0], r[3], r[6]), (r[1], r[4], r[7]), (r[2], r[5], r[8])
        xx, yy, zz = 1.5 - 0.5 * dot(x, x), 1.5 - 0.5 * dot(y, y), 1.5 - 0.5 * dot(z, z)
        xy, yz, zx = -0.5 * dot(x, y), -0.5 * dot(y, z), -0.5 * dot(z, x)
        r = product(r, (xx, xy, zx, xy, yy, yz, zx, yz, zz))
        for i in range(3):
            out[node, i] = place[i]
        for i in range(9):
            out[node, 3 + i] = r[i]


@inlined
def set_twists(model: Model, work: Work) -> None:
    """Twists of all nodes in their own axes, and their rates."""
    for node in range(len(work.poses)):
        at = 6 * node
        v, a, w = three(work.v, at), three(work.a, at), three(work.v, at + 3)
        if not model.local:
            turn = nine(work.poses, node, 3)
            v, a = turned(turn, v), turned(turn, a)
            a = minus(a, cross(w, v))
        put(work.twist, at, v)
        put(work.twist, at + 3, w)
        put(work.rate, at, a)
        put(work.rate, at + 3, three(work.a, at + 3))


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


@kernel(CONDITIONS, counted=False)
def conditions(model: Model, work: Work, sample: Array) -> None:
    """Violation, gradient, Φ_t and, without accelerations, Φ̈ − B a of all conditions at ``work``'s poses and motion."""
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


@kernel(ENERGIES, counted=False)
def energies(model: Model, work: Work, out: Array) -> None:
    """Kinetic, elastic of beams, gravity, springs, springs in joints; loads count as work done from outside."""
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
def knot(model: Model, work: Work, out: Array) -> None:
    """Positions and rotation matrices, then joint coordinates, with first and second derivative (3, s)."""
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
def in_joints(model: Model, work: Work, sample: Array, out: Array) -> None:
    """(a, 10) coordinate, rate, acceleration, effort and wrench of each actuator."""
    set_twists(model, work)
    for k in range(len(model.actuator_nodes)):
        acting(model, work, sample, k, out[k])
