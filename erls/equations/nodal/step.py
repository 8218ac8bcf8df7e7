"""Functions of `erls.equations.stepped` for nodal systems; those for the iteration matrix are in
`erls.equations.nodal.matrix`.

A configuration is a `State` in flat memory. Of one that is tried only the poses are set; what they do not tell follows
when a step is accepted.
"""

from __future__ import annotations

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    State,
    Work,
    call_forces,
    call_knot,
    call_remember,
    read_before,
    read_layout,
    read_model,
    read_state,
    read_work,
)
from erls.equations.nodal.motion import compose as composed
from erls.equations.stepped import COMPOSE, SETTLE
from erls.maths.jit import kernel, part


@kernel(COMPOSE, counted=False)
def compose(
    reals: Array, integers: IntArray, scratch: Array, metres: Array, start: Array, d: Array, out: Array
) -> float:
    """Poses ∘ exp(d); the size of the mechanism."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before = read_before(scratch, integers, known.before)
    for i in range(len(start)):
        before.numbers[i] = start[i]
    before.behind[0] = 1.0
    for i in range(len(d)):
        work.increment[i] = d[i]
    here, there = read_state(start, integers, known.state), read_state(out, integers, known.state)
    composed(model, here.poses, work.increment, there.poses)
    reach: float = known.reach
    return reach


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, q: Array, v: Array, a: Array, out: Array
) -> None:
    """[M a + Bᵀ λ - f; Φ], then the norms of M a - f and of Bᵀ λ [N]."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    before, poses = read_before(scratch, integers, known.before), read_state(q, integers, known.state).poses
    n, m = len(work.v), len(work.multipliers)
    for node in range(len(poses)):
        for i in range(12):
            work.poses[node, i] = poses[node, i]
    for i in range(n):
        work.v[i], work.a[i] = v[i], a[i]
    for k in range(m):
        work.multipliers[k] = a[n + k]
    call_forces(known.forces, reals, integers, scratch, before.numbers)
    before.behind[0] = 0.0
    force = reaction = 0.0
    for i in range(n):
        f, r = work.force[i] / model.metres[i], work.reaction[i] / model.metres[i]
        force += f * f
        reaction += r * r
        out[i] = work.force[i] + work.reaction[i]
    for k in range(m):
        out[n + k] = work.violation[k]
    out[n + m], out[n + m + 1] = np.sqrt(force), np.sqrt(reaction)


@part
def keep(work: Work, there: State) -> None:
    """Into a configuration, what its poses do not tell."""
    for e in range(len(work.bent)):
        for i in range(6):
            there.bent[e, i] = work.bent[e, i]
    for k in range(len(work.turned)):
        there.turned[k] = work.turned[k]
    for k in range(len(work.wound)):
        for i in range(3):
            there.wound[k, i] = work.wound[k, i]


@kernel(SETTLE, counted=False)
def settle(
    reals: Array, integers: IntArray, scratch: Array, t: float, q: Array, v: Array, a: Array, knot: Array
) -> int:
    """A knot; ``q`` gets what its poses do not tell."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    work = read_work(scratch, integers, known.work)
    before, there = read_before(scratch, integers, known.before), read_state(q, integers, known.state)
    for node in range(len(work.poses)):
        for i in range(12):
            work.poses[node, i] = there.poses[node, i]
    for i in range(len(work.v)):
        work.v[i], work.a[i] = v[i], a[i]
    if before.behind[0] != 0.0:
        call_remember(known.remember, reals, integers, scratch, before.numbers)
    keep(work, there)
    call_knot(known.knot, reals, integers, scratch, knot)
    return 0
