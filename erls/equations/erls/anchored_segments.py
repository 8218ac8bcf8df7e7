"""Links of anchored chains as segments of `erls.equations.serial.segments`: μ is the twist w of the link's frame.

With W = w + M₀⁻¹ (C q̇ + H w) = Z w + E q̇ in the kinetic energy ½ Wᵀ I W + Wᵀ B q̇ + ½ q̇ᵀ M_ee q̇ of the linear modes, the
inertia is Zᵀ I Z, the coupling Zᵀ (I E + B) and F = I E + 2 B; modal inertia adds rows of its own. A link on the ground
without second-order displacements moves along its joint alone: μ = (θ̇).
"""

from __future__ import annotations

from erls.equations.erls.anchored_frames import place_anchored
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
from erls.equations.erls.second_order import curve_inertia
from erls.equations.erls.segments import grounded_inertia, turn_row
from erls.equations.serial.modal_inertia_kernels import (
    WARP,
    WARP_STATE,
    read_warp,
    read_warp_state,
    set_warp,
    warp_rows,
)
from erls.equations.serial.nodes import NODE, NODE_STATE, node_moves, read_node, read_node_state
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
from erls.maths.products import add_product, add_transposed_product, copy, copy_matrix
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, transform_motion
from fe_import.model import IntArray


@part
def _turn_rows(rows: Array, decoupled: Array, spare: Array) -> None:
    """Rows over elastic coordinates become those over decoupled ones."""
    e = rows.shape[1]
    for i in range(rows.shape[0]):
        for j in range(e):
            spare[j] = rows[i, j]
        turn_row(spare[:e], decoupled, rows[i])


@part
def _linear_inertia(chain: Chain, link: Link, state: LinkState, inertia: Array, coupling: Array) -> None:
    """I and B over w, of the linear modes."""
    axes, e = link.axes, coupling.shape[1]
    for i in range(6):
        for j in range(6):
            inertia[i, j] = link.mass[i, j]
        for j in range(e):
            coupling[i, j] = link.mass[i, 6 + j]
    for a in range(len(axes)):
        turned = state.turned[a]
        for c in range(3):
            along = axes[a, c]
            if along != 0.0:
                if chain.first_order:
                    for i in range(6):
                        inertia[i, 3 + c] += along * turned[i]
                        inertia[3 + c, i] += along * turned[i]
                    for j in range(e):
                        coupling[3 + c, j] += along * turned[6 + j]
                if chain.second_order:
                    for b in range(len(axes)):
                        moment = along * state.moments[pair_of(len(axes), a, b)]
                        for d in range(3):
                            inertia[3 + c, 3 + d] += moment * axes[b, d]


@part
def _pull(bend: Bend, bent: BendState, work: Change, change: Array) -> None:
    """Z = 1 + M₀⁻¹ H and E = M₀⁻¹ C."""
    s, e = bent.moment, bent.rows.shape[1]
    for r in range(6):
        row, line, made = bend.compliance[r], work.map[r], change[r]
        for i in range(6):
            line[i] = 1.0 if i == r else 0.0
        add_cross(s, row, 1.0, line[3:])  # of -S × ω
        for a in range(len(bend.axes)):
            total = 0.0
            for c in range(3):
                total += row[3 + c] * bent.spin[3 * a + c]
            for i in range(3):
                line[3 + i] += total * bend.axes[a, i]
        for j in range(e):
            made[j] = 0.0
        for c in range(6):
            for j in range(e):
                made[j] += row[c] * bent.rows[c, j]


@part
def _bent_inertia(
    chain: Chain, link: Link, bend: Bend, state: LinkState, bent: BendState, own: Segment, work: Change
) -> None:
    """Inertia, coupling, ``change`` and ``partner`` of a link with second-order displacements."""
    e = own.coupling.shape[1]
    _pull(bend, bent, work, own.change)
    _linear_inertia(chain, link, state, work.inertia, work.coupling)
    copy_matrix(work.coupling, work.whole)
    add_product(work.inertia, own.change[:6], work.whole)
    for r in range(6):
        for j in range(e):
            own.partner[r, j] = work.whole[r, j] + work.coupling[r, j]
    work.product[:, :] = 0.0
    own.inertia[:, :] = 0.0
    own.coupling[:, :] = 0.0
    add_product(work.inertia, work.map, work.product)
    add_transposed_product(work.map, work.product, own.inertia)
    add_transposed_product(work.map, work.whole, own.coupling)


@part
def _lead(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, own: Segment, turns: bool
) -> None:
    """L and N of a link on another one."""
    pose = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose
    seat = read_node(reals, integers, chain.seats + k * NODE)
    moved = read_node_state(scratch, integers, chain.seat_states + k * NODE_STATE)
    x = read_link_state(scratch, integers, chain.states + k * LINK_STATE).point
    before = own.lead.shape[1]
    for j in range(before):
        if before == 1:
            copy(read_joint_state(scratch, integers, serial.joint_states + own.parent * JOINT_STATE).screw, x)
        else:
            for i in range(6):
                x[i] = 1.0 if i == j else 0.0
        if seat.moves:
            transform_motion(moved.pose, x, x)
        transform_motion(pose, x, x)
        for i in range(6):
            own.lead[i, j] = x[i]
    if seat.moves:
        node_moves(moved)
        for j in range(own.reach.shape[1]):
            for i in range(6):
                x[i] = moved.moves[i, j]
            transform_motion(pose, x, x)
            for i in range(6):
                own.reach[i, j] = x[i]
        if turns:
            modes = read_modes(reals, integers, serial.modes + own.parent * MODES).decoupled
            spare = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE).spare
            _turn_rows(own.reach, modes, spare)


@part
def set_anchored_segments(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, turns: bool,
    placed: bool,
) -> None:  # fmt: skip
    """As `erls.equations.erls.segments.set_segments`."""
    if not placed:
        place_anchored(serial, chain, reals, integers, scratch, t, y, y, y[0:0])
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        bend = read_bend(reals, integers, chain.bends + k * BEND)
        bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
        own = read_segment(scratch, integers, chain.segments + k * SEGMENT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        decoupled = read_modes(reals, integers, serial.modes + k * MODES).decoupled
        if not placed:
            deform(chain, link, state)
        if bend.curved:
            if not placed:
                curve_inertia(bend, state, bent)
            work = read_change(scratch, integers, chain.changes + k * CHANGE)
            _bent_inertia(chain, link, bend, state, bent, own, work)
            if bend.warped:
                warp = read_warp(reals, integers, chain.warps + k * WARP)
                warp_state = read_warp_state(scratch, integers, chain.warp_states + k * WARP_STATE)
                if not placed:
                    set_warp(warp, warp_state, state.q[6:])
                warp_rows(warp, warp_state, own.change[6:], own.partner[6:])
            if turns:
                _turn_rows(own.coupling, decoupled, bent.spare)
                _turn_rows(own.change, decoupled, bent.spare)
                _turn_rows(own.partner, decoupled, bent.spare)
        elif len(own.subspace) == 1:
            grounded_inertia(chain, link, state, own, motion.screw, decoupled, turns)
        else:
            _linear_inertia(chain, link, state, own.inertia, own.coupling)
            if turns:
                _turn_rows(own.coupling, decoupled, bent.spare)
        if len(own.subspace) == 1:
            own.subspace[0] = 1.0
        else:
            copy(motion.screw, own.subspace)
        if own.parent >= 0:
            _lead(serial, chain, reals, integers, scratch, k, own, turns)


@part
def fill_anchored(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M."""
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    set_anchored_segments(serial, chain, reals, integers, scratch, t, y, False, False)
    fill_mass_matrix(serial, chain.segments, reals, integers, scratch, out)
