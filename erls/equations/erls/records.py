"""ERLS in the joint-angle gauge as records: constants and working memory of a link.

The mode shapes of each link are combined once and for all into six rigid ones, ρ, and elastic ones that leave its
inboard interface where it is, Ψ = [D; 1] with D = -A_r⁻¹ A_e. Then q = ρ u + Ψ q_d, where u is the displacement of the
link's frame, a small motion [translation; rotation]. With e elastic modes n = 6 + e counts the coordinates (u, q_d).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from erls.equations.serial.loads import LOADS
from erls.maths.calls import caller
from erls.maths.records import Matrix, Stack, reader, room, table_size
from erls.maths.so3 import Array

call_loads = caller(LOADS, "erls.equations.erls.loads:loads")


class Chain(NamedTuple):
    """Where the records of links begin, and which effects act.

    Attributes
    ----------
    links, states : int
        Places of the first `Link` and `LinkState`.
    bends, bend_states : int
        Places of the first `Bend` and `BendState`; -1 without second-order displacements.
    seats, seat_states, warps, warp_states : int
        Likewise of `erls.equations.serial.nodes`: for each link the interface of its parent that its joint stands on;
        and of `erls.equations.serial.modal_inertia_kernels`.
    segments, changes, condensed : int
        Places of the first records of `erls.equations.serial.segments`, of `Change` and of
        `erls.equations.serial.condensed`.
    factors, left : int
        Where in working memory the factors of an acceleration lie, and what it leaves of the forces.
    first_order, second_order, coriolis, centrifugal, softening : int
        Effects of `erls.mechanism.effects`, 0 or 1.
    weight : int
        Whether gravity acts.
    complete : int
        Whether wrenches are, also where no joint feels them.
    end_count, ends, end_states : int
        How many frames loops hold on links, and places of the first `End` and `EndState`.
    """

    links: int
    states: int
    bends: int
    bend_states: int
    seats: int
    seat_states: int
    warps: int
    warp_states: int
    segments: int
    changes: int
    condensed: int
    factors: int
    left: int
    first_order: int
    second_order: int
    coriolis: int
    centrifugal: int
    softening: int
    weight: int
    complete: int
    end_count: int
    ends: int
    end_states: int


class Link(NamedTuple):
    """Constants of a link.

    Attributes
    ----------
    parent : int
        -1 on the ground.
    axes : (A, 3) array
        Unit vectors about which its frame can turn, in its own axes: one when that is constant, none for a link that
        only slides, otherwise three.
    mass : (n, n) array
        [ρ Ψ]ᵀ m [ρ Ψ].
    x : (A, n, n) array
        X about each axis, projected likewise; column after column.
    z : (A (A + 1) / 2, n, n) array
        Z of each pair of axes, symmetric part, projected likewise; pairs 00, 11, 22, 01, 02, 12.
    out : (e of the parent, 6) array
        C: what the parent's interface moves, as a motion of the parent's frame, per elastic coordinate.
    rigid_decoupled, out_decoupled : (6, e), (e of the parent, 6) arrays
        M_re V and C V, see `erls.equations.serial.records.Modes`.
    """

    parent: int
    axes: Matrix
    mass: Matrix
    x: Stack
    z: Stack
    out: Matrix
    rigid_decoupled: Matrix
    out_decoupled: Matrix


class LinkState(NamedTuple):
    """Working memory of a link; motions and forces are in its own axes, about the origin of its frame.

    Attributes
    ----------
    u, u_rate, u_acceleration : (6,) arrays
        Displacement of the frame, linear in the elastic coordinates, and derivatives.
    twist, twist_rate : (6,) arrays
        ν of the frame of the rigid link.
    w, w_rate : (6,) arrays
        ν + u̇ as inertia knows it, and its derivative. Where equivalent rigid links are anchored at every instant
        (`erls.equations.erls.anchored_frames`), u and its derivatives are zero, and the twist is w.
    down : (3,) array
        Gravity.
    wrench, force : (6,) arrays
        Out of balance on virtual ν and on virtual u; after a residual with all that the link bears.
    momentum : (6,) array
        ∂T/∂ν.
    point, other : (6,) arrays
        Spare.
    moments : (6,) array
        qᵀ Z q of each pair of axes.
    q, q_rate, q_acceleration : (n,) arrays
        (u, q_d) and derivatives.
    modal : (n,) array
        Out of balance on them.
    speeds : (n,) array
        Spare.
    turned, turned_rate : (A, n) arrays
        X q and X q̇ about each axis.
    squared : (A (A + 1) / 2, n) array
        Z q of each pair of axes.
    """

    u: Annotated[Array, "6"]
    u_rate: Annotated[Array, "6"]
    u_acceleration: Annotated[Array, "6"]
    twist: Annotated[Array, "6"]
    twist_rate: Annotated[Array, "6"]
    w: Annotated[Array, "6"]
    w_rate: Annotated[Array, "6"]
    down: Annotated[Array, "3"]
    wrench: Annotated[Array, "6"]
    force: Annotated[Array, "6"]
    momentum: Annotated[Array, "6"]
    point: Annotated[Array, "6"]
    other: Annotated[Array, "6"]
    moments: Annotated[Array, "6"]
    q: Annotated[Array, "n"]
    q_rate: Annotated[Array, "n"]
    q_acceleration: Annotated[Array, "n"]
    modal: Annotated[Array, "n"]
    speeds: Annotated[Array, "n"]
    turned: Annotated[Array, "A n"]
    turned_rate: Annotated[Array, "A n"]
    squared: Annotated[Array, "pairs n"]


def link_state(modes: int, axes: int) -> LinkState:
    """Memory for a link."""
    return room(LinkState, n=6 + modes, A=axes, pairs=axes * (axes + 1) // 2)


class Bend(NamedTuple):
    """Second-order displacements ½ qᵀ Ψ q of a link with e elastic coordinates, in its frame.

    Attributes
    ----------
    curved : int
        Whether there are any; tables over elastic coordinates are empty otherwise.
    warped : int
        Whether the inertia of its modes changes with them.
    axes : (B, 3) array
        About which its frame can turn.
    rows : (e, (6 + 3 B) e) array
        Per coordinate: transposed second-order momenta (6, e), then for each axis W along it (3, e).
    odd : (e, 3 e) array
        Per coordinate: P - Pᵀ of the last three momenta.
    compliance : (6, 6) array
        M₀⁻¹ of the undeformed link.
    """

    curved: int
    warped: int
    axes: Matrix
    rows: Matrix
    odd: Matrix
    compliance: Matrix


class BendState(NamedTuple):
    """Working memory of second order.

    Attributes
    ----------
    pose : (12,) array
        Of the link's frame from that of its parent, displaced interface and joint.
    full, full_rate : (6,) arrays
        The twist that inertia knows, w + M₀⁻¹ (C q̇ + H w), and its derivative.
    added, added_rate : (6,) arrays
        C q̇ + H w and its derivative.
    share, share_rate : (6,) arrays
        M₀⁻¹ times momentum, and its derivative.
    moment, moment_rate : (3,) arrays
        S = ½ qᵀ S_ab q and its derivative.
    spin, spin_rate : (3 B,) arrays
        ½ qᵀ W q along each axis, and derivatives.
    weights : (6 + 3 B,) array
        Of rows in the modal forces.
    rows, rows_rate : (6 + 3 B, e), (6, e) arrays
        `Bend.rows` times q, and q̇.
    spare : (s,) array
        Of the elastic coordinates of the link or of its parent, whichever has more.
    """

    pose: Annotated[Array, "12"]
    full: Annotated[Array, "6"]
    full_rate: Annotated[Array, "6"]
    added: Annotated[Array, "6"]
    added_rate: Annotated[Array, "6"]
    share: Annotated[Array, "6"]
    share_rate: Annotated[Array, "6"]
    moment: Annotated[Array, "3"]
    moment_rate: Annotated[Array, "3"]
    spin: Annotated[Array, "B"]
    spin_rate: Annotated[Array, "B"]
    weights: Annotated[Array, "6+B"]
    rows: Annotated[Array, "6+B e"]
    rows_rate: Annotated[Array, "6 e"]
    spare: Annotated[Array, "s"]


def bend_state(modes: int, modes_before: int, axes: int) -> BendState:
    """Memory for a link, and what its parent has."""
    return room(BendState, e=modes, B=3 * axes, s=max(modes, modes_before))


class Change(NamedTuple):
    """Working memory of a link with second-order inertia: of W = w + M₀⁻¹ (C q̇ + H w).

    Attributes
    ----------
    inertia, product : (6, 6) arrays
        Inertia over W, and times ``map``.
    map : (6, 6) array
        W per unit of w.
    coupling, whole : (6, e) arrays
        Of W with q̇_d at given W, and with the part of W that q̇_d makes.
    """

    inertia: Annotated[Array, "6 6"]
    map: Annotated[Array, "6 6"]
    product: Annotated[Array, "6 6"]
    coupling: Annotated[Array, "6 e"]
    whole: Annotated[Array, "6 e"]


def change(modes: int) -> Change:
    """Memory for a link."""
    return room(Change, e=modes)


read_chain, read_link, read_link_state = reader(Chain), reader(Link), reader(LinkState)
read_bend, read_bend_state = reader(Bend), reader(BendState)
LINK, LINK_STATE = table_size(Link), table_size(LinkState)
BEND, BEND_STATE = table_size(Bend), table_size(BendState)
read_change, CHANGE = reader(Change), table_size(Change)
