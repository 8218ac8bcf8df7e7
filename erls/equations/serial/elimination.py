"""(M + α C + β K) x = b solved link by link, from the tips inward and back; its cost grows with the number of links.

With the segments of `erls.equations.serial.segments` in decoupled coordinates D = 1 + α C_d + β K_d is diagonal. A link
and all that it bears act on its parent with the force H̃ μ + f, μ their motion without the joint's own. Elastic
coordinates x of a link feel what it bears through few ports z = P x: the reach N of the links on it, and E, F of
inertia that changes. With h the forces at ports and g the motion of the link,

    D x + Bᵀ g + Pᵀ (Q z + Q_g g + h) = b,   so   (1 + G Q) z = P D⁻¹ b - G h - (G_B + G Q_g) g,   G = P D⁻¹ Pᵀ,

and the link without its elastic coordinates has the inertia I - B D⁻¹ Bᵀ + ... on g. Then its joint goes
(R. Featherstone, Rigid Body Dynamics Algorithms, ch. 7: articulated bodies). What C has beside its diagonal in
decoupled coordinates is left out. Numbers α, β may be complex.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from erls.equations.serial.joints import gains
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    Serial,
    read_joint,
    read_joint_state,
    read_modes,
)
from erls.equations.serial.segments import SEGMENT, Segment, read_segment
from erls.maths.jit import part
from erls.maths.products import add_product, add_rows, add_transposed_product, clear, copy, copy_matrix, dot
from erls.maths.records import Matrix, Vector, reader, table_size
from erls.maths.so3 import Array
from fe_import.model import IntArray

_SINGULAR = 1e-14  # inertia along a joint against what it was before the elimination of the rest


class Condensed(NamedTuple):
    """A link in elimination: p numbers of motion, e elastic coordinates, n ports.

    Attributes
    ----------
    compliance : (e,) array
        D⁻¹.
    rows : (n, e) array
        P.
    bound, bound_lead : (n, n), (n, p) arrays
        Q and Q_g.
    yielding : (n, n) array
        G.
    solver : (n, 2 n) array
        Right half: (1 + G Q)⁻¹.
    output : (n, p) array
        z per unit of g.
    crossing : (n, p) array
        P D⁻¹ Bᵀ.
    through : (p, n) array
        What z puts on g: Q_gᵀ - (P D⁻¹ Bᵀ)ᵀ Q.
    articulated : (p, p) array
        Inertia on g; without its joint H̃.
    coupling : (p, e) array
        B.
    lead, reach, subspace : arrays
        L, N and S of the segment.
    push : (p,) array
        Articulated inertia times S.
    along : (2,) array
        Inertia along the joint, and what stiffness and damping add to it.
    forces, free, given, load, motion : (e,), (n,), (n,), (p,), (p,) arrays
        Working memory of right sides.
    handed : (n,) array
        h.
    """

    compliance: Vector
    rows: Matrix
    bound: Matrix
    bound_lead: Matrix
    yielding: Matrix
    solver: Matrix
    output: Matrix
    crossing: Matrix
    through: Matrix
    articulated: Matrix
    coupling: Matrix
    lead: Matrix
    reach: Matrix
    subspace: Vector
    push: Vector
    along: Vector
    forces: Vector
    free: Vector
    given: Vector
    load: Vector
    motion: Vector
    handed: Vector
    parent: int
    ports: int
    first_port: int
    spare: Matrix


def condensed(own: Segment, ports: int, first_port: int) -> Condensed:
    """Memory for a link with so many ports, whose own ones on its parent begin there."""
    p, e = own.coupling.shape
    before = own.lead.shape[1]

    def room(*shape: int) -> Array:
        return np.zeros(shape)

    return Condensed(
        room(e), room(ports, e), room(ports, ports), room(ports, p), room(ports, ports), room(ports, 2 * ports),
        room(ports, p), room(ports, p), room(p, ports), room(p, p), room(p, e), room(p, before),
        room(p, own.reach.shape[1]), room(p), room(p), room(2), room(e), room(ports), room(ports), room(p), room(p),
        room(ports), own.parent, own.ports, first_port, room(p, max(before, p)),
    )  # fmt: skip


read_condensed = reader(Condensed)
CONDENSED = table_size(Condensed)


@part
def invert(a: Array) -> float:
    """Replace the right half of a (n, 2 n) by the inverse of the left one; -1.0 where a real determinant is
    negative.
    """
    n, sign = a.shape[0], 1.0
    for i in range(n):
        for j in range(n):
            a[i, n + j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            sign = -sign
            for j in range(k, 2 * n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        if a[k, k].real < 0.0:
            sign = -sign
        row, inverse = a[k], 1.0 / a[k, k]
        for j in range(k + 1, 2 * n):
            row[j] *= inverse
        for i in range(n):
            factor, other = a[i, k], a[i]
            if i != k:
                for j in range(k + 1, 2 * n):
                    other[j] -= factor * row[j]
    return sign


@part
def _quadratic(matrix: Array, x: Array) -> Any:
    """xᵀ A x."""
    total = 0.0
    for i in range(len(x)):
        total += x[i] * dot(matrix[i], x)
    return total


@part
def condense(own: Segment, work: Condensed) -> float:
    """Take the elastic coordinates of a link out of its ``articulated`` inertia; the sign of `invert`.

    What it bears stands in ``rows``, ``bound``, ``bound_lead`` and ``articulated`` already.
    """
    n, e, p, extra = work.rows.shape[0], len(work.compliance), len(work.load), own.change.shape[0]
    copy_matrix(own.coupling, work.coupling)
    for r in range(extra):
        at, partner = n - 2 * extra + r, n - extra + r
        for j in range(e):
            work.rows[at, j], work.rows[partner, j] = own.change[r, j], own.partner[r, j]
        work.bound[at, partner] = work.bound[partner, at] = 0.5
    for i in range(p):
        for j in range(p):
            total = 0.0
            for m in range(e):
                total += work.coupling[i, m] * work.compliance[m] * work.coupling[j, m]
            work.articulated[i, j] -= total
    if n == 0:
        return 1.0
    for i in range(n):
        for m in range(e):
            work.forces[m] = work.rows[i, m] * work.compliance[m]
        for j in range(i + 1):
            work.yielding[i, j] = work.yielding[j, i] = dot(work.forces, work.rows[j])
        for j in range(p):
            work.crossing[i, j] = dot(work.forces, work.coupling[j])
    for i in range(n):
        for j in range(n):
            work.solver[i, j] = 1.0 if i == j else 0.0
    left, right = work.solver[:, :n], work.solver[:, n:]
    add_product(work.yielding, work.bound, left)
    sign = invert(work.solver)
    for i in range(p):
        for j in range(n):
            work.through[i, j] = work.bound_lead[j, i]
            for m in range(n):
                work.through[i, j] -= work.crossing[m, i] * work.bound[m, j]
    for j in range(p):
        for i in range(n):
            work.given[i] = -work.crossing[i, j]
            for m in range(n):
                work.given[i] -= work.yielding[i, m] * work.bound_lead[m, j]
        for i in range(n):
            work.output[i, j] = dot(right[i], work.given)
    for i in range(p):
        for j in range(p):
            total = dot(work.through[i], work.output[:, j])
            for m in range(n):
                total -= work.crossing[m, i] * work.bound_lead[m, j]
            work.articulated[i, j] += total
    return sign


@part
def set_compliance(
    serial: Serial, condensed: int, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    alpha: Any, beta: Any, factors: Any,
) -> int:  # fmt: skip
    """D⁻¹ of all links, and what α C + β K adds along their joints, after `feed_forward` where a drive needs that.

    0, or 1 + the number of a coordinate whose motion nothing resists.
    """
    for k in range(serial.links):
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        for i in range(len(work.compliance)):
            whole = 1.0 + alpha * modes.decoupled_damping[i] + beta * modes.decoupled_stiffness[i]
            if not whole.real > 0.0:
                return int(modes.first + i + 1)
            work.compliance[i] = 1.0 / whole
        work.along[1] = 0.0
        if joint.place >= 0 and joint.acts:
            feed = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).feed[0]
            stiffness, damping = gains(joint, reals, integers, t, y[joint.place], v[joint.place], feed)
            work.along[1] = alpha * damping + beta * stiffness
    return 0


@part
def eliminate(
    serial: Serial, segments: int, condensed: int, reals: Array, integers: IntArray, scratch: Array, factors: Array,
    definite: bool,
) -> int:  # fmt: skip
    """Articulated inertias from the tips inward, from segments in decoupled coordinates and ``compliance``, ``along``.

    0, or 1 + the number of a coordinate whose motion nothing resists; or, where the matrix should be positive
    ``definite``, whose motion the rest drives.
    """
    for k in range(serial.links):
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        own = read_segment(scratch, integers, segments + k * SEGMENT)
        copy_matrix(own.inertia, work.articulated)
        copy_matrix(own.lead, work.lead)
        copy_matrix(own.reach, work.reach)
        for i in range(len(work.subspace)):
            work.subspace[i] = own.subspace[i]
        work.bound[:, :] = 0.0
        work.bound_lead[:, :] = 0.0
    for k in range(serial.links - 1, -1, -1):
        own = read_segment(scratch, integers, segments + k * SEGMENT)
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        resisting = 0.0  # before elimination
        if joint.place >= 0:
            resisting = abs(_quadratic(work.articulated, work.subspace))
        sign = condense(own, work)
        if definite and sign < 0.0:
            return int(read_modes(reals, integers, serial.modes + k * MODES).first + 1)
        if joint.place >= 0:
            along = work.along[1] + joint.rotor
            resisting += abs(along)
            clear(work.push)
            add_rows(work.articulated, work.subspace, 1.0, work.push)
            along += dot(work.push, work.subspace)
            if not (abs(along) > _SINGULAR * resisting and (along.real > 0.0 or not definite)):
                return int(joint.place + 1)
            work.along[0] = along
            for i in range(len(work.push)):
                for j in range(len(work.push)):
                    work.articulated[i, j] -= work.push[i] * (work.push[j] / along)
        if work.parent >= 0:
            _hand_inertia(work, read_condensed(factors, integers, condensed + work.parent * CONDENSED))
    return 0


@part
def _hand_inertia(work: Condensed, before: Condensed) -> None:
    """What a link without its joint is to its parent: ports, and inertia."""
    ports, at, spare = work.ports, work.first_port, work.spare[:, : work.lead.shape[1]]
    spare[:, :] = 0.0
    add_product(work.articulated, work.lead, spare)
    add_transposed_product(work.lead, spare, before.articulated)
    for i in range(ports):
        copy(work.reach[i], before.rows[at + i])
        copy(spare[i], before.bound_lead[at + i])
        for j in range(ports):
            before.bound[at + i, at + j] = work.articulated[i, j]


@part
def substitute(
    serial: Serial, condensed: int, reals: Array, integers: IntArray, factors: Array, b: Array
) -> None:
    """Replace ``b`` by the solution, after `eliminate`."""
    for k in range(serial.links):
        clear(read_condensed(factors, integers, condensed + k * CONDENSED).load)
    for k in range(serial.links - 1, -1, -1):
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        place = read_joint(reals, integers, serial.joints + k * JOINT).place
        _collect(work, modes.decoupled, b[modes.first : modes.first + len(work.forces)])
        if place >= 0:
            b[place] -= dot(work.load, work.subspace)
            for i in range(len(work.load)):
                work.load[i] += work.push[i] * (b[place] / work.along[0])
        if work.parent >= 0:
            before = read_condensed(factors, integers, condensed + work.parent * CONDENSED)
            for i in range(len(work.load)):
                for j in range(len(before.load)):
                    before.load[j] += work.lead[i, j] * work.load[i]
            for i in range(work.ports):
                before.handed[work.first_port + i] = work.load[i]
    for k in range(serial.links):
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        place = read_joint(reals, integers, serial.joints + k * JOINT).place
        clear(work.motion)
        if work.parent >= 0:
            before = read_condensed(factors, integers, condensed + work.parent * CONDENSED)
            add_rows(work.lead, before.motion, 1.0, work.motion)
            add_rows(work.reach, before.forces, 1.0, work.motion)
        if place >= 0:
            b[place] = (b[place] - dot(work.push, work.motion)) / work.along[0]
            for i in range(len(work.motion)):
                work.motion[i] += work.subspace[i] * b[place]
        _answer(work, modes.decoupled, b[modes.first : modes.first + len(work.forces)])


@part
def _collect(work: Condensed, decoupled: Array, b: Array) -> None:
    """Add to ``load`` what forces on elastic coordinates and at ports put on the link; ``free`` gets z at g = 0.

    ``forces`` holds those on the decoupled coordinates.
    """
    n, e, p = len(work.free), len(b), len(work.load)
    for i in range(e):
        work.forces[i] = 0.0
    for i in range(e):  # Vᵀ b
        row, weight = decoupled[i], b[i]
        for j in range(e):
            work.forces[j] += weight * row[j]
    for i in range(p):
        total = 0.0
        for m in range(e):
            total += work.coupling[i, m] * work.compliance[m] * work.forces[m]
        for m in range(n):
            total -= work.crossing[m, i] * work.handed[m]
        work.load[i] += total
    for i in range(n):
        total = 0.0
        for m in range(e):
            total += work.rows[i, m] * work.compliance[m] * work.forces[m]
        for m in range(n):
            total -= work.yielding[i, m] * work.handed[m]
        work.given[i] = total
    for i in range(n):
        work.free[i] = dot(work.solver[i, n:], work.given)
    add_rows(work.through, work.free, 1.0, work.load)


@part
def _answer(work: Condensed, decoupled: Array, b: Array) -> None:
    """Elastic coordinates of a link whose ``motion`` is known, decoupled into ``forces``, and its own into ``b``."""
    n, e = len(work.free), len(b)
    add_rows(work.output, work.motion, 1.0, work.free)
    for i in range(n):
        work.given[i] = work.handed[i]
    add_rows(work.bound, work.free, 1.0, work.given)
    add_rows(work.bound_lead, work.motion, 1.0, work.given)
    for i in range(len(work.motion)):
        row, weight = work.coupling[i], work.motion[i]
        for m in range(e):
            work.forces[m] -= weight * row[m]
    for i in range(n):
        row, weight = work.rows[i], work.given[i]
        for m in range(e):
            work.forces[m] -= weight * row[m]
    for m in range(e):
        work.forces[m] *= work.compliance[m]
    clear(b)
    add_rows(decoupled, work.forces, 1.0, b)
