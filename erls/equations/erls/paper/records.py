"""Records of a chain in the dense form of the ERLS-CMS paper: constants of links and joints, and their memory.

Sizes: L links, each with one joint; v rows of compatibility; d elastic coordinates q_d of all links together; n = 6 + e
modal coordinates (rigid-body, elastic) of a link and n_p of its parent; z = L + d coordinates (θ, q_d), prescribed
joints included. Twists and wrenches are [linear; angular] in a link's frame, rows of joints in the frame behind them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.maths.records import Matrix, Stack, Vector, reader, table_size
from erls.maths.so3 import Array


class Paper(NamedTuple):
    """Where the records are, and which effects are on (`erls.mechanism.effects`, 0 or 1).

    Attributes
    ----------
    rows, elastic, free : int
        v, d, and the number of joints that are not prescribed.
    joint_rows, row_states, bodies, body_states, bent_bodies, bent_states : int
        Places of the first ones.
    elimination, balance : int
        Places of `Elimination` and `Balance`.
    curved : int
        Whether compatibility is of second order.
    """

    rows: int
    elastic: int
    free: int
    joint_rows: int
    row_states: int
    bodies: int
    body_states: int
    bent_bodies: int
    bent_states: int
    elimination: int
    balance: int
    curved: int
    first_order: int
    second_order: int
    coriolis: int
    centrifugal: int
    softening: int


class JointRows(NamedTuple):
    """Block row k of C(θ): A_k q_k - X(θ_k) B_k q_p = 0, p the parent of link k (paper, eq. 4-7).

    Attributes
    ----------
    parent : int
        p; -1 on the ground, where the second term is missing.
    first : int
        Place of the first row in C.
    free_row : int
        Row along the joint's freedom where it is left out (minimum-norm gauge); otherwise -1.
    slides : int
        1 for a slide, 0 for a turn.
    kept : int
        Rows in use: six, or five.
    bracket : (6, 6) array
        ad ξ, with X(θ) = exp(-θ ad ξ).
    own, previous : (6, n), (6, n_p) arrays
        A_k = S_k U_k and B_k: displacement and rotation of the joint's frames per modal coordinate.
    own_second, previous_second : (6, n, n), (6, n_p, n_p) arrays
        The same of second order, ½ qᵀ T q; of no entries without it.
    """

    parent: int
    first: int
    free_row: int
    slides: int
    kept: int
    bracket: Matrix
    own: Matrix
    previous: Matrix
    own_second: Stack
    previous_second: Stack


class RowState(NamedTuple):
    """Memory of a block row.

    Attributes
    ----------
    transform : (3, 6, 6) array
        X(θ_k), X′ and X″.
    moved : (6, n_p) array
        X B_k, or a derivative of it.
    inner, inner_rate, inner_bias, outer, outer_rate : (6,) arrays
        Displacement of the joint's inner frame in the axes of the outer one, that of the outer one, their rates, and
        what velocities alone add to the second derivative of the former.
    extra, extra_angle, extra_bias : (6,) arrays
        e of second order, ∂e/∂θ_k, and the part of ë that velocities alone make.
    extra_own, extra_previous : (6, n), (6, n_p) arrays
        ∂e/∂q_k and ∂e/∂q_p.
    by_inner, by_outer : (6, 6) arrays
        Derivatives of what the joint's finite motion adds by the displacements of its frames.
    frame, frame_rate : (6,) arrays
        B_k q_p and its derivative.
    square, square_rate, square_bend : (6,) arrays
        ½ q_pᵀ T q_p, q̇_pᵀ T q_p, q̇_pᵀ T q̇_p.
    square_slope : (6, n_p) array
        T q_p.
    along, along_slope, along_bend : (n_p,) arrays
        Elastic displacement along the freedom per unit of q_p, and its derivatives by θ_k.
    turn : (4,) array
        Physical angle of the joint [rad or m], its rate, its acceleration at θ̈ = 0, q̈_d = 0, and the force along it.
    gradient : (z,) array
        Of the angle.
    """

    transform: Stack
    moved: Matrix
    inner: Vector
    inner_rate: Vector
    inner_bias: Vector
    outer: Vector
    outer_rate: Vector
    extra: Vector
    extra_angle: Vector
    extra_bias: Vector
    extra_own: Matrix
    extra_previous: Matrix
    by_inner: Matrix
    by_outer: Matrix
    frame: Vector
    frame_rate: Vector
    square: Vector
    square_rate: Vector
    square_bend: Vector
    square_slope: Matrix
    along: Vector
    along_slope: Vector
    along_bend: Vector
    turn: Vector
    gradient: Vector


def row_state(modes: int, modes_before: int, size: int) -> RowState:
    """Memory for a joint before a link with n = ``modes``; n_p and z."""
    six, before, rows = np.zeros(6), np.zeros(modes_before), np.zeros((6, modes_before))
    return RowState(
        transform=np.zeros((3, 6, 6)),
        moved=rows,
        inner=six,
        inner_rate=six,
        inner_bias=six,
        outer=six,
        outer_rate=six,
        extra=six,
        extra_angle=six,
        extra_bias=six,
        extra_own=np.zeros((6, modes)),
        extra_previous=rows,
        by_inner=np.zeros((6, 6)),
        by_outer=np.zeros((6, 6)),
        frame=six,
        frame_rate=six,
        square=six,
        square_rate=six,
        square_bend=six,
        square_slope=rows,
        along=before,
        along_slope=before,
        along_bend=before,
        turn=np.zeros(4),
        gradient=np.zeros(size),
    )


class Elimination(NamedTuple):
    """C q = 0 of all joints, and what follows from it: q_r = D q_d with its derivatives.

    Attributes
    ----------
    place, rate, acceleration : (z,) arrays
        θ, then q_d; their derivatives.
    q_r, qd_r : (6 L,) arrays
        Rigid-body modal coordinates and their rates.
    c_r, c_d : (v, 6 L), (v, d) arrays
        C_r and C_d of eq. (10).
    first_r, first_d, second_r, second_d : arrays
        Block rows of ∂C/∂θ_k and of ∂²C/∂θ_k², each by its own joint: no block row depends on another.
    gram, gram_inverse, left : (v, v) arrays
        C_r C_rᵀ or its factor, its inverse, and working memory.
    plus : (6 L, v) array
        C_r⁺ = C_rᵀ (C_r C_rᵀ)⁻¹.
    null : (6 L, 6 L) array
        1 - C_r⁺ C_r.
    d, g : (6 L, d), (6 L, L) arrays
        D and G of eq. (14).
    n : (6 L,) array
        Of eq. (24).
    slope, bend, slope_rate : (v,) arrays
        C′ q, C″ q, C′ q̇: each block row by its own joint.
    mu, mu_rate : (v,) arrays
        C_r⁺ᵀ q_r, and its derivative.
    turned : (6 L, L) array
        (∂C_r/∂θ_k)ᵀ μ.
    extra, extra_bias, spare : (v,) arrays
    extra_slope : (v, z) array
        e of second order in the displacements, ë at θ̈ = 0, q̈_d = 0, and the derivatives of e over (θ, q_d).
    spare_rigid : (6 L,) array
    rest : (free + d,) array
        Zeros.
    """

    place: Vector
    rate: Vector
    acceleration: Vector
    q_r: Vector
    qd_r: Vector
    c_r: Matrix
    c_d: Matrix
    first_r: Matrix
    first_d: Matrix
    second_r: Matrix
    second_d: Matrix
    gram: Matrix
    gram_inverse: Matrix
    left: Matrix
    plus: Matrix
    plus_spare: Matrix
    null: Matrix
    d: Matrix
    g: Matrix
    n: Vector
    slope: Vector
    bend: Vector
    slope_rate: Vector
    mu: Vector
    mu_rate: Vector
    turned: Matrix
    extra: Vector
    extra_bias: Vector
    extra_slope: Matrix
    spare: Vector
    spare_rigid: Vector
    rest: Vector


def elimination(links: int, rows: int, elastic: int) -> Elimination:
    """Memory for L, v and d."""
    r, v, d = 6 * links, rows, elastic

    def room(*shape: int) -> Array:
        return np.zeros(shape)

    return Elimination(
        place=room(links + d), rate=room(links + d), acceleration=room(links + d), q_r=room(r), qd_r=room(r),
        c_r=room(v, r), c_d=room(v, d), first_r=room(v, r), first_d=room(v, d), second_r=room(v, r),
        second_d=room(v, d), gram=room(v, v), gram_inverse=room(v, v), left=room(v, v),
        plus=room(r, v), plus_spare=room(r, v), null=room(r, r), d=room(r, d), g=room(r, links), n=room(r),
        slope=room(v), bend=room(v), slope_rate=room(v), mu=room(v), mu_rate=room(v), turned=room(r, links),
        extra=room(v), extra_bias=room(v), extra_slope=room(v, links + d), spare=room(v), spare_rigid=room(r),
        rest=room(links + d),
    )  # fmt: skip


class Body(NamedTuple):
    """A link: the inertia invariants of `fe_import.modal.inertia`, payloads included.

    Attributes
    ----------
    parent : int
        -1 on the ground.
    elastic : int
        Place of its elastic coordinates within q_d.
    mass : float
    first_moment : (3,) array
        ∫ρ x of the undeformed link.
    first_shape : (3, n) array
        ∫ρ u per modal coordinate.
    m : (n, n) array
    rigid : (n, 6) array
        ρ: q̇ = ρ ν moves the link like its frame.
    rigid_coupling, rigid_mass : (n, 6), (6, 6) arrays
        m ρ and ρᵀ m ρ.
    x : (3, n, n) array
        X_a.
    z : (9, n, n) array
        Z_ab, b running first.
    """

    parent: int
    elastic: int
    mass: float
    first_moment: Vector
    first_shape: Matrix
    m: Matrix
    rigid: Matrix
    rigid_coupling: Matrix
    rigid_mass: Matrix
    x: Stack
    z: Stack


class BodyState(NamedTuple):
    """Motion of a link and the forces on it.

    Attributes
    ----------
    world : (12,) array
        Pose of its frame in the world, as of `erls.maths.spatial`.
    transform : (6, 6) array
        Twist of the parent's frame to this one.
    moves : (6 + n, z) array
        V N of eq. (69): (ν, q̇) per rates of (θ, q_d).
    bias : (6 + n,) array
        Its derivative times the rates: J̇ θ̇, n of eq. (70).
    velocity, acceleration : (6 + n,) arrays
        (ν, q̇) and (ν̇, q̈).
    q : (n,) array
    twist, twist_rate : (6,) arrays
        ν, ν̇, or what second order makes of them.
    s, s_rate, momentum, momentum_rate : (n,) arrays
        s = q̇ + ρ ν, its derivative, ∂T/∂q̇ and its derivative in the link's axes.
    p : (6,) array
        ∂T/∂ν.
    xq, xqd : (3, n) arrays
        X_a q, X_a q̇.
    zq : (9, n) array
        Z_ab q.
    zqq, zqqd : (9,) arrays
        qᵀ Z_ab q, q̇ᵀ Z_ab q.
    gravity, moment : (3,) arrays
        In the link's axes; first moment of the deformed link.
    potential : (1,) array
        Of weight [J].
    force : (6 + n,) array
        Inertia less weight: wrench on the frame, forces on the modal coordinates.
    borne : (6,) array
        Wrench of the link and of all that stands on it.
    mass : (6 + n, 6 + n) array
        Of (ν, q̇).
    product : (6 + n, z) array
        Working memory.
    """

    world: Vector
    transform: Matrix
    moves: Matrix
    bias: Vector
    velocity: Vector
    acceleration: Vector
    q: Vector
    twist: Vector
    twist_rate: Vector
    s: Vector
    s_rate: Vector
    momentum: Vector
    momentum_rate: Vector
    p: Vector
    xq: Matrix
    xqd: Matrix
    zq: Matrix
    zqq: Vector
    zqqd: Vector
    gravity: Vector
    moment: Vector
    potential: Vector
    force: Vector
    borne: Vector
    mass: Matrix
    product: Matrix


def body_state(modes: int, size: int) -> BodyState:
    """Memory for a link with n = ``modes``, in a chain of z = ``size``."""
    n, every = np.zeros(modes), np.zeros(6 + modes)
    six, three, rows = np.zeros(6), np.zeros(3), np.zeros((3, modes))
    return BodyState(
        world=np.zeros(12), transform=np.zeros((6, 6)), moves=np.zeros((6 + modes, size)), bias=every, velocity=every,
        acceleration=every, q=n, twist=six, twist_rate=six, s=n, s_rate=n, momentum=n, momentum_rate=n, p=six, xq=rows,
        xqd=rows, zq=np.zeros((9, modes)), zqq=np.zeros(9), zqqd=np.zeros(9), gravity=three, moment=three,
        potential=np.zeros(1), force=every, borne=six, mass=np.zeros((6 + modes, 6 + modes)),
        product=np.zeros((6 + modes, size)),
    )  # fmt: skip


class BentBody(NamedTuple):
    """Second-order displacements ½ qᵀ Ψ q of a link, `erls.equations.erls.paper.bent`; of no entries without them.

    Attributes
    ----------
    per_mass : (6, 6) array
        M₀⁻¹.
    coupling : (6, n, n) array
        S_ab and Pᵀ: C = [S_ab q; qᵀ P].
    odd : (3, n, n) array
        (P - Pᵀ)/2.
    spin : (9, n, n) array
        W.
    warp : (e, n, n) array
        K of modal inertia, q meeting the last index; of no entries without the effect.
    per_modal : (e, e) array
        σ⁻¹.
    """

    per_mass: Matrix
    coupling: Stack
    odd: Stack
    spin: Stack
    warp: Stack
    per_modal: Matrix


class BentState(NamedTuple):
    """Memory of a link with second-order displacements.

    Attributes
    ----------
    coupling, coupling_rate : (6, n) arrays
        C and Ċ.
    spun : (9, n) array
        W q.
    moment, moment_rate : (3,) arrays
        S = ½ qᵀ S_ab q and its derivative.
    square, square_rate : (3, 3) arrays
        ½ qᵀ W q and its derivative.
    more, more_rate, share, share_rate : (6,) arrays
        C q̇ + H ν and its derivative; M₀⁻¹ times momentum and force.
    odd : (n,) array
    change : (6, 6 + n) array
        Corrected twist per (ν, q̇).
    changed : (6 + n, 6 + n) array
        Mass matrix of the corrected twist.
    warp, warp_rate, warp_spare : (e, n) arrays
        K(q), K(q̇).
    lag, lag_rate, pushed, pushed_rate : (e,) arrays
        k = K q̇, its derivative, q̇_e + σ⁻¹ k and its derivative.
    """

    coupling: Matrix
    coupling_rate: Matrix
    spun: Matrix
    moment: Vector
    moment_rate: Vector
    square: Matrix
    square_rate: Matrix
    more: Vector
    more_rate: Vector
    share: Vector
    share_rate: Vector
    odd: Vector
    change: Matrix
    changed: Matrix
    warp: Matrix
    warp_rate: Matrix
    warp_spare: Matrix
    lag: Vector
    lag_rate: Vector
    pushed: Vector
    pushed_rate: Vector


def bent_state(modes: int, bent: bool, warped: bool) -> BentState:
    """Memory for a link with n = ``modes``, if it is bent; with modal inertia if it is warped."""
    n = modes if bent else 0
    e = n - 6 if warped else 0
    rows, three, nine, six, modal = np.zeros((6, n)), np.zeros(3), np.zeros((3, 3)), np.zeros(6), np.zeros(e)
    warp, all_of = np.zeros((e, n)), 6 + n if bent else 0
    return BentState(
        coupling=rows, coupling_rate=rows, spun=np.zeros((9, n)), moment=three, moment_rate=three, square=nine,
        square_rate=nine, more=six, more_rate=six, share=six, share_rate=six, odd=np.zeros(n),
        change=np.zeros((6, all_of)), changed=np.zeros((all_of, all_of)), warp=warp, warp_rate=warp, warp_spare=warp,
        lag=modal, lag_rate=modal, pushed=modal, pushed_rate=modal,
    )  # fmt: skip


class Balance(NamedTuple):
    """Over all coordinates (θ, q_d), prescribed joints included.

    Attributes
    ----------
    force : (z,) array
        Out of balance.
    mass : (z, z) array
    factor : (free, free) array
        Working memory of accelerations.
    """

    force: Vector
    mass: Matrix
    factor: Matrix


read_paper, read_joint_rows, read_row_state = reader(Paper), reader(JointRows), reader(RowState)
read_elimination, read_balance = reader(Elimination), reader(Balance)
read_body, read_body_state = reader(Body), reader(BodyState)
read_bent_body, read_bent_state = reader(BentBody), reader(BentState)
JOINT_ROWS, ROW_STATE, BODY, BODY_STATE = map(table_size, (JointRows, RowState, Body, BodyState))
BENT_BODY, BENT_STATE = table_size(BentBody), table_size(BentState)
