"""What formulations of links on joints share, as records: joints, modes, the rigid links of feed-forward.

Links are numbered so that every one comes after that which it stands on, its parent. ``integers[0]`` is the place of a
`Serial`, whose fields are the places of the first record of each kind; those of the other links follow.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from erls.equations import compiled_system as contract
from erls.maths.calls import caller
from erls.maths.jit import ENABLED
from erls.maths.records import Matrix, Vector, reader, table_size

FEED: Any = None
TURN: Any = None
if ENABLED:
    from numba import types as _t

    _state = (contract.REALS, contract.INTEGERS, contract.REALS, _t.float64)
    FEED = _t.void(_t.int64, *_state)
    TURN = _t.void(_t.int64, _t.int64, _t.int64, *_state, contract.REALS, contract.REALS, contract.REALS)

call_feed_forward = caller(FEED, "erls.equations.serial.feed_forward:feed_forward")
call_contact_gains = caller(contract.STIFFNESS_AND_DAMPING, "erls.equations.serial.contact_gains:contact_gains")
call_turn_by_vector = caller(TURN, "erls.equations.serial.rotation_vector:turn_by_vector")


class Serial(NamedTuple):
    """What every mechanism of links on joints has.

    Attributes
    ----------
    links : int
    joints, joint_states, modes : int
        Places of the first `Joint`, `JointState` and `Modes`.
    feeds, vectors : int
        Addresses of `erls.equations.serial.feed_forward`, where a drive feeds forward, and of
        `erls.equations.serial.rotation_vector`, where a joint has one; otherwise -1, and nothing of them is compiled.
    rigid_links, rigid_states : int
        Where a drive feeds forward, places of the first of these.
    loads : int
        Address of the formulation's function that lets loads act (`erls.equations.serial.loads`); -1 without any, and
        nothing of it is compiled.
    load_count, load_records, load_states : int
        How many, and places of the first `Load` and `LoadState`.
    load_nodes, load_node_states : int
        Places of the first `Node` and `NodeState`, of which each load has two: where it acts, and what turns it, or the
        other side of a contact.
    touch, contact_gains, residual : int
        Where there are contacts, addresses of `erls.equations.serial.touch`, of
        `erls.equations.serial.contact_gains` and of the residual of the formulation; otherwise -1.
    contact_count, contacts, contact_states : int
        How many, and places of the first `Contact` and `ContactState`.
    contact_room : int
        Place of a `ContactRoom`.
    own : int
        Place of the record of the formulation.
    gravity : (3,) array
        World axes [m/s²].
    """

    links: int
    joints: int
    joint_states: int
    modes: int
    feeds: int
    vectors: int
    rigid_links: int
    rigid_states: int
    loads: int
    load_count: int
    load_records: int
    load_states: int
    load_nodes: int
    load_node_states: int
    touch: int
    contact_gains: int
    residual: int
    contact_count: int
    contacts: int
    contact_states: int
    contact_room: int
    own: int
    gravity: Vector


class Joint(NamedTuple):
    """The joint that carries a link: its motion, and what acts along it.

    Attributes
    ----------
    place : int
        Of its coordinate among the independent ones; -1 where it is prescribed.
    component : int
        Of a rotation vector: 0, 1, 2; -1 for a motion of its own.
    motion, load : int
        Places of the curves of the prescribed or wanted coordinate and of the given force; -1 without.
    feeds, acts : int
        Whether the drive feeds forward; whether drive, spring, damper, friction or rotor act.
    stiffness, rest, damping, friction, transition : float
        Of `erls.mechanism.joints.JointForces`.
    stops : (6,) array
        Of `erls.mechanism.contacts.Stops`; empty without.
    rotor : float
        Inertia along the joint [kg m² or kg].
    gain, rate_gain : float
        Of the controller.
    least, most : float
        What the motor gives, between the limits either way; both are one of these while a motor is said to be at its
        limit, and infinite while it is said to be within (`erls.equations.switches.motors`).
    rubbing : float
        Friction of a joint that is said to slide (`erls.equations.switches`).
    held : float
        Coordinate where feed-forward holds a joint without wanted motion.
    step : (4, 12) array
        Pose of the frame behind the joint in the frame before it: constant part, those with cosine and sine of the
        coordinate, and that with the coordinate itself.
    screw : (6,) array
        Motion subspace S: twist of unit rate, in the frame behind the joint; where it is constant.
    """

    place: int
    component: int
    motion: int
    load: int
    feeds: int
    acts: int
    stiffness: float
    rest: float
    damping: float
    friction: float
    transition: float
    stops: Vector
    rotor: float
    gain: float
    rate_gain: float
    least: float
    most: float
    rubbing: float
    held: float
    step: Matrix
    screw: Vector


class JointState(NamedTuple):
    """Motion of a joint.

    Attributes
    ----------
    coordinate : (3,) array
        θ, θ̇, θ̈.
    pose : (12,) array
        Of the frame behind the joint in that before it, see `erls.maths.spatial`.
    screw : (6,) array
        S, in the frame behind the joint.
    twist, twist_rate : (6,) arrays
        S θ̇, and its derivative there.
    feed : (1,) array
        Force that feeds forward.
    forces : (2,) array
        After a residual: what the joint must give for the motion beside drive, spring, damper and friction; and these.
    """

    coordinate: Vector
    pose: Vector
    screw: Vector
    twist: Vector
    twist_rate: Vector
    feed: Vector
    forces: Vector


class Modes(NamedTuple):
    """Elastic coordinates of a link.

    Attributes
    ----------
    first : int
        Place of the first one among the independent coordinates.
    mass : (e, e) array
        M_ee [generalized].
    stiffness, damping : (e,) arrays
    rest : (e,) array
        Coordinates of the link without load.
    decoupled : (e, e) array
        V with Vᵀ M_ee V = 1 and Vᵀ K V diagonal, for matrices that are solved link by link.
    decoupled_stiffness, decoupled_damping : (e,) arrays
        Diagonals of Vᵀ K V and Vᵀ C V.
    """

    first: int
    mass: Matrix
    stiffness: Vector
    damping: Vector
    rest: Vector
    decoupled: Matrix
    decoupled_stiffness: Vector
    decoupled_damping: Vector


class RigidLink(NamedTuple):
    """A link of the rigid mechanism, for feed-forward: parent (-1 on the ground), ``step`` and ``screw`` as of `Joint`,
    rigid mass matrix (6, 6) in its frame.
    """

    parent: int
    step: Matrix
    screw: Vector
    mass: Matrix


class RigidState(NamedTuple):
    """Motion of a rigid link: pose (12,), twist (6,) and its rate (6,), wrench (6,), momentum (6,)."""

    pose: Vector
    twist: Vector
    twist_rate: Vector
    wrench: Vector
    momentum: Vector


read_serial, read_joint, read_joint_state = reader(Serial), reader(Joint), reader(JointState)
read_modes, read_rigid_link, read_rigid_state = reader(Modes), reader(RigidLink), reader(RigidState)
JOINT, JOINT_STATE, MODES = table_size(Joint), table_size(JointState), table_size(Modes)
RIGID_LINK, RIGID_STATE = table_size(RigidLink), table_size(RigidState)
