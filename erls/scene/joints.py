"""The tables ``joints`` and ``loops`` of a chain."""

from __future__ import annotations

from erls.mechanism.drives import DriveRecord, FreeDrive
from erls.scene.contacts import Stops
from erls.scene.records import Pose, Record
from fe_import.description.base import Inertia, Vector


class DH(Record, frozen=True):
    """Denavit-Hartenberg row of a joint: from the frame of the link before to that of its own link.

    Attributes
    ----------
    convention : str
        ``standard``: Rz(θ) Tz(d) Tx(a) Rx(α); or ``modified`` (Craig): Rx(α) Tx(a) Rz(θ) Tz(d). There is no default.
    a : float
        Length along x [m].
    alpha, alpha_deg : float, optional
        Twist about x [rad], or in degrees; 0 unless given.
    d : float
        Offset along z [m]; the coordinate of a prismatic joint adds to it.
    theta, theta_deg : float, optional
        Turn about z [rad], or in degrees; 0 unless given. The coordinate of a revolute joint adds to it.
    """

    convention: str
    a: float = 0.0
    alpha: float | None = None
    alpha_deg: float | None = None
    d: float = 0.0
    theta: float | None = None
    theta_deg: float | None = None


class JointInitial(Record, frozen=True):
    """Joint coordinate and rate at time 0; refused where a motion is prescribed, which fixes its own start.

    Attributes
    ----------
    position, position_deg : float, optional
        Coordinate [rad or m], or in degrees; 0 unless given.
    rate, rate_deg : float, optional
        Rate [rad/s or m/s], or in degrees per second; 0 unless given.
    """

    position: float | None = None
    position_deg: float | None = None
    rate: float | None = None
    rate_deg: float | None = None


class Friction(Record, frozen=True):
    """Coulomb friction: smooth around zero, ``force`` · tanh(rate / ``transition_rate``), or with exact sticking.

    Attributes
    ----------
    force : float
        Friction while it slides; of smooth friction, at large rates [N m or N].
    law : str
        ``smooth``; or ``stick``: ``force`` against the rate while it slides, and whatever holds the joint where it
        rests, up to ``static_force``. When a joint comes to rest and when it breaks away is located in time.
    transition_rate : float, optional
        Rate at which smooth friction reaches 76 % of ``force`` [rad/s or m/s]; 0.01 unless given.
    static_force : float, optional
        What a joint that sticks holds at most [N m or N]; ``force`` unless given, and not less.
    """

    force: float
    law: str = "smooth"
    transition_rate: float | None = None
    static_force: float | None = None


class Motor(Record, frozen=True):
    """The motor of a joint; its rotor acts on the joint, its mass sits on the outboard interface of the link before.

    Attributes
    ----------
    rotor_inertia : float
        Of the rotor about its axis [kg m²]; rotor_inertia · gear_ratio² is reflected to the joint.
    gear_ratio : float
        Turns of the rotor per turn of the joint, or rad/m.
    resistance, inductance, torque_constant : float, optional
        Of its circuit, all three or none [Ω, H, N m/A; N/A where the joint slides without a gear]: the current follows
        the voltage with the time constant inductance / resistance, and the torque constant is that of the back-EMF, too
        [V s/rad]. A drive then commands the voltage that would give its torque at rest; `voltage` gives it itself.
    mass : float
        Of the motor [kg].
    inertia : (3,) floats or (3, 3) floats
        Of the motor about its centre [kg m²], mesh axes of the link before: [Ixx, Iyy, Izz], or a symmetric matrix.
    """

    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0
    resistance: float | None = None
    inductance: float | None = None
    torque_constant: float | None = None
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)


class Rotor(Record, frozen=True):
    """The rotor of a closing joint.

    Attributes
    ----------
    rotor_inertia : float
        Of the rotor about its axis [kg m²]; rotor_inertia · gear_ratio² is reflected to the joint.
    gear_ratio : float
        Turns of the rotor per turn of the joint, or rad/m.
    """

    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0


class Acting(Record, frozen=True, kw_only=True):
    """What acts along a coordinate of a joint.

    Attributes
    ----------
    drive : DriveRecord
        What moves it; nothing unless given.
    stiffness : float
        Of a spring along it [N m/rad or N/m].
    rest, rest_deg : float, optional
        Coordinate at which that spring is free of force [rad or m], or in degrees; 0 unless given.
    damping : float
        Viscous damping [N m s/rad or N s/m].
    friction : Friction, optional
        Coulomb friction; none unless given.
    stops : Stops, optional
        Ends of its range; none unless given.
    """

    drive: DriveRecord = FreeDrive()
    stiffness: float = 0.0
    rest: float | None = None
    rest_deg: float | None = None
    damping: float = 0.0
    friction: Friction | None = None
    stops: Stops | None = None


class OneCoordinate(Acting, frozen=True, kw_only=True):
    """What acts along the coordinate of a joint that has one, with the fields of some kinds of joints.

    Attributes
    ----------
    pitch : float
        Of a screw, which needs it: how far it advances along its axis per radian [m/rad].
    """

    pitch: float = 0.0


class Coordinate(Acting, frozen=True):
    """One of several coordinates of a joint, and what acts along it.

    Attributes
    ----------
    initial : JointInitial
        Coordinate and rate at time 0.
    motor : Rotor
        Rotor inertia.
    """

    initial: JointInitial = JointInitial()
    motor: Rotor = Rotor()


class Branch(Pose, frozen=True):
    """Pose of the frame from which the Denavit-Hartenberg row of a joint starts, in the mesh frame of the link that it
    stands on; on the ground, in the base frame."""


class Joint(OneCoordinate, frozen=True):
    """A joint between a link (or the ground) and the link that it carries.

    Attributes
    ----------
    name : str
        What reports, events and ``--set`` call it.
    dh : DH
        Its Denavit-Hartenberg row.
    type : str
        What it leaves free: ``revolute`` turns about z, ``prismatic`` slides along z, ``screw`` does both at once,
        ``cylindrical`` each for itself (``slide``,
        ``turn``), ``universal`` turns about x and then about its new y (``x``, ``y``), ``planar`` slides along x and y
        and turns about z (``x``, ``y``, ``turn``), ``spherical`` turns by a rotation vector (``turn_x``, ``turn_y``,
        ``turn_z``), ``floating`` does all (``x``, ``y``, ``z``, then that vector), ``fixed`` holds.
    coordinates : dict of Coordinate
        What acts along each coordinate of a joint that has several, by the names above; reports call them
        ``joint/coordinate``. A joint of one coordinate has these fields itself.
    on : str
        The link that it stands on, or ``ground``; the link before unless given.
    at : str
        Interface of that link; its outboard one unless given.
    branch : Branch, optional
        Where its row starts, where several joints stand on one link; the Denavit-Hartenberg frame of that link, or the
        base, unless given.
    carries : str
        The link that it carries; that of the same number unless given.
    initial : JointInitial
        Coordinate and rate at time 0.
    motor : Motor
        Rotor inertia, and the mass of the motor.
    """

    name: str
    dh: DH
    type: str = "revolute"
    coordinates: dict[str, Coordinate] = {}
    on: str = ""
    at: str = ""
    branch: Branch | None = None
    carries: str = ""
    initial: JointInitial = JointInitial()
    motor: Motor = Motor()


class Loop(OneCoordinate, frozen=True):
    """A joint that closes a loop, between a node of a link and the ground, or a node of another link.

    Drive, spring, damper, friction and rotor act along the coordinate of a joint that has one: how far the link has
    moved about or along the axis.

    Attributes
    ----------
    name : str
        What reports and ``--set`` call it.
    link : str
        The link that it holds.
    node : str
        Interface or named node of that link; it sits on the joint.
    type : str
        What it leaves free: ``line`` keeps a point on a straight line, ``planar`` leaves two slides and the turn about
        their normal, the others are what their names say.
    to_link, to_node : str
        The other link and its interface or named node; the ground unless given.
    position : (3,) floats, optional
        Where the node meets the ground, in the world [m]; where it is at the initial joint coordinates unless given.
        A screw takes from it, or from ``to_node``, where its axis runs: its thread fits the node as that lies along the
        axis at the initial joint coordinates.
    axis : (3,) floats, optional
        Direction in the world at the initial joint coordinates, fixed to both sides from then on; that of the joint
        which carries the link unless given.
    second_axis : (3,) floats, optional
        Of a universal joint, fixed to ``link``; ``axis``, at a right angle to it, is fixed to the other side.
    coordinate, coordinate_deg : float, optional
        Its coordinate at the initial joint coordinates [rad or m], or in degrees; unless given 0 if it turns, or the
        distance along the axis of ``node`` from where it meets the other side if it slides.
    motor : Rotor
        Rotor inertia.
    """

    name: str
    link: str
    node: str
    type: str = "revolute"
    to_link: str = ""
    to_node: str = ""
    position: Vector | None = None
    axis: Vector | None = None
    second_axis: Vector | None = None
    coordinate: float | None = None
    coordinate_deg: float | None = None
    motor: Rotor = Rotor()
