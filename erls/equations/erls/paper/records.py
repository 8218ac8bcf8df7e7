"""Records of a chain in the dense form of the ERLS-CMS paper: links, with their memory, and the balance of forces.

Sizes as in `erls.equations.erls.paper.compatibility_records`; f independent coordinates. Twists and wrenches are
[linear; angular] in a link's frame.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from erls.equations import compiled_system as contract
from erls.equations.serial.loads import LOADS
from erls.maths.calls import caller
from erls.maths.jit import ENABLED
from erls.maths.records import Matrix, Stack, Vector, reader, table_size
from erls.maths.so3 import Array

ELIMINATE: Any = None
EXTRA_ROWS: Any = None
if ENABLED:
    from numba import types as _t

    _memory = contract.REALS, contract.INTEGERS, contract.REALS
    ELIMINATE, EXTRA_ROWS = _t.int64(*_memory), _t.void(*_memory)

call_eliminate = caller(ELIMINATE, "erls.equations.erls.paper.elimination:eliminate")
call_loads = caller(LOADS, "erls.equations.erls.paper.loads:loads")
call_extra_rows = caller(EXTRA_ROWS, "erls.equations.erls.paper.second_order_rows:extra_rows")


class Paper(NamedTuple):
    """Where the records are, and which effects are on (`erls.mechanism.effects`, 0 or 1).

    Attributes
    ----------
    rows, elastic, free : int
        v, d, and the number of joints that are not prescribed.
    joint_rows, row_states, bodies, body_states, bent_bodies, bent_states : int
        Places of the first ones.
    correct_twist, bent_forces, bent_mass : int
        Addresses of `erls.equations.erls.paper.bent`, where a link has second-order displacements; otherwise -1, and
        nothing of them is compiled.
    elimination, balance : int
        Places of `Elimination` and `Balance`.
    move, eliminate, residual, mass_matrix : int
        Addresses of the functions: what calls them is compiled without them.
    extra_rows : int
        Address of `erls.equations.erls.paper.second_order_rows`, where compatibility is of second order; otherwise -1.
    end_count, ends, end_states : int
        Frames that loops hold (`erls.equations.serial.ends`), and places of the first ones.
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
    correct_twist: int
    bent_forces: int
    bent_mass: int
    elimination: int
    balance: int
    move: int
    eliminate: int
    residual: int
    mass_matrix: int
    extra_rows: int
    end_count: int
    ends: int
    end_states: int
    curved: int
    first_order: int
    second_order: int
    coriolis: int
    centrifugal: int
    softening: int


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

    world: Annotated[Array, "12"]
    transform: Annotated[Array, "6 6"]
    moves: Annotated[Array, "6+n z"]
    bias: Annotated[Array, "6+n"]
    velocity: Annotated[Array, "6+n"]
    acceleration: Annotated[Array, "6+n"]
    q: Annotated[Array, "n"]
    twist: Annotated[Array, "6"]
    twist_rate: Annotated[Array, "6"]
    s: Annotated[Array, "n"]
    s_rate: Annotated[Array, "n"]
    momentum: Annotated[Array, "n"]
    momentum_rate: Annotated[Array, "n"]
    p: Annotated[Array, "6"]
    xq: Annotated[Array, "3 n"]
    xqd: Annotated[Array, "3 n"]
    zq: Annotated[Array, "9 n"]
    zqq: Annotated[Array, "9"]
    zqqd: Annotated[Array, "9"]
    gravity: Annotated[Array, "3"]
    moment: Annotated[Array, "3"]
    potential: Annotated[Array, "1"]
    force: Annotated[Array, "6+n"]
    borne: Annotated[Array, "6"]
    mass: Annotated[Array, "6+n 6+n"]
    product: Annotated[Array, "6+n z"]


class Balance(NamedTuple):
    """Over all coordinates (θ, q_d), prescribed joints included.

    Attributes
    ----------
    force : (z,) array
        Out of balance.
    mass : (z, z) array
    factor : (f, f) array
        Working memory of accelerations.
    """

    force: Annotated[Array, "z"]
    mass: Annotated[Array, "z z"]
    factor: Annotated[Array, "f f"]


read_paper, read_balance, read_body, read_body_state = reader(Paper), reader(Balance), reader(Body), reader(BodyState)
BODY, BODY_STATE = table_size(Body), table_size(BodyState)
