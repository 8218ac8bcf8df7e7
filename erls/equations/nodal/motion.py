"""Configurations and their motion.

Elements speak in twists and wrenches of the node axes, as on SE(3). On R³×SO(3) a node's velocity is [u; ω] with u in
the world's axes: ν = E [u; ω], E = diag(Rᵀ, 1), ν̇ = E a + Ė v, forces are Eᵀ f.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.contract import Model, Work
from erls.maths.coefficients import stumpff
from erls.maths.jit import part
from erls.maths.rotations import turned_further, value
from erls.maths.vectors import cross, dot, minus, nine, plus, put, three, times, turned, vector


@part
def compose(model: Model, start: Array, increment: Array, out: Array) -> None:
    """Poses ∘ exp(increment), their rotations orthogonal to rounding however many steps were made."""
    for node in range(len(start)):
        u, psi = three(increment, 6 * node), three(increment, 6 * node + 3)
        c = stumpff(dot(psi, psi))
        turn = nine(start, node, 3)
        if model.local:
            u = times(turn, value(c[1], c[2], psi, u))
        place = plus(vector(start, node, 0), u)
        r = turned_further(turn, psi, c[0], c[1])
        for i in range(3):
            out[node, i] = place[i]
        for i in range(9):
            out[node, 3 + i] = r[i]


@part
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
