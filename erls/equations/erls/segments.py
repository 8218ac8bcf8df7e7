"""What ERLS says of its links at a configuration (`erls.equations.serial.segments`).

The motion of a link is μ = (w, ω), w = ν + u̇ six numbers, ω about the axes of the link; with second-order displacements
μ = (w, φ̇, ω), w = ν + u̇ + ė and φ the turn in u: then inertia knows (W, Ω) = w and ω with M₀⁻¹ (C q̇ + H ν) added. A
link on the ground moves along its joint alone, of which u and φ are zero: without second-order displacements μ = (θ̇).
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.frames import place_frames
from erls.equations.erls.link_forces import deform, pair_of
from erls.equations.erls.records import (
    BEND,
    BEND_STATE,
    CHANGE,
    LINK,
    LINK_STATE,
    Bend,
    BendState,
    Chain,
    Change,
    Link,
    LinkState,
    read_bend,
    read_bend_state,
    read_chain,
    read_change,
    read_link,
    read_link_state,
)
from erls.equations.erls.second_order import bend_frames, curve_inertia, set_arm
from erls.equations.serial.records import (
    JOINT_STATE,
    MODES,
    Serial,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.equations.serial.segments import SEGMENT, Segment, fill_mass_matrix, read_segment
from erls.maths.jit import part
from erls.maths.products import add_columns, add_product, add_transposed_product, clear, copy_matrix
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, add_motion_cross, dot3, dot6, transform_motion
from fe_import.model import IntArray


@part
def _own_inertia(chain: Chain, mass: Array, axes: Array, turned: Array, moments: Array, inertia: Array) -> None:
    """Inertia over (w, ω) with the elastic coordinates held; ω about the axes, its rows and columns last."""
    first = inertia.shape[0] - len(axes)
    inertia[:, :] = 0.0
    for i in range(6):
        for j in range(6):
            inertia[i, j] = mass[i, j]
    for a in range(len(axes)):
        if chain.first_order:
            # X q about the axis meets w; and w as ω turns the frame
            for i in range(6):
                inertia[i, first + a] = inertia[first + a, i] = turned[a, i]
        if chain.second_order:
            for b in range(len(axes)):
                inertia[first + a, first + b] = moments[pair_of(len(axes), a, b)]


@part
def _linear_inertia(chain: Chain, link: Link, state: LinkState, own: Segment, decoupled: Array, turns: bool) -> None:
    _own_inertia(chain, link.mass, link.axes, state.turned, state.moments, own.inertia)
    _couple(chain, link, state, decoupled, turns, len(own.pull) - len(link.axes), own.coupling)


@part
def _turn_row(row: Array, decoupled: Array, out: Array) -> None:
    """A row over elastic coordinates, over decoupled ones."""
    clear(out)
    add_columns(decoupled, row, 1.0, out)


@part
def _grounded_inertia(
    chain: Chain, link: Link, state: LinkState, own: Segment, screw: Array, decoupled: Array, turns: bool
) -> None:
    """Inertia and coupling over the rate θ̇ of a joint on the ground, with w = S θ̇."""
    axes, coupling, momentum, shared = len(link.axes), own.coupling[0], state.point, state.speeds[6:]
    clear(coupling)
    clear(momentum)
    clear(shared)  # of what is not decoupled yet
    for i in range(6):
        weight = screw[i]
        if weight != 0.0:
            for j in range(6):
                momentum[j] += weight * link.mass[i, j]
            row = link.rigid_decoupled[i] if turns else link.mass[i, 6:]
            for j in range(len(coupling)):
                coupling[j] += weight * row[j]
    inertia = dot6(momentum, screw)
    for a in range(axes):
        spin = dot3(link.axes[a], screw[3:])
        if chain.first_order:
            turned = state.turned[a]
            inertia += 2.0 * spin * dot6(turned, screw)
            for j in range(len(shared)):
                shared[j] += spin * turned[6 + j]
        if chain.second_order:
            for b in range(axes):
                inertia += spin * dot3(link.axes[b], screw[3:]) * state.moments[pair_of(axes, a, b)]
    own.inertia[0, 0] = inertia
    if chain.first_order:
        if turns:
            add_columns(decoupled, shared, 1.0, coupling)
        else:
            for j in range(len(coupling)):
                coupling[j] += shared[j]


@part
def _couple(
    chain: Chain, link: Link, state: LinkState, decoupled: Array, turns: bool, first: int, coupling: Array
) -> None:
    """B over (w, ω), rows of ω from number ``first`` on."""
    e = coupling.shape[1]
    for i in range(6, first):
        for j in range(e):
            coupling[i, j] = 0.0
    for i in range(6):
        for j in range(e):
            coupling[i, j] = link.rigid_decoupled[i, j] if turns else link.mass[i, 6 + j]
    for a in range(len(link.axes)):
        if chain.first_order:
            if turns:
                _turn_row(state.turned[a, 6:], decoupled, coupling[first + a])
            else:
                for j in range(e):
                    coupling[first + a, j] = state.turned[a, 6 + j]


@part
def _curved_inertia(
    chain: Chain, link: Link, bend: Bend, state: LinkState, bent: BendState, own: Segment, work: Change,
    decoupled: Array, turns: bool,
) -> None:  # fmt: skip
    """Inertia, coupling, ``change`` and ``partner`` of a link whose inertia has second-order terms."""
    p, e, spins = len(own.pull), own.coupling.shape[1], bend.axes
    last = p - len(spins)
    _pull(bend, bent)
    _own_inertia(chain, link.mass, link.axes, state.turned, state.moments, work.inertia)
    _couple(chain, link, state, decoupled, False, 6, work.coupling)
    work.map[:, :] = 0.0
    for i in range(6):
        work.map[i, i] = 1.0
        for c in range(bend.turns):  # turns of q are those of w less ω
            work.map[i, 3 + c] += bent.pulls[i, c]
        for a in range(len(spins)):
            total = dot3(bent.turning[i], spins[a])
            for c in range(bend.turns):
                total -= bent.pulls[i, c] * spins[a, c]
            work.map[i, last + a] = total
    for i in range(3):
        for j in range(p):
            work.map[6 + i, j] = work.map[3 + i, j]
        work.map[6 + i, 3 + i] -= 1.0
        for a in range(len(spins)):
            work.map[6 + i, last + a] += spins[a, i]
    copy_matrix(work.coupling, work.whole)
    for r in range(6):
        for j in range(e):
            made = bent.pulls[r, bend.turns + j]
            own.change[r, j] = made
            for i in range(9):
                work.whole[i, j] += work.inertia[i, r] * made
                if r >= 3:
                    work.whole[i, j] += work.inertia[i, 3 + r] * made
    for r in range(6):
        for j in range(e):
            own.partner[r, j] = work.whole[r, j] + work.coupling[r, j]
            if r >= 3:
                own.partner[r, j] += work.whole[3 + r, j] + work.coupling[3 + r, j]
    work.product[:, :] = 0.0
    own.inertia[:, :] = 0.0
    own.coupling[:, :] = 0.0
    add_product(work.inertia, work.map, work.product)
    add_transposed_product(work.map, work.product, own.inertia)
    add_transposed_product(work.map, work.whole, own.coupling)
    if turns:
        _turn_rows(own.coupling, decoupled, bent.spare)
        _turn_rows(own.change, decoupled, bent.spare)
        _turn_rows(own.partner, decoupled, bent.spare)


@part
def _turn_rows(rows: Array, decoupled: Array, spare: Array) -> None:
    """Rows over elastic coordinates become those over decoupled ones."""
    e = rows.shape[1]
    for i in range(rows.shape[0]):
        for j in range(e):
            spare[j] = rows[i, j]
        _turn_row(spare[:e], decoupled, rows[i])


@part
def _pull(bend: Bend, bent: BendState) -> None:
    """``turning`` and ``pulls``: M₀⁻¹ H on ω and M₀⁻¹ C."""
    s, m = bent.moment, len(bent.x)
    bent.pulls[:, :] = 0.0
    for r in range(6):
        row, turning = bend.compliance[r], bent.turning[r]
        clear(turning)
        add_cross(s, row, 1.0, turning)  # of -S × ω
        for a in range(len(bend.axes)):
            total = 0.0
            for c in range(3):
                total += row[3 + c] * bent.spin[3 * a + c]
            for i in range(3):
                turning[i] += total * bend.axes[a, i]
        for c in range(6):
            for j in range(m):
                bent.pulls[r, j] += row[c] * bent.rows[c, j]


@part
def _turned_back(pose: Array, x: Array, out: Array) -> None:
    """Rᵀ x of a vector (3,) that may be a column of a matrix."""
    for i in range(3):
        out[i] = pose[i] * x[0] + pose[3 + i] * x[1] + pose[6 + i] * x[2]


@part
def _lead(
    pose: Array, axes: Array, axes_before: Array, screw_before: Array, out: Array, state: LinkState, own: Segment,
    bends: Any,
) -> None:  # fmt: skip
    """L and N as far as they are of first order."""
    p, before, x = len(own.pull), own.lead.shape[1], state.point
    own.lead[:, :] = 0.0
    own.reach[:, :] = 0.0
    if before == 1:
        transform_motion(pose, screw_before, x)
        for i in range(6):
            own.lead[i, 0] = x[i]
        for a in range(len(axes)):
            own.lead[p - len(axes) + a, 0] = dot3(axes[a], x[3:])
    for j in range(6 if before > 1 else 0):
        for i in range(6):
            x[i] = 1.0 if i == j else 0.0
        transform_motion(pose, x, x)
        for i in range(6):
            own.lead[i, j] = x[i]
    if bends is not None:
        for i in range(3):
            for j in range(3):
                own.lead[6 + i, 6 + j] = pose[3 * j + i]
    for b in range(len(axes_before) if before > 1 else 0):
        _turned_back(pose, axes_before[b], x)
        for a in range(len(axes)):
            own.lead[p - len(axes) + a, before - len(axes_before) + b] = dot3(axes[a], x)
    for j in range(len(out)):
        transform_motion(pose, out[j], x)
        for i in range(6):
            own.reach[i, j] = x[i]
        if bends is not None:
            for i in range(3):
                own.reach[6 + i, j] = x[3 + i]


@part
def _bow(pose: Array, bent: BendState, state: LinkState, own: Segment, decoupled: Array, turns: bool) -> None:
    """Second-order motion of the parent's interface, in L and N."""
    e, m, x = own.reach.shape[1], bent.bow.shape[1], state.point
    kept = m - e
    for c in range(kept):
        for i in range(6):
            x[i] = bent.bow[i, c]
        transform_motion(pose, x, x)
        for i in range(6):
            own.lead[i, 6 + c] += x[i]
    for i in range(6):
        if turns:
            _turn_row(bent.bow[i, kept:], decoupled, bent.spare[:e])
        else:
            for j in range(e):
                bent.spare[j] = bent.bow[i, kept + j]
        for j in range(e):
            bent.bow_rate[i, j] = bent.spare[j]
    for j in range(e):
        for i in range(6):
            x[i] = bent.bow_rate[i, j]
        transform_motion(pose, x, x)
        for i in range(6):
            own.reach[i, j] += x[i]


@part
def _arm(bend: Bend, state: LinkState, bent: BendState, coordinate: Array, own: Segment) -> None:
    """½ (φ̇ × b + φ × (φ̇ × d)) of the arm to the joint, in L, N and S."""
    d, b, phi = bent.d, bent.b, state.u[3:]
    set_arm(bend.slide, bend.arm, coordinate[0], phi, d, b)
    for matrix in (own.lead, own.reach):
        for j in range(matrix.shape[1]):
            _arm_column(d, b, phi, matrix[:, j])
    _arm_column(d, b, phi, own.subspace)


@part
def _arm_column(d: Array, b: Array, phi: Array, column: Array) -> None:
    p, q, r = column[6], column[7], column[8]
    c0, c1, c2 = q * d[2] - r * d[1], r * d[0] - p * d[2], p * d[1] - q * d[0]
    column[0] += (q * b[2] - r * b[1] + phi[1] * c2 - phi[2] * c1) / 2
    column[1] += (r * b[0] - p * b[2] + phi[2] * c0 - phi[0] * c2) / 2
    column[2] += (p * b[1] - q * b[0] + phi[0] * c1 - phi[1] * c0) / 2


@part
def _subspace(screw: Array, axes: Array, attached: bool, state: LinkState, own: Segment) -> None:
    """S: (S - ad(S) u, S_ω) as far as it is of first order."""
    p, s = len(own.pull), own.subspace
    clear(s)
    if attached:
        add_motion_cross(state.u, screw, 1.0, s)
        if p - len(axes) > 6:
            for i in range(3):
                s[6 + i] = s[3 + i]
    for i in range(6):
        s[i] += screw[i]
    for a in range(len(axes)):
        s[p - len(axes) + a] = dot3(axes[a], screw[3:])


@part
def _turn_along(bend: Bend, state: LinkState, bent: BendState, screw: Array, own: Segment) -> None:
    """What S has of second order: the joint turns the displacement along, and a slide the arm."""
    add_motion_cross(bent.carried, screw, 1.0, own.subspace)
    if bend.armed:
        clear(bent.b)
        add_cross(state.u[3:], bend.slide, 1.0, bent.b)
        add_cross(state.u[3:], bent.b, 0.5, own.subspace)


@part
def set_segments(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, turns: bool,
    placed: bool, bends: Any,
) -> None:  # fmt: skip
    """Segments of all links, over their elastic coordinates, or over decoupled ones where ``turns``.

    ``placed``: the forces out of balance were asked for at this place just before, which deformed the links.
    """
    if not placed:
        place_frames(serial, chain, reals, integers, scratch, t, y, y, y[0:0])
        if bends is not None:
            bend_frames(serial, chain, reals, integers, scratch, False)
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        own = read_segment(scratch, integers, chain.segments + k * SEGMENT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        decoupled = read_modes(reals, integers, serial.modes + k * MODES).decoupled
        if not placed:
            deform(chain, link, state)
        axes = link.axes
        if bends is not None:
            bend = read_bend(reals, integers, chain.bends + k * BEND)
            bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
            axes = bend.axes
            if bend.curved:
                work = read_change(scratch, integers, chain.changes + k * CHANGE)
                if not placed:
                    curve_inertia(bend, state, bent)
                _curved_inertia(chain, link, bend, state, bent, own, work, decoupled, turns)
            else:
                _linear_inertia(chain, link, state, own, decoupled, turns)
        elif link.parent < 0:
            _grounded_inertia(chain, link, state, own, motion.screw, decoupled, turns)
        else:
            _linear_inertia(chain, link, state, own, decoupled, turns)
        if len(own.subspace) == 1:
            own.subspace[0] = 1.0
        else:
            _subspace(motion.screw, axes, link.parent >= 0, state, own)
        if link.parent >= 0:
            axes_before = read_link(reals, integers, chain.links + link.parent * LINK).axes
            if bends is not None:
                axes_before = read_bend(reals, integers, chain.bends + link.parent * BEND).axes
            out = link.out_decoupled if turns else link.out
            before = read_joint_state(scratch, integers, serial.joint_states + link.parent * JOINT_STATE)
            _lead(motion.pose, axes, axes_before, before.screw, out, state, own, bends)
            if bends is not None:
                bend = read_bend(reals, integers, chain.bends + k * BEND)
                bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
                modes_before = read_modes(reals, integers, serial.modes + link.parent * MODES).decoupled
                _turn_along(bend, state, bent, motion.screw, own)
                if bend.bows:
                    _bow(motion.pose, bent, state, own, modes_before, turns)
                if bend.armed:
                    _arm(bend, state, bent, motion.coordinate, own)


@part
def fill(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array, bends: Any) -> None:
    """M; ``bends`` as in `erls.equations.erls.balance`."""
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    set_segments(serial, chain, reals, integers, scratch, t, y, False, False, bends)
    fill_mass_matrix(serial, chain.segments, reals, integers, scratch, out)
