"""(M + α C + β K) x = b solved link by link, from the tips inward and back; its cost grows with the number of links.

With the segments of `erls.equations.serial.segments` in decoupled coordinates W = 1 + α C_d + β K_d is diagonal, and a
full matrix only where the inertia of the modes changes. A link and all that it bears act on its parent with the force
F = H̃ m + h, m their motion without the joint's own. With g the motion of the parent, N and L stacked over all links
on it,

    x = W⁻¹ (b - Bᵀ g - Nᵀ F),   m = L g + N x,   so   (1 + G H̃) m = A g + N W⁻¹ b - G h,

G = N W⁻¹ Nᵀ and A = L - N W⁻¹ Bᵀ: m = Φ g + ..., and without its elastic coordinates the parent has the inertia
I - B W⁻¹ Bᵀ + Aᵀ H̃ Φ on g. Then its joint goes (R. Featherstone, Rigid Body Dynamics Algorithms, ch. 7: articulated
bodies). What C has beside its diagonal in decoupled coordinates is left out. Numbers α, β may be complex.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

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
from erls.maths.products import add_rows, clear, copy_matrix, dot
from erls.maths.records import reader, room, table_size
from erls.maths.so3 import Array
from erls.maths.symmetric import factor_symmetric, solve_symmetric
from fe_import.model import IntArray

_SINGULAR = 1e-14  # inertia along a joint against what it was before the elimination of the rest


class Condensed(NamedTuple):
    """A link in elimination: p numbers of motion, e elastic coordinates, n numbers of motion of the links on it.

    Attributes
    ----------
    parent, first : int
        Of the segment; where the motion of the link stands among those on its parent.
    compliance : (e,) array
        Inverse of the diagonal 1 + α C_d + β K_d.
    whole, diagonal : (e, e), (e,) arrays
        Factors of W where it is no diagonal; otherwise (0, 0).
    rows, rows_solved : (n, e) arrays
        N and N W⁻¹.
    coupling_solved : (p, e) array
        B W⁻¹.
    bound : (n, n) array
        H̃ of the links on it.
    yielding : (n, n) array
        G.
    solver : (n, 2 n) array
        Right half: (1 + G H̃)⁻¹.
    lead, follow : (n, p) arrays
        A and Φ.
    articulated : (p, p) array
        Inertia on g; at last without its joint, H̃.
    subspace, push : (p,) arrays
        S of the segment, and articulated inertia times S.
    along : (2,) array
        Inertia along the joint, and what stiffness and damping add to it.
    forces : (e,) array
        Forces on decoupled coordinates, then these themselves.
    handed, moved, given : (n,) arrays
        h; m; spare.
    load, motion : (p,) arrays
        Force of the link on its parent at m = 0; g.
    """

    parent: int
    first: int
    compliance: Annotated[Array, "e"]
    whole: Annotated[Array, "f f"]
    diagonal: Annotated[Array, "f"]
    rows: Annotated[Array, "n e"]
    rows_solved: Annotated[Array, "n e"]
    coupling_solved: Annotated[Array, "p e"]
    bound: Annotated[Array, "n n"]
    yielding: Annotated[Array, "n n"]
    solver: Annotated[Array, "n n+n"]
    lead: Annotated[Array, "n p"]
    follow: Annotated[Array, "n p"]
    articulated: Annotated[Array, "p p"]
    subspace: Annotated[Array, "p"]
    push: Annotated[Array, "p"]
    along: Annotated[Array, "2"]
    forces: Annotated[Array, "e"]
    handed: Annotated[Array, "n"]
    moved: Annotated[Array, "n"]
    given: Annotated[Array, "n"]
    load: Annotated[Array, "p"]
    motion: Annotated[Array, "p"]


def condensed(own: list[Segment]) -> list[Condensed]:
    """Memory for all links."""
    on = [0] * len(own)  # numbers of motion of the links on each
    firsts: list[int] = []
    for link in own:
        firsts.append(on[link.parent] if link.parent >= 0 else 0)
        if link.parent >= 0:
            on[link.parent] += len(link.pull)
    return [_condensed(link, n, first) for link, n, first in zip(own, on, firsts, strict=True)]


def _condensed(own: Segment, n: int, first: int) -> Condensed:
    p, e = own.coupling.shape
    return room(Condensed, parent=own.parent, first=first, e=e, f=e if len(own.change) else 0, n=n, p=p)


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
def _solve_modes(work: Condensed, x: Array) -> None:
    """Replace forces (e,) on decoupled coordinates by W⁻¹ times them."""
    if work.whole.shape[0] > 0:
        solve_symmetric(work.whole, x)
    else:
        for m in range(len(x)):
            x[m] *= work.compliance[m]


@part
def _set_whole(own: Segment, work: Condensed, definite: bool) -> int:
    """Factors of W where the inertia of the modes changes; 0, or 1 + the number of a mode that nothing resists."""
    e = work.whole.shape[0]
    work.whole[:, :] = 0.0
    for m in range(e):
        work.whole[m, m] = 1.0 / work.compliance[m]
    for r in range(own.change.shape[0]):
        for i in range(e):
            left, right = own.change[r, i] / 2, own.partner[r, i] / 2
            for j in range(i, e):
                work.whole[i, j] += left * own.partner[r, j] + right * own.change[r, j]
    return int(factor_symmetric(work.whole, work.diagonal, definite))


@part
def condense(own: Segment, work: Condensed) -> float:
    """Take the elastic coordinates of a link out of its ``articulated`` inertia; the sign of `invert`.

    L, N and H̃ of the links on it stand in ``lead``, ``rows`` and ``bound`` already, W in ``compliance`` or ``whole``.
    """
    n, p = work.rows.shape[0], len(work.load)
    copy_matrix(own.coupling, work.coupling_solved)
    for i in range(p):
        _solve_modes(work, work.coupling_solved[i])
        for j in range(p):
            work.articulated[i, j] = own.inertia[i, j] - dot(work.coupling_solved[i], own.coupling[j])
    if n == 0:
        return 1.0
    copy_matrix(work.rows, work.rows_solved)
    for i in range(n):
        _solve_modes(work, work.rows_solved[i])
        for j in range(i + 1):
            work.yielding[i, j] = work.yielding[j, i] = dot(work.rows_solved[i], work.rows[j])
        for j in range(p):
            work.lead[i, j] -= dot(work.rows_solved[i], own.coupling[j])
    work.solver[:, :] = 0.0
    for i in range(n):
        row = work.solver[i]
        row[i] = 1.0
        for m in range(n):
            weight, other = work.yielding[i, m], work.bound[m]
            for j in range(n):
                row[j] += weight * other[j]
    sign = invert(work.solver)
    work.follow[:, :] = 0.0
    for i in range(n):
        row = work.follow[i]
        for m in range(n):
            weight, other = work.solver[i, n + m], work.lead[m]
            for j in range(p):
                row[j] += weight * other[j]
    for m in range(n):  # Aᵀ H̃ Φ, row after row of H̃ Φ
        row = work.motion
        clear(row)
        for j in range(n):
            weight, other = work.bound[m, j], work.follow[j]
            for i in range(p):
                row[i] += weight * other[i]
        for i in range(p):
            weight, result = work.lead[m, i], work.articulated[i]
            for j in range(p):
                result[j] += weight * row[j]
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
        for i in range(len(work.subspace)):
            work.subspace[i] = own.subspace[i]
        work.bound[:, :] = 0.0
        if work.parent >= 0:
            before = read_condensed(factors, integers, condensed + work.parent * CONDENSED)
            copy_matrix(own.lead, before.lead[work.first :])
            copy_matrix(own.reach, before.rows[work.first :])
    for k in range(serial.links - 1, -1, -1):
        own = read_segment(scratch, integers, segments + k * SEGMENT)
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        resisting = 0.0  # before elimination
        if joint.place >= 0:
            resisting = abs(_quadratic(own.inertia, own.subspace)) + _borne(own, work)
        if work.whole.shape[0] > 0:
            status = _set_whole(own, work, definite)
            if status != 0:
                return int(read_modes(reals, integers, serial.modes + k * MODES).first + status)
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
            bound = read_condensed(factors, integers, condensed + work.parent * CONDENSED).bound
            for i in range(len(work.load)):
                for j in range(len(work.load)):
                    bound[work.first + i, work.first + j] = work.articulated[i, j]
    return 0


@part
def _borne(own: Segment, work: Condensed) -> Any:
    """Inertia along a joint of what its link bears, were nothing elastic; before `condense`."""
    for i in range(len(work.given)):
        work.given[i] = dot(work.lead[i], own.subspace)
    return abs(_quadratic(work.bound, work.given))


@part
def substitute(serial: Serial, condensed: int, reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """Replace ``b`` by the solution, after `eliminate`."""
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
            handed = read_condensed(factors, integers, condensed + work.parent * CONDENSED).handed
            for i in range(len(work.load)):
                handed[work.first + i] = work.load[i]
    for k in range(serial.links):
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        place = read_joint(reals, integers, serial.joints + k * JOINT).place
        clear(work.motion)
        if work.parent >= 0:
            moved = read_condensed(factors, integers, condensed + work.parent * CONDENSED).moved
            for i in range(len(work.motion)):
                work.motion[i] = moved[work.first + i]
        if place >= 0:
            b[place] = (b[place] - dot(work.push, work.motion)) / work.along[0]
            for i in range(len(work.motion)):
                work.motion[i] += work.subspace[i] * b[place]
        _answer(work, modes.decoupled, b[modes.first : modes.first + len(work.forces)])


@part
def _collect(work: Condensed, decoupled: Array, b: Array) -> None:
    """``load`` by the forces on elastic coordinates and by ``handed``; ``forces`` on decoupled ones, W⁻¹ times them.

    ``moved`` is what they make of m at g = 0.
    """
    n, e = len(work.moved), len(b)
    clear(work.forces)
    for i in range(e):  # Vᵀ b
        row, weight = decoupled[i], b[i]
        for j in range(e):
            work.forces[j] += weight * row[j]
    clear(work.load)
    add_rows(work.coupling_solved, work.forces, 1.0, work.load)
    clear(work.given)
    add_rows(work.rows_solved, work.forces, 1.0, work.given)
    add_rows(work.yielding, work.handed, -1.0, work.given)
    for i in range(n):
        work.moved[i] = dot(work.solver[i, n:], work.given)
    for i in range(n):  # Aᵀ (H̃ m + h)
        weight, row = work.handed[i] + dot(work.bound[i], work.moved), work.lead[i]
        for j in range(len(row)):
            work.load[j] += weight * row[j]
    _solve_modes(work, work.forces)


@part
def _answer(work: Condensed, decoupled: Array, b: Array) -> None:
    """Elastic coordinates of a link whose ``motion`` is known, decoupled into ``forces``, and its own into ``b``."""
    n, e = len(work.moved), len(b)
    add_rows(work.follow, work.motion, 1.0, work.moved)
    for i in range(len(work.motion)):
        row, weight = work.coupling_solved[i], work.motion[i]
        for m in range(e):
            work.forces[m] -= weight * row[m]
    for i in range(n):
        row, weight = work.rows_solved[i], work.handed[i] + dot(work.bound[i], work.moved)
        for m in range(e):
            work.forces[m] -= weight * row[m]
    clear(b)
    add_rows(decoupled, work.forces, 1.0, b)
