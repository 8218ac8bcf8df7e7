"""ERLS in the joint-angle gauge as records: constants and working memory of a link.

The mode shapes of each link are combined once and for all into six rigid ones, ρ, and elastic ones that leave its
inboard interface where it is, Ψ = [D; 1] with D = -A_r⁻¹ A_e. Then q = ρ u + Ψ q_d, where u is the displacement of the
link's frame, a small motion [translation; rotation]. With e elastic modes n = 6 + e counts the coordinates (u, q_d).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from erls.maths.records import Matrix, Stack, Vector, reader, room, table_size
from erls.maths.so3 import Array


class Chain(NamedTuple):
    """Where the records of links begin, and which effects act.

    Attributes
    ----------
    links, states : int
        Places of the first `Link` and `LinkState`.
    bends, bend_states : int
        Places of the first `Bend` and `BendState`; -1 without second-order displacements.
    segments, changes, condensed : int
        Places of the first records of `erls.equations.serial.segments`, of `erls.equations.erls.segments.Change` and of
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
        ν + u̇ as inertia knows it, and its derivative.
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
        (u, q_d), second-order displacements of the frame included, and derivatives.
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
    """Second-order displacements ½ xᵀ P x of a link, x its last m coordinates of (u, q_d): of rigid-body displacements
    only turns are of second order, and none on the ground.

    Attributes
    ----------
    curved : int
        Whether its inertia has second-order terms.
    bows : int
        Whether the parent's interface is displaced to second order.
    armed : int
        Whether its interface lies at an arm from its joint, or slides.
    turns : int
        Turning coordinates among x: 3, or 0 on the ground.
    axes : (B, 3) array
        About which its frame can turn.
    rows : (m, (6 + 3 B) m) array
        Per coordinate: transposed second-order momenta (6, m), then for each axis W along it (3, m).
    odd : (m, 3 m) array
        Per coordinate: P - Pᵀ of the last three momenta.
    compliance : (6, 6) array
        M₀⁻¹ of the undeformed link.
    bow : (m of the parent, 6 m of the parent) array
        Per coordinate of the parent: second-order displacement of its interface, as a motion of its frame.
    slide, arm : (3,) arrays
        Axis of a slide, and arm from the inboard interface to the joint.
    """

    curved: int
    bows: int
    armed: int
    turns: int
    axes: Matrix
    rows: Matrix
    odd: Matrix
    compliance: Matrix
    bow: Matrix
    slide: Vector
    arm: Vector


class BendState(NamedTuple):
    """Working memory of second order.

    Attributes
    ----------
    e, e_rate, e_acceleration : (6,) arrays
        Second-order displacement of the frame, and derivatives.
    carried : (6,) array
        What the parent's interface hands on of it.
    push : (6,) array
        Force on virtual e.
    full, full_rate : (6,) arrays
        The twist that inertia knows, ν + M₀⁻¹ (C q̇ + H ν), and its derivative.
    added, added_rate : (6,) arrays
        C q̇ + H ν and its derivative.
    share, share_rate : (6,) arrays
        M₀⁻¹ times momentum, and its derivative.
    moment, moment_rate : (3,) arrays
        S = ½ qᵀ S_ab q and its derivative.
    spin, spin_rate : (3 B,) arrays
        ½ qᵀ W q along each axis, and derivatives.
    weights : (6 + 3 B,) array
        Of rows in the modal forces.
    rows, rows_rate : (6 + 3 B, m), (6, m) arrays
        `Bend.rows` times x, and ẋ.
    bow, bow_rate : (6, m of the parent) arrays
        `Bend.bow` times x of the parent, and ẋ.
    x, x_rate, x_acceleration : (m,) arrays
        Coordinates, linear in the elastic ones.
    pulls, turning : (6, m), (6, 3) arrays
        M₀⁻¹ C, and M₀⁻¹ H on ω.
    d, b : (3,) arrays
        Arm at the joint's coordinate, and φ × d.
    """

    e: Annotated[Array, "6"]
    e_rate: Annotated[Array, "6"]
    e_acceleration: Annotated[Array, "6"]
    carried: Annotated[Array, "6"]
    push: Annotated[Array, "6"]
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
    rows: Annotated[Array, "6+B m"]
    rows_rate: Annotated[Array, "6 m"]
    bow: Annotated[Array, "6 p"]
    bow_rate: Annotated[Array, "6 p"]
    x: Annotated[Array, "m"]
    x_rate: Annotated[Array, "m"]
    x_acceleration: Annotated[Array, "m"]
    pulls: Annotated[Array, "6 m"]
    turning: Annotated[Array, "6 3"]
    d: Annotated[Array, "3"]
    b: Annotated[Array, "3"]
    spare: Annotated[Array, "s"]


def bend_state(kept: int, kept_before: int, axes: int) -> BendState:
    """Memory for a link with m = ``kept``, and its parent's."""
    return room(BendState, m=kept, p=kept_before, B=3 * axes, s=max(kept, kept_before))


class Change(NamedTuple):
    """Working memory of a link with second-order inertia.

    Attributes
    ----------
    inertia, product : (9, 9), (9, p) arrays
        Inertia over (W, Ω), and times ``map``.
    map : (9, p) array
        (W, Ω) per unit of μ.
    coupling, whole : (9, e) arrays
        Of (W, Ω) with q̇_d at given (W, Ω), and with the part of these that q̇_d makes.
    """

    inertia: Annotated[Array, "9 9"]
    map: Annotated[Array, "9 p"]
    product: Annotated[Array, "9 p"]
    coupling: Annotated[Array, "9 e"]
    whole: Annotated[Array, "9 e"]


def change(size: int, modes: int) -> Change:
    """Memory for a link with p = ``size``."""
    return room(Change, p=size, e=modes)


read_chain, read_link, read_link_state = reader(Chain), reader(Link), reader(LinkState)
read_bend, read_bend_state = reader(Bend), reader(BendState)
LINK, LINK_STATE = table_size(Link), table_size(LinkState)
BEND, BEND_STATE = table_size(Bend), table_size(BendState)
read_change, CHANGE = reader(Change), table_size(Change)
