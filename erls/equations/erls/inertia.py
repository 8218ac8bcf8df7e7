"""Inertia of a chain over (w, ω) of each link: nine numbers, see `erls.equations.erls`."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.forces import pair_of, vector
from erls.maths.jit import part


@part
def link_inertia(reals: Array, integers: IntArray, scratch: Array, record: int) -> None:
    """INERTIA of a link alone, with its elastic coordinates held; after `deform_first_order`, `deform_second_order`."""
    n = 6 + integers[record + at.MODES]
    memory, axes = integers[record + at.MEMORY], integers[record + at.AXES]
    link = scratch[memory : memory + at.VECTORS]
    mass, axis = integers[record + at.MASS], integers[record + at.AXIS]
    inertia = link[at.INERTIA : at.INERTIA + 81]
    inertia[:] = 0.0
    for j in range(6):
        for i in range(6):
            inertia[9 * i + j] = reals[mass + j * n + i]
    for a in range(axes):
        if integers[at.FIRST_ORDER]:
            start = vector(memory, n, at.X_Q + a)
            for j in range(3):
                turn = reals[axis + 3 * a + j]
                for i in range(6):
                    inertia[9 * i + 6 + j] += scratch[start + i] * turn
                    inertia[54 + 9 * j + i] += scratch[start + i] * turn
        if integers[at.SECOND_ORDER]:
            for b in range(axes):
                moment = link[at.TURN_MOMENTS + pair_of(axes, a, b)]
                for i in range(3):
                    for j in range(3):
                        inertia[60 + 9 * i + j] += moment * reals[axis + 3 * a + i] * reals[axis + 3 * b + j]


@part
def joint_path(reals: Array, integers: IntArray, record: int, link: Array) -> None:
    """PATH of a link: s = (S - ad(S) u, S_ω), the motion of (w, ω) per unit of θ̇."""
    screw = integers[record + at.SCREW]
    s = link[at.PATH : at.PATH + 9]
    for i in range(6):
        s[i] = reals[screw + i]
    for i in range(3):
        s[6 + i] = s[3 + i]
    u0, u1, u2, a0, a1, a2 = (
        link[at.U],
        link[at.U + 1],
        link[at.U + 2],
        link[at.U + 3],
        link[at.U + 4],
        link[at.U + 5],
    )
    v0, v1, v2, w0, w1, w2 = s[0], s[1], s[2], s[3], s[4], s[5]
    # - ad(S) u = ad(u) S
    s[0] += a1 * v2 - a2 * v1 + u1 * w2 - u2 * w1
    s[1] += a2 * v0 - a0 * v2 + u2 * w0 - u0 * w2
    s[2] += a0 * v1 - a1 * v0 + u0 * w1 - u1 * w0
    s[3] += a1 * w2 - a2 * w1
    s[4] += a2 * w0 - a0 * w2
    s[5] += a0 * w1 - a1 * w0


@part
def carry9(link: Array, x: Array, start: int, out: Array, to: int) -> None:
    """T x for a motion (w, ω) of the frame before; both may be the same."""
    x0, x1, x2, w0, w1, w2 = x[start], x[start + 1], x[start + 2], x[start + 3], x[start + 4], x[start + 5]
    o0, o1, o2 = x[start + 6], x[start + 7], x[start + 8]
    p0, p1, p2 = link[9], link[10], link[11]
    v0, v1, v2 = x0 + w1 * p2 - w2 * p1, x1 + w2 * p0 - w0 * p2, x2 + w0 * p1 - w1 * p0
    for i in range(3):
        out[to + i] = link[i] * v0 + link[3 + i] * v1 + link[6 + i] * v2
        out[to + 3 + i] = link[i] * w0 + link[3 + i] * w1 + link[6 + i] * w2
        out[to + 6 + i] = link[i] * o0 + link[3 + i] * o1 + link[6 + i] * o2


@part
def carry9_back(link: Array, f: Array, start: int, stride: int, out: Array, to: int, out_stride: int) -> None:
    """Tᵀ f for a force on (w, ω); nine numbers ``stride`` apart; both may be the same."""
    f0, f1, f2 = f[start], f[start + stride], f[start + 2 * stride]
    m0, m1, m2 = f[start + 3 * stride], f[start + 4 * stride], f[start + 5 * stride]
    o0, o1, o2 = f[start + 6 * stride], f[start + 7 * stride], f[start + 8 * stride]
    a0 = link[0] * f0 + link[1] * f1 + link[2] * f2
    a1 = link[3] * f0 + link[4] * f1 + link[5] * f2
    a2 = link[6] * f0 + link[7] * f1 + link[8] * f2
    p0, p1, p2 = link[9], link[10], link[11]
    out[to], out[to + out_stride], out[to + 2 * out_stride] = a0, a1, a2
    out[to + 3 * out_stride] = link[0] * m0 + link[1] * m1 + link[2] * m2 + p1 * a2 - p2 * a1
    out[to + 4 * out_stride] = link[3] * m0 + link[4] * m1 + link[5] * m2 + p2 * a0 - p0 * a2
    out[to + 5 * out_stride] = link[6] * m0 + link[7] * m1 + link[8] * m2 + p0 * a1 - p1 * a0
    out[to + 6 * out_stride] = link[0] * o0 + link[1] * o1 + link[2] * o2
    out[to + 7 * out_stride] = link[3] * o0 + link[4] * o1 + link[5] * o2
    out[to + 8 * out_stride] = link[6] * o0 + link[7] * o1 + link[8] * o2


@part
def carry_inertia_back(link: Array, start: int, out: Array, to: int) -> None:
    """Tᵀ I T: an inertia (9, 9) of the link on the frame before."""
    for j in range(9):  # columns of Tᵀ I
        carry9_back(link, link, start + j, 9, out, to + j, 9)
    for i in range(9):  # rows of that times T
        carry9_back(link, out, to + 9 * i, 1, out, to + 9 * i, 1)
