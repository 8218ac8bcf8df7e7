"""A chain: the scene of joints and links, what moves with it and what is looked for in it."""

from __future__ import annotations

from dataclasses import dataclass

from erls.mechanism.profiles import Load as Profile
from erls.mechanism.sensors.registry import AnySensor
from erls.scene.contacts import Contact
from erls.scene.couplings import Coupling
from erls.scene.joints import Joint, Loop
from erls.scene.links import Link
from erls.scene.plan import Plan
from erls.scene.records import Pose, Record, SceneFile, SceneTables
from erls.scene.servo import Inverse, Servo
from erls.scene.settings import Simulation
from fe_import.description.base import Inertia, Vector


class Base(Pose, frozen=True):
    """Pose of the first Denavit-Hartenberg frame in the world."""


class Point(Record, frozen=True):
    """A named point whose position is reported and drawn.

    Attributes
    ----------
    name : str
        What reports, payloads, loads and events call it.
    link : str
        The link that carries it.
    node : str
        A named node or an interface of that link; give this or ``position``.
    position : (3,) floats, optional
        In the link's mesh frame [m]; the nearest mesh node is taken.
    """

    name: str
    link: str
    node: str = ""
    position: Vector | None = None


class Payload(Record, frozen=True):
    """A rigid body on a named point, in mesh axes of its link.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``.
    mass : float
        [kg]
    inertia : (3,) floats or (3, 3) floats
        About its centre of mass [kg m²]: [Ixx, Iyy, Izz], or a symmetric matrix.
    offset : (3,) floats
        Of its centre of mass from the point [m].
    """

    point: str
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)
    offset: Vector = (0.0, 0.0, 0.0)


class Load(Record, frozen=True):
    """A force and a moment on a named point, a force all along a link, or one on all mass.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``; give this or ``link``.
    link : str
        All of which bears the force; for ``force_per_length`` one made of beams.
    force : (3,) floats
        On the point [N].
    moment : (3,) floats
        On the point [N m]: an interface, or another node that turns.
    force_per_length : (3,) floats
        Along the link [N/m].
    force_per_mass : (3,) floats
        On all mass of the link, payloads and motors included, or of all links unless one is named [N/kg].
    axes : str
        Of force and moment: those of the ``world``, or the mesh axes of the ``link``, which turn with its inboard
        interface.
    follower : bool
        They turn with the displaced node that they act on: they are given in the link's mesh axes as built.
    factor : list of Load
        Profiles over time, which add up and multiply all; they act in full at all times unless given.
    """

    point: str = ""
    link: str = ""
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)
    force_per_length: Vector = (0.0, 0.0, 0.0)
    force_per_mass: Vector = (0.0, 0.0, 0.0)
    axes: str = "world"
    follower: bool = False
    factor: tuple[Profile, ...] = ()


class Event(Record, frozen=True):
    """A time at which a coordinate crosses a value: told after the run.

    Attributes
    ----------
    name : str
        What reports call it.
    coordinate : str
        ``angle`` or ``rate`` of a joint; ``x``, ``y`` or ``z`` of a point in the world.
    joint : str
        The joint that is watched; give this or ``point``.
    point : str
        The named point that is watched.
    value, value_deg : float, optional
        What is crossed [rad or m, per second for a rate], or in degrees for revolute joints; give one.
    direction : str
        ``any``, ``rising`` or ``falling``.
    stop : bool
        The run ends there.
    """

    name: str
    coordinate: str
    joint: str = ""
    point: str = ""
    value: float | None = None
    value_deg: float | None = None
    direction: str = "any"
    stop: bool = False


class Initial(Record, frozen=True):
    """How links start.

    Attributes
    ----------
    deformation : str
        ``zero``: undeformed; ``static``: in static equilibrium with the joints held.
    allow_unstable : bool
        Whether a static start may lie on an unstable equilibrium, with links loaded beyond buckling; refused otherwise.
    assemble : str
        ``rigid``: undeformed links must close the loops; ``elastic``: flexible ones are bent into place, and start in
        static equilibrium.
    """

    deformation: str = "zero"
    allow_unstable: bool = False
    assemble: str = "rigid"


class SceneRecord(SceneTables, frozen=True, kw_only=True):
    """A scene: a tree of links on joints, what closes and drives it, and how it is simulated.

    Attributes
    ----------
    simulation : Simulation
        How the motion is computed.
    joints : list of Joint
        From the ground outward, ``[[joints]]``; each stands on the link before unless it says otherwise.
    links : list of Link
        Joint k carries link k unless it says otherwise, ``[[links]]``.
    name : str
        Of the scene; that of the file unless given.
    gravity : (3,) floats
        In the world [m/s²].
    base : Base
        Where it stands.
    points : list of Point
        What is reported and drawn, ``[[points]]``.
    payloads : list of Payload
        Rigid bodies on points, ``[[payloads]]``.
    loads : list of Load
        Forces and moments on points and links, ``[[loads]]``.
    contacts : list of Contact
        Points that planes keep on their side, ``[[contacts]]``.
    initial : Initial
        How links start.
    loops : list of Loop
        Joints that close the chain, ``[[loops]]``.
    couplings : list of Coupling
        Joints that follow others by ratios, ``[[couplings]]``.
    events : list of Event
        Crossings that are told after the run, or end it, ``[[events]]``.
    sensors : list of AnySensor
        Instruments whose readings are columns of tables, files and reports, ``[[sensors]]``.
    servo : list of Servo
        Motions that `erls invert` finds the drives for, ``[[servo]]``.
    inverse : Inverse
        Which drives these are.
    plan : Plan
        A motion from rest to rest that `erls plan` finds.
    """

    simulation: Simulation
    joints: list[Joint]
    links: list[Link]
    base: Base = Base()
    points: list[Point] = []
    payloads: list[Payload] = []
    loads: list[Load] = []
    contacts: list[Contact] = []
    initial: Initial = Initial()
    loops: list[Loop] = []
    couplings: list[Coupling] = []
    events: list[Event] = []
    sensors: list[AnySensor] = []
    servo: list[Servo] = []
    inverse: Inverse = Inverse()
    plan: Plan = Plan()


@dataclass(frozen=True, repr=False)
class Scene(SceneFile):
    """A checked chain and its file."""

    record: SceneRecord
