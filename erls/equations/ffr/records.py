"""Records of a mechanism of floating frames: the constants of its links and of their interfaces, and their memory.

A link stands with its floating frame behind its joint, displaced against it by its inboard interface where that moves
in the frame. The joint stands on an interface of the parent, which moves with the elastic coordinates of the parent.
Both are nodes: node 2k is the one that the joint of link k stands on, node 2k + 1 the inboard one of link k. What
belongs to the former is kept with link k, so that any number of links may stand on one. Frames, twists and wrenches are
those of `erls.maths.spatial`; e is the number of elastic coordinates of the link in question, those of loads in N and
N m, of lengths in m.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from erls.equations import compiled_system as contract
from erls.equations.serial.loads import LOADS
from erls.maths.calls import caller
from erls.maths.jit import ENABLED
from erls.maths.records import Matrix, Stack, Vector, reader, room, table_size
from erls.maths.so3 import Array

BEND_LINK: Any = None
CORRECT_TWIST: Any = None
BENT_FORCES: Any = None
CORRECT_ARRIVAL: Any = None
if ENABLED:
    from numba import types as _t

    _link = (_t.int64, contract.REALS, contract.INTEGERS, contract.REALS)
    BEND_LINK = _t.void(*_link, contract.REALS)
    CORRECT_TWIST = _t.void(*_link, contract.REALS, contract.REALS)
    BENT_FORCES = _t.void(*_link, contract.REALS, contract.REALS, contract.REALS)
    CORRECT_ARRIVAL = _t.void(*_link, _t.int64)

call_bend_link = caller(BEND_LINK, "erls.equations.ffr.bent:bend_link")
call_correct_twist = caller(CORRECT_TWIST, "erls.equations.ffr.bent:correct_twist")
call_bent_forces = caller(BENT_FORCES, "erls.equations.ffr.bent:bent_forces")
call_correct_arrival = caller(CORRECT_ARRIVAL, "erls.equations.ffr.bent:correct_arrival")
call_loads = caller(LOADS, "erls.equations.ffr.loads:loads")
call_floating_loads = caller(LOADS, "erls.equations.ffr.floating_loads:floating_loads")


class Frames(NamedTuple):
    """Where the records are, and which effects are on (`erls.mechanism.effects`, 0 or 1).

    Attributes
    ----------
    bodies, body_states, nodes, node_states : int
        Places of the first ones; of nodes two for each link, then those that loops hold.
    node_count : int
        Without those that loops hold.
    end_count, ends, end_room : int
        Frames that loops hold, the place of the first `End`, and of the `EndRoom`.
    bent_bodies, bent_states, warps, warp_states : int
        Places of the first ones; empty records of links without second-order displacements.
    bend_link, correct_twist, bent_forces, correct_arrival : int
        Addresses of `erls.equations.ffr.bent`, where a link has second-order displacements; otherwise -1, and nothing
        of them is compiled.
    segments, decoupled, condensed : int
        Places of the first `Segment` in the links' coordinates and in decoupled ones, and of the first `Condensed`.
    room : int
        Place of the `Room`.
    free : int
        Number of joints that are not prescribed.
    """

    bodies: int
    body_states: int
    nodes: int
    node_states: int
    node_count: int
    end_count: int
    ends: int
    end_room: int
    bent_bodies: int
    bent_states: int
    warps: int
    warp_states: int
    bend_link: int
    correct_twist: int
    bent_forces: int
    correct_arrival: int
    segments: int
    decoupled: int
    condensed: int
    room: int
    free: int
    first_order: int
    second_order: int
    coriolis: int
    centrifugal: int
    softening: int
    weight: int


class Body(NamedTuple):
    """A link in its floating frame: standard input data, `erls.equations.ffr.standard_data`.

    Attributes
    ----------
    parent : int
        Number of the link that it stands on, -1 for the ground.
    bent, warped : int
        Whether it has second-order displacements, and modal inertia from them.
    mass : float
    moment : (3,) array
        First moment ∫ρ x of the undeformed link.
    rigid : (6, 6) array
        M₀.
    coupling : (6, e) array
        C₀.
    axes : (c, 3) array
        Unit vectors about which the frame turns: all three, or the one of the only joint that turns it, or none.
    half : (c, 6, e) array
        Half of M₁ for each axis.
    turned, gyroscopic : (c, e, e) arrays
        C₁ for each axis, and that less its transpose; column after column.
    square : (pairs, e, e) array
        M₂ for each pair of axes, symmetric: one, or of 00, 11, 22, 01, 02, 12.
    """

    parent: int
    bent: int
    warped: int
    mass: float
    moment: Vector
    rigid: Matrix
    coupling: Matrix
    axes: Matrix
    half: Stack
    turned: Stack
    gyroscopic: Stack
    square: Stack


class BentBody(NamedTuple):
    """Second-order displacements ½ ηᵀ Ψ η of a link, `erls.equations.ffr.bent`.

    Attributes
    ----------
    bend : (e, 6 e) array
        S_ab and P, rows (6, e), for each coordinate that they are multiplied with.
    spin : (e, 9 e) array
        W, rows (9, e), likewise.
    skew : (e, 3 e) array
        P less its transpose, rows (3, e), likewise.
    per_mass : (6, 6) array
        M₀⁻¹.
    """

    bend: Matrix
    spin: Matrix
    skew: Matrix
    per_mass: Matrix


class BodyState(NamedTuple):
    """Motion of a link and the forces on it, in the axes of its floating frame unless said otherwise.

    Attributes
    ----------
    arrived : (6,) array
        Twist of the frame behind the joint, in its axes.
    twist, twist_rate : (6,) arrays
        ν of the floating frame, and its derivative.
    gravity : (3,) array
        [m/s²]
    wrench : (6,) array
        What moves the link and all that it bears as they move, less their weight, on the floating frame.
    borne : (6,) array
        The same on the frame behind the joint, in its axes.
    momentum : (6,) array
        ∂T/∂ν.
    moment : (3,) array
        First moment of the deformed link.
    inertia : (6, 6) array
        M(η).
    coupling : (6, e) array
        C(η).
    arrival : (6, 6) array
        Z: twist of the floating frame per twist of the frame behind the joint.
    carried : (6, e) array
        W: twist of the floating frame per η̇ while the frame behind the joint rests.
    turned, turned_rate : (c, e) arrays
        C₁ η and C₁ η̇ for each axis.
    squared : (e,) array
        M₂ η of a pair of axes.
    spare : (12,) array
    spare_coupling : (6, e) array
    spare_inertia : (6, 6) array
        Working memory.
    """

    arrived: Annotated[Array, "6"]
    twist: Annotated[Array, "6"]
    twist_rate: Annotated[Array, "6"]
    gravity: Annotated[Array, "3"]
    wrench: Annotated[Array, "6"]
    borne: Annotated[Array, "6"]
    momentum: Annotated[Array, "6"]
    moment: Annotated[Array, "3"]
    inertia: Annotated[Array, "6 6"]
    coupling: Annotated[Array, "6 e"]
    arrival: Annotated[Array, "6 6"]
    carried: Annotated[Array, "6 e"]
    turned: Annotated[Array, "c e"]
    turned_rate: Annotated[Array, "c e"]
    squared: Annotated[Array, "e"]
    spare: Annotated[Array, "12"]
    spare_coupling: Annotated[Array, "6 e"]
    spare_inertia: Annotated[Array, "6 6"]


def body_state(e: int, axes: int) -> BodyState:
    """Memory for a link with so many elastic coordinates and axes."""
    return room(BodyState, e=e, c=axes)


class BentState(NamedTuple):
    """Memory of a link with second-order displacements.

    Attributes
    ----------
    twist, twist_rate : (6,) arrays
        ν and its derivative while corrected ones take their place.
    moment, moment_rate : (3,) arrays
        S = ½ ηᵀ S_ab η and its derivative.
    square, square_rate : (3, 3) arrays
        ½ ηᵀ W η and its derivative.
    share, share_rate : (6,) arrays
        M₀⁻¹ p and M₀⁻¹ times the force on the corrected twist.
    factor : (6, 6) array
        1 + M₀⁻¹ H.
    arrival, carried : (6, 6), (6, e) arrays
        Z and W of the corrected twist.
    bending, bending_rate : (6, e) arrays
        C₂: S_ab and P times η, and times η̇.
    spun : (9, e) array
        W η.
    skewed : (3, e) array
        Working memory.
    spare : (6,) array
        Working memory.
    """

    twist: Annotated[Array, "6"]
    twist_rate: Annotated[Array, "6"]
    moment: Annotated[Array, "3"]
    moment_rate: Annotated[Array, "3"]
    square: Annotated[Array, "3 3"]
    square_rate: Annotated[Array, "3 3"]
    share: Annotated[Array, "6"]
    share_rate: Annotated[Array, "6"]
    factor: Annotated[Array, "6 6"]
    arrival: Annotated[Array, "6 6"]
    carried: Annotated[Array, "6 e"]
    bending: Annotated[Array, "6 e"]
    bending_rate: Annotated[Array, "6 e"]
    spun: Annotated[Array, "9 e"]
    skewed: Annotated[Array, "3 e"]
    spare: Annotated[Array, "6"]


def bent_state(e: int) -> BentState:
    """Memory for a link with so many elastic coordinates."""
    return room(BentState, e=e)


class End(NamedTuple):
    """A frame that a loop holds on a link, at ``offset`` (12,) from its node, whose number is ``node``."""

    link: int
    node: int
    offset: Vector


class EndRoom(NamedTuple):
    """Working memory for these frames: a pose (12,), a force (6,) and a spare (6,)."""

    pose: Vector
    force: Vector
    spare: Vector


class Room(NamedTuple):
    """Memory for accelerations: a matrix (n, n) for dense factors, or numbers (f,) for factors link by link."""

    matrix: Matrix
    factors: Vector


read_frames, read_body, read_bent_body = reader(Frames), reader(Body), reader(BentBody)
read_body_state, read_bent_state = reader(BodyState), reader(BentState)
read_room, read_end, read_end_room = reader(Room), reader(End), reader(EndRoom)
BODY, BENT_BODY, END = table_size(Body), table_size(BentBody), table_size(End)
BODY_STATE, BENT_STATE = table_size(BodyState), table_size(BentState)
