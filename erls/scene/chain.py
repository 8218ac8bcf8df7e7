"""Scene files (TOML): the schema and its defaults, overrides.

Every record below is one table of the file; unknown keys are errors with a suggestion.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from erls.errors import Cause, SceneError
from erls.mechanism.drives import DriveRecord, FreeDrive
from erls.scene.check import check_scene
from erls.scene.integrators import FIXED_STEP
from erls.scene.overrides import apply_override
from fe_import.description.link import Damping, Inertia, Vector
from fe_import.files.toml import convert, read_toml


class _Record(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    pass


class Simulation(_Record, frozen=True):
    """How the motion is computed.

    Attributes
    ----------
    duration : float
        [s]
    formulation : str
        ``erls``; ``ffr``: floating frames of reference; or ``nodal``: finite elements with a frame per node, for links
        made of beams.
    gauge : str
        Of ``erls``: ``joint-angle`` (θ is the joint angle) or ``minimum-norm`` (five rows per joint, as in the paper).
    body_frame : str
        Of ``ffr``: ``tangent`` at the inboard interface, or ``mean-axis``.
    coordinates : str
        ``independent`` (joint angles), or, of ``ffr``, ``absolute``: the frames themselves, tied by joints with
        multipliers, index 3.
    elements_per_member : int, optional
        Of ``nodal``: elements of each member of a link, instead of the number in its description.
    integrator : str
        ``generalized_alpha``, ``lobatto``, one of SciPy's (``rk45``, ``dop853``, ``radau``, ``bdf``, ``lsoda``), or
        ``auto``: the one that fits; of ``nodal``, steps of generalized-α with a local error of ``tolerance`` / 1000.
        Unless given ``generalized_alpha`` where there is a ``step`` or where conditions tie the coordinates (loops,
        ``nodal``, absolute coordinates), otherwise ``auto``; `load_scene` puts its name here.
    step : float, optional
        Step of generalized-α [s], largest step of SciPy's; ``lobatto`` and ``auto`` go by ``tolerance`` alone.
    rtol, atol : float
        Tolerances of SciPy's integrators, ``atol`` in metres.
    output_step : float, optional
        Of the steps only the states at multiples of this time [s] are kept, or of a part of it that makes them 201 or
        more, and the steps around events, so that the memory and the file of a long run stay small; between those,
        motion is interpolated. All steps are kept unless given.
    tolerance : float
        Error of any point over the whole run [m] that ``lobatto`` and ``auto`` aim at.
    spectral_radius : float
        ρ∞ of generalized-α: 1 no numerical damping, 0 the most.
    effects : str or list of str
        Physical effects (`erls.mechanism.effects`) that are on: ``all``, ``auto`` (those that matter), or their names.
    effects_tolerance, effects_effort_tolerance : float
        Of ``auto``: error of the named points [m], and error of drive forces relative to their peak.
    bandwidth : float, optional
        Modes of the mechanism above this frequency [Hz] follow statically instead of being integrated; all vibrate
        unless given.
    """

    duration: float
    formulation: str = "erls"
    gauge: str = "joint-angle"
    body_frame: str = "tangent"
    coordinates: str = "independent"
    elements_per_member: int | None = None
    integrator: str = ""
    step: float | None = None
    output_step: float | None = None
    rtol: float = 1e-8
    atol: float = 1e-12
    tolerance: float = 1e-5
    spectral_radius: float = 0.8
    effects: str | list[str] = "all"
    effects_tolerance: float = 1e-4
    effects_effort_tolerance: float = 1e-2
    bandwidth: float | None = None


class Base(_Record, frozen=True):
    """Pose of the first Denavit-Hartenberg frame in the world.

    Attributes
    ----------
    position : (3,) floats
        Of its origin [m].
    rotation_deg : (3,) floats
        About fixed x, then y, then z [deg].
    """

    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)


class DH(_Record, frozen=True):
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


class JointInitial(_Record, frozen=True):
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


class Friction(_Record, frozen=True):
    """Coulomb friction, smooth around zero: ``force`` · tanh(rate / ``transition_rate``).

    Attributes
    ----------
    force : float
        Friction at large rates [N m or N].
    transition_rate : float
        Rate at which it reaches 76 % of that [rad/s or m/s].
    """

    force: float
    transition_rate: float = 0.01


class Motor(_Record, frozen=True):
    """The motor of a joint; its rotor acts on the joint, its mass sits on the outboard interface of the link before.

    Attributes
    ----------
    rotor_inertia : float
        Of the rotor about its axis [kg m²]; rotor_inertia · gear_ratio² is reflected to the joint.
    gear_ratio : float
        Turns of the rotor per turn of the joint, or rad/m.
    mass : float
        Of the motor [kg].
    inertia : (3,) floats or (3, 3) floats
        Of the motor about its centre [kg m²], mesh axes of the link before: [Ixx, Iyy, Izz], or a symmetric matrix.
    """

    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)


class Rotor(_Record, frozen=True):
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


class Joint(_Record, frozen=True):
    """A joint between the link before it (or the ground) and its own link; it moves about or along its z axis.

    Attributes
    ----------
    name : str
        What reports, events and ``--set`` call it.
    dh : DH
        Its Denavit-Hartenberg row.
    type : str
        ``revolute`` turns about z, ``prismatic`` slides along z.
    initial : JointInitial
        Coordinate and rate at time 0.
    drive : DriveRecord
        What moves it; nothing unless given.
    stiffness : float
        Of a spring in the joint [N m/rad or N/m].
    rest, rest_deg : float, optional
        Coordinate at which that spring is free of force [rad or m], or in degrees; 0 unless given.
    damping : float
        Viscous damping [N m s/rad or N s/m].
    friction : Friction, optional
        Coulomb friction; none unless given.
    motor : Motor
        Rotor inertia, and the mass of the motor.
    """

    name: str
    dh: DH
    type: str = "revolute"
    initial: JointInitial = JointInitial()
    drive: DriveRecord = FreeDrive()
    stiffness: float = 0.0
    rest: float | None = None
    rest_deg: float | None = None
    damping: float = 0.0
    friction: Friction | None = None
    motor: Motor = Motor()


class RigidBody(_Record, frozen=True):
    """A rigid link, in the link's frame.

    Attributes
    ----------
    mass : float
        [kg]
    points : dict of (3,) floats
        Named positions [m]. Each is an interface, where joints may sit, and a node for points and loops: the first is
        the inboard one, the second the outboard one, unless the link names others.
    centre_of_mass : (3,) floats
        [m]
    inertia : (3,) floats or (3, 3) floats
        About the centre of mass [kg m²]: [Ixx, Iyy, Izz], or a symmetric matrix.
    """

    mass: float
    points: dict[str, Vector]
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    inertia: Inertia = (0.0, 0.0, 0.0)


class MeshPose(_Record, frozen=True):
    """Pose of the link's mesh frame.

    Attributes
    ----------
    position : (3,) floats
        Of its origin [m].
    rotation_deg : (3,) floats
        About fixed x, then y, then z [deg].
    frame : str
        In which frame: the link's Denavit-Hartenberg frame, ``dh``, or the frame of its inboard joint, ``joint``.
    """

    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    frame: str = "dh"


class Link(_Record, frozen=True):
    """A link: exactly one of ``model``, ``modal_file`` and ``rigid``.

    Attributes
    ----------
    name : str
        What reports, points, loops and ``--set`` call it.
    model : str
        Link description, reduced on the fly; the path starts at the scene.
    modal_file : str
        Modal file; the path starts at the scene.
    rigid : RigidBody, optional
        A rigid link, stated here.
    flexible : bool
        False: rigid, with the mass of the model.
    elastic_modes : int, optional
        Keep only the lowest elastic modes of the model; all unless given.
    substructures : int
        Of ``ffr``: rigidly joined pieces of a link made of beams, each with a frame of its own that turns with the
        deformation; mode counts then hold for every piece. ``nodal`` needs none.
    reduction : dict
        With ``model``: fields that replace those of its table ``[reduction]``.
    inboard : str
        Interface of the link's own joint; the first unless given.
    outboard : str
        Interface of the next joint; the second unless given.
    mesh_pose : MeshPose
        Where the mesh frame sits.
    damping : Damping, optional
        Instead of that of the model.
    """

    name: str
    model: str = ""
    modal_file: str = ""
    rigid: RigidBody | None = None
    flexible: bool = True
    elastic_modes: int | None = None
    substructures: int = 1
    reduction: dict[str, Any] = {}
    inboard: str = ""
    outboard: str = ""
    mesh_pose: MeshPose = MeshPose()
    damping: Damping | None = None


class Point(_Record, frozen=True):
    """A named point whose position is reported and drawn.

    Attributes
    ----------
    name : str
        What reports, payloads and events call it.
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


class Payload(_Record, frozen=True):
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


class Event(_Record, frozen=True):
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


class Initial(_Record, frozen=True):
    """How links start.

    Attributes
    ----------
    deformation : str
        ``zero``: undeformed; ``static``: in static equilibrium with the joints held.
    """

    deformation: str = "zero"


class Loop(_Record, frozen=True):
    """A joint that closes a loop, between a node of a link and the ground, or a node of another link.

    Drive, spring, damper, friction and rotor act along the coordinate of a revolute or prismatic one: how far the link
    has moved about or along the axis.

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
    axis : (3,) floats, optional
        Direction in the world at the initial joint coordinates, fixed to both sides from then on; that of the joint
        which carries the link unless given.
    coordinate, coordinate_deg : float, optional
        Its coordinate at the initial joint coordinates [rad or m], or in degrees; unless given 0 if it turns, or the
        distance along the axis of ``node`` from where it meets the other side if it slides.
    drive : DriveRecord
        What moves it; nothing unless given.
    stiffness : float
        Of a spring in the joint [N m/rad or N/m].
    rest, rest_deg : float, optional
        Coordinate at which that spring is free of force [rad or m], or in degrees; 0 unless given.
    damping : float
        Viscous damping [N m s/rad or N s/m].
    friction : Friction, optional
        Coulomb friction; none unless given.
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
    coordinate: float | None = None
    coordinate_deg: float | None = None
    drive: DriveRecord = FreeDrive()
    stiffness: float = 0.0
    rest: float | None = None
    rest_deg: float | None = None
    damping: float = 0.0
    friction: Friction | None = None
    motor: Rotor = Rotor()


class SceneRecord(_Record, frozen=True):
    """A scene: a serial chain of joints and links, what closes and drives it, and how it is simulated.

    Attributes
    ----------
    simulation : Simulation
        How the motion is computed.
    joints : list of Joint
        From the ground outward, ``[[joints]]``.
    links : list of Link
        Joint k carries link k, ``[[links]]``.
    name : str
        Of the scene; that of the file unless given.
    gravity : (3,) floats
        In the world [m/s²].
    base : Base
        Where the chain stands.
    points : list of Point
        What is reported and drawn, ``[[points]]``.
    payloads : list of Payload
        Rigid bodies on points, ``[[payloads]]``.
    initial : Initial
        How links start.
    loops : list of Loop
        Joints that close the chain, ``[[loops]]``.
    events : list of Event
        Crossings that are told after the run, or end it, ``[[events]]``.
    """

    simulation: Simulation
    joints: list[Joint]
    links: list[Link]
    name: str = ""
    gravity: Vector = (0.0, 0.0, -9.81)
    base: Base = Base()
    points: list[Point] = []
    payloads: list[Payload] = []
    initial: Initial = Initial()
    loops: list[Loop] = []
    events: list[Event] = []


@dataclass(frozen=True)
class Scene:
    """A checked scene and its file; relative paths start at ``folder``."""

    path: Path
    record: SceneRecord

    @property
    def name(self) -> str:
        """Its name, or that of its file."""
        return self.record.name or self.path.name.removesuffix(".toml")

    @property
    def folder(self) -> Path:
        """Folder of the file."""
        return self.path.parent


def load_scene(path: Path | str, overrides: Iterable[str] = ()) -> Scene:
    """Read and check a scene.

    Parameters
    ----------
    path : Path or str
    overrides : iterable of str
        ``KEY=VALUE`` as on the command line: ``simulation.step=1e-4``, ``links.arm.elastic_modes=8``,
        ``joints.0.drive.type="free"``. Members of lists go by name or number.

    Raises
    ------
    SceneError
        Naming file, field, value and remedy.

    Examples
    --------
    >>> from erls import load_scene
    >>> scene = load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.5"])
    >>> scene.record.simulation.duration
    0.5
    """
    path = Path(path)
    data = read_toml(path, SceneError)
    for text in overrides:
        apply_override(data, text)
    if is_body_scene(data):
        message = "a scene of bodies, beams and connections, which is no chain of joints and links"
        remedy = "use erls simulate, or erls.run.bodies.solve"
        raise SceneError(Cause.BAD_FIELD, message, where=str(path), remedy=remedy)
    record = _with_integrator(convert(data, SceneRecord, str(path), SceneError))
    check_scene(record, str(path))
    return Scene(path, record)


def _with_integrator(record: SceneRecord) -> SceneRecord:
    """The record with the name of the integrator."""
    s = record.simulation
    if s.integrator:
        return record
    fixed = s.step is not None or record.loops or s.formulation == "nodal" or s.coordinates == "absolute"
    settings = msgspec.structs.replace(s, integrator=FIXED_STEP if fixed else "auto")
    return msgspec.structs.replace(record, simulation=settings)


def is_body_scene(data: dict[str, Any]) -> bool:
    """Whether the tables of a scene file are those of `erls.scene.bodies`."""
    return not {"bodies", "beams"}.isdisjoint(data) and {"joints", "links"}.isdisjoint(data)
