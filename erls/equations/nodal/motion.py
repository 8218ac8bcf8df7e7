"""Configurations and their motion.

Elements speak in twists and wrenches of the node axes, as on SE(3). On R³×SO(3) a node's velocity is [u; ω] with u in
the world's axes: ν = E [u; ω], E = diag(Rᵀ, 1), ν̇ = E a + Ė v, forces are Eᵀ f.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.contract import Model, Work
from erls.maths.coefficients import stumpff
from erls.maths.jit import inlined
from erls.maths.rotations import exponential, value
from erls.maths.vectors import cross, dot, minus, nine, plus, product, put, three, times, turned, vector


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
