"""Records of compatibility at the joints, and of the elimination of the rigid-body coordinates that follows from it.

Sizes: L links, each with one joint; v rows of compatibility; r = 6 L rigid-body coordinates q_r and d elastic ones q_d
of all links together; n = 6 + e modal coordinates (rigid-body, elastic) of a link and n_p of its parent; z = L + d
coordinates (θ, q_d), prescribed joints included. Rows of joints are in the frame behind them.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from erls.maths.records import Matrix, Stack, Vector, reader, table_size
from erls.maths.so3 import Array


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
        Whether the origin of the outer frame moves along the axis.
    kept : int
        Rows in use: six, or five.
    turn, slide : (6, 6) arrays
        ad ξ is their sum, with X(θ) = exp(-θ ad ξ): of the turn about the axis, and of the advance along it.
    advance : (3,) array
        How far the origin moves per unit of θ_k.
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
    turn: Matrix
    slide: Matrix
    advance: Vector
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

    transform: Annotated[Array, "3 6 6"]
    moved: Annotated[Array, "6 n_p"]
    inner: Annotated[Array, "6"]
    inner_rate: Annotated[Array, "6"]
    inner_bias: Annotated[Array, "6"]
    outer: Annotated[Array, "6"]
    outer_rate: Annotated[Array, "6"]
    extra: Annotated[Array, "6"]
    extra_angle: Annotated[Array, "6"]
    extra_bias: Annotated[Array, "6"]
    extra_own: Annotated[Array, "6 n"]
    extra_previous: Annotated[Array, "6 n_p"]
    by_inner: Annotated[Array, "6 6"]
    by_outer: Annotated[Array, "6 6"]
    frame: Annotated[Array, "6"]
    frame_rate: Annotated[Array, "6"]
    square: Annotated[Array, "6"]
    square_rate: Annotated[Array, "6"]
    square_bend: Annotated[Array, "6"]
    square_slope: Annotated[Array, "6 n_p"]
    along: Annotated[Array, "n_p"]
    along_slope: Annotated[Array, "n_p"]
    along_bend: Annotated[Array, "n_p"]
    turn: Annotated[Array, "4"]
    gradient: Annotated[Array, "z"]


class Elimination(NamedTuple):
    """C q = 0 of all joints, and what follows from it: q_r = D q_d with its derivatives.

    Attributes
    ----------
    place, rate, acceleration : (z,) arrays
        θ, then q_d; their derivatives.
    q_r, qd_r : (r,) arrays
        Rigid-body modal coordinates and their rates.
    c_r, c_d : (v, r), (v, d) arrays
        C_r and C_d of eq. (10).
    first_r, first_d, second_r, second_d : arrays
        Block rows of ∂C/∂θ_k and of ∂²C/∂θ_k², each by its own joint: no block row depends on another.
    gram, gram_again : (v, v) arrays
        Factors of C_r C_rᵀ, and of the same of what they leave of C_r.
    counts : (r,) array
        1, or 0 for the coordinates of links that are but places between two motions of a joint.
    norm, rows : (h, h), (v, h) arrays
        Where there are any, h = r: factors of the norm, and C_r in the coordinates in which it is 1.
    plus : (r, v) array
        C_r⁺ = C_rᵀ (C_r C_rᵀ)⁻¹.
    null : (r, r) array
        1 - C_r⁺ C_r.
    d, g : (r, d), (r, L) arrays
        D and G of eq. (14).
    n : (r,) array
        Of eq. (24).
    slope, bend, slope_rate : (v,) arrays
        C′ q, C″ q, C′ q̇: each block row by its own joint.
    mu, mu_rate : (v,) arrays
        C_r⁺ᵀ q_r, and its derivative.
    turned : (r, L) array
        (∂C_r/∂θ_k)ᵀ μ.
    extra, extra_bias, spare : (v,) arrays
    extra_slope : (v, z) array
        e of second order in the displacements, ë at θ̈ = 0, q̈_d = 0, and the derivatives of e over (θ, q_d).
    spare_rigid : (r,) array
    rest : (z,) array
        Zeros.
    """

    place: Annotated[Array, "z"]
    rate: Annotated[Array, "z"]
    acceleration: Annotated[Array, "z"]
    q_r: Annotated[Array, "r"]
    qd_r: Annotated[Array, "r"]
    c_r: Annotated[Array, "v r"]
    c_d: Annotated[Array, "v d"]
    first_r: Annotated[Array, "v r"]
    first_d: Annotated[Array, "v d"]
    second_r: Annotated[Array, "v r"]
    second_d: Annotated[Array, "v d"]
    gram: Annotated[Array, "v v"]
    gram_again: Annotated[Array, "v v"]
    counts: Annotated[Array, "r"]
    norm: Annotated[Array, "h h"]
    rows: Annotated[Array, "v h"]
    plus: Annotated[Array, "r v"]
    null: Annotated[Array, "r r"]
    d: Annotated[Array, "r d"]
    g: Annotated[Array, "r L"]
    n: Annotated[Array, "r"]
    slope: Annotated[Array, "v"]
    bend: Annotated[Array, "v"]
    slope_rate: Annotated[Array, "v"]
    mu: Annotated[Array, "v"]
    mu_rate: Annotated[Array, "v"]
    turned: Annotated[Array, "r L"]
    extra: Annotated[Array, "v"]
    extra_bias: Annotated[Array, "v"]
    extra_slope: Annotated[Array, "v z"]
    spare: Annotated[Array, "v"]
    spare_rigid: Annotated[Array, "r"]
    rest: Annotated[Array, "z"]


read_joint_rows, read_row_state, read_elimination = reader(JointRows), reader(RowState), reader(Elimination)
JOINT_ROWS, ROW_STATE = table_size(JointRows), table_size(RowState)
