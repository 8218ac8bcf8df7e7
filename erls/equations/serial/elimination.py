"""(M + α C + β K) x = b solved link by link, from the tips inward and back; its cost grows with the number of links.

With the segments of `erls.equations.serial.segments` in decoupled coordinates W = 1 + α C_d + β K_d is diagonal, and a
full matrix only where the inertia of the modes changes. A link and all that it bears act on its parent with the force
F = H̃ m + h, m their motion without the joint's own. With g the motion of the parent, N and L stacked over all links
on it,

    x = W⁻¹ (b - Bᵀ g - Nᵀ F),   m = L g + N x,   so   (1 + G H̃) m = A g + N W⁻¹ b - G h,

G = N W⁻¹ Nᵀ and A = L - N W⁻¹ Bᵀ: m = Φ g + ..., and without its elastic coordinates the parent has the inertia
I - B W⁻¹ Bᵀ + Aᵀ H̃ Φ on g. Only s of the n numbers m, the ports, feel x: they stand first, and that alone is solved.
Then its joint goes (R. Featherstone, Rigid Body Dynamics Algorithms, ch. 7: articulated bodies).
What C has beside its diagonal in decoupled coordinates is left out. Numbers α, β may be complex.
"""

from __future__ import annotations

from typing import Any

from erls.equations.serial.condensed import CONDENSED, Condensed, read_condensed
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
from erls.maths.products import (
    add_columns,
    add_inner_products,
    add_rows,
    clear,
    clear_matrix,
    copy,
    copy_matrix,
    dot,
)
from erls.maths.so3 import Array
from erls.maths.symmetric import factor_symmetric, solve_symmetric
from fe_import.model import IntArray

_SINGULAR = 1e-14  # inertia along a joint against what it was before the elimination of the rest


@part
def invert(a: Array, out: Array) -> float:
    """The inverse of ``a`` (n, n), which is lost; -1.0 where a real determinant is negative."""
    n, sign = a.shape[0], 1.0
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            sign = -sign
            for j in range(n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
                out[k, j], out[pivot, j] = out[pivot, j], out[k, j]
        if a[k, k].real < 0.0:
            sign = -sign
        row, result, inverse = a[k], out[k], 1.0 / a[k, k]
        for j in range(n):
            row[j] *= inverse
            result[j] *= inverse
        for i in range(n):
            factor, other, changed = a[i, k], a[i], out[i]
            if i != k:
                for j in range(k + 1, n):
                    other[j] -= factor * row[j]
                for j in range(n):
                    changed[j] -= factor * result[j]
    return sign


@part
def _quadratic(matrix: Array, x: Array) -> Any:
    """xᵀ A x."""
    total = 0.0
    for i in range(len(x)):
        total += x[i] * dot(matrix[i], x)
    return total


@part
def _solve_modes(whole: Array, compliance: Array, x: Array) -> None:
    """Replace forces (e,) on decoupled coordinates by W⁻¹ times them."""
    if whole.shape[0] > 0:
        solve_symmetric(whole, x)
    else:
        for m in range(len(x)):
            x[m] *= compliance[m]


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
    n, p, s = len(work.moved), len(work.load), work.rows.shape[0]
    copy_matrix(own.coupling, work.coupling_solved)
    for i in range(p):
        _solve_modes(work.whole, work.compliance, work.coupling_solved[i])
    copy_matrix(own.inertia, work.articulated)
    add_inner_products(-1.0, work.coupling_solved, own.coupling, work.articulated)
    sign = 1.0
    if n > 0:
        copy_matrix(work.rows, work.rows_solved)
        for i in range(s):
            _solve_modes(work.whole, work.compliance, work.rows_solved[i])
        clear_matrix(work.yielding)
        clear_matrix(work.softened)
        clear_matrix(work.follow)
        clear_matrix(work.borne)
        add_inner_products(1.0, work.rows_solved, work.rows, work.yielding)
        add_inner_products(-1.0, own.coupling, work.rows_solved, work.lead)
        add_inner_products(1.0, work.yielding, work.bound, work.softened)
        for i in range(s):
            for j in range(s):
                work.square[i, j] = work.softened[i, j] + (1.0 if i == j else 0.0)
        sign = invert(work.square, work.solver)
        for i in range(p):
            row, remaining = work.lead[i], work.remaining[i]
            for j in range(s):
                remaining[j] = row[j] - dot(row[s:], work.softened[j, s:])
            for j in range(s, n):
                work.follow[i, j] = row[j]
        add_inner_products(1.0, work.remaining, work.solver, work.follow)
        add_inner_products(1.0, work.follow, work.bound, work.borne)
        add_inner_products(1.0, work.lead, work.borne, work.articulated)
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
        work.along[1] = 0.0
        if alpha == 0.0 and beta == 0.0:
            for i in range(len(work.compliance)):
                work.compliance[i] = 1.0
            continue
        for i in range(len(work.compliance)):
            whole = 1.0 + alpha * modes.decoupled_damping[i] + beta * modes.decoupled_stiffness[i]
            if not (whole.real > 0.0 or whole.imag != 0.0):
                return int(modes.first + i + 1)
            work.compliance[i] = 1.0 / whole
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
            for i in range(len(work.load)):
                place = place_of(work, i)
                for j in range(own.lead.shape[1]):
                    before.lead[j, place] = own.lead[i, j]
            copy_matrix(own.reach[: work.ports], before.rows[work.first :])
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
            for i in range(len(work.push) if work.parent >= 0 else 0):
                row, weight = work.articulated[i], work.push[i] / along
                for j in range(len(work.push)):
                    row[j] -= weight * work.push[j]
        if work.parent >= 0:
            bound = read_condensed(factors, integers, condensed + work.parent * CONDENSED).bound
            for i in range(len(work.load)):
                row = bound[place_of(work, i)]
                for j in range(len(work.load)):
                    row[place_of(work, j)] = (work.articulated[i, j] + work.articulated[j, i]) / 2
    return 0


@part
def place_of(work: Condensed, i: int) -> int:
    """Where number i of the motion of a link stands among those on its parent."""
    return (work.first if i < work.ports else work.rest) + i


@part
def _borne(own: Segment, work: Condensed) -> Any:
    """Inertia along a joint of what its link bears, were nothing elastic; before `condense`."""
    clear(work.given)
    add_columns(work.lead, own.subspace, 1.0, work.given)
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
                handed[place_of(work, i)] = work.load[i]
    for k in range(serial.links):
        work = read_condensed(factors, integers, condensed + k * CONDENSED)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        place = read_joint(reals, integers, serial.joints + k * JOINT).place
        clear(work.motion)
        if work.parent >= 0:
            moved = read_condensed(factors, integers, condensed + work.parent * CONDENSED).moved
            for i in range(len(work.motion)):
                work.motion[i] = moved[place_of(work, i)]
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
    s = work.rows.shape[0]
    given = work.given[:s]
    clear(work.forces)
    clear(work.load)
    clear(given)
    clear(work.moved)
    add_columns(decoupled, b, 1.0, work.forces)
    add_rows(work.coupling_solved, work.forces, 1.0, work.load)
    add_rows(work.rows_solved, work.forces, 1.0, given)
    add_rows(work.yielding, work.handed[:s], -1.0, given)
    add_rows(work.solver, given, 1.0, work.moved[:s])
    _pull(work)
    add_rows(work.lead, work.given, 1.0, work.load)
    _solve_modes(work.whole, work.compliance, work.forces)


@part
def _pull(work: Condensed) -> None:
    """H̃ m + h, with which the links on it pull at a link, into ``given``."""
    copy(work.handed, work.given)
    add_rows(work.bound, work.moved, 1.0, work.given)


@part
def _answer(work: Condensed, decoupled: Array, b: Array) -> None:
    """Elastic coordinates of a link whose ``motion`` is known, decoupled into ``forces``, and its own into ``b``."""
    add_columns(work.follow, work.motion, 1.0, work.moved)
    _pull(work)
    add_columns(work.coupling_solved, work.motion, -1.0, work.forces)
    add_columns(work.rows_solved, work.given[: work.rows.shape[0]], -1.0, work.forces)
    clear(b)
    add_rows(decoupled, work.forces, 1.0, b)
