"""The records of a scene of bodies: every one is a table of the file, and unknown keys are errors with a suggestion.

Positions, directions and velocities are those of the world, as built; angles in degrees where a name ends in ``_deg``.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from erls.mechanism.motions import Motion
from erls.mechanism.profiles import Load as Profile
from erls.mechanism.sensors.registry import AnySensor
from erls.scene.bodies.analyses import Analysis
from erls.scene.contacts import ContactOfBody
from erls.scene.records import Record, SceneFile, SceneTables
from fe_import.description.base import Inertia, Vector
from fe_import.description.records import Material, PointMass
from fe_import.elements.sections import Section

GROUND = "ground"


class Body(Record, frozen=True):
    """A rigid body; its frame is a node of the same name.

    Attributes
    ----------
    name : str
        Of the body and of its node.
    mass : float
        [kg]
    inertia : (3,) floats or (3, 3) floats
        About the centre of mass [kg m²], in the axes of the frame: [Ixx, Iyy, Izz], or a symmetric matrix.
    centre_of_mass : (3,) floats
        In the frame [m].
    position : (3,) floats
        Of the frame's origin, as built [m].
    rotation_deg : (3,) floats
        Of the frame about fixed x, then y, then z, as built [deg].
    velocity : (3,) floats
        Of the frame's origin at time 0 [m/s], axes of the world.
    angular_velocity : (3,) floats
        At time 0 [rad/s], axes of the world.
    """

    name: str
    mass: float
    inertia: Inertia = (0.0, 0.0, 0.0)
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    velocity: Vector = (0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)


class Beam(Record, frozen=True):
    """A beam between two nodes or bodies: straight, or an arc. Its inner nodes are NAME/1, NAME/2 ...

    Attributes
    ----------
    name : str
        Of the beam and of its inner nodes.
    start, end : str
        Nodes or bodies.
    section : str
        A name from ``[sections]``; needed.
    material : str
        A name from ``[materials]``; needed.
    elements : int
        Elements of equal length.
    through : (3,) floats, optional
        An arc runs through this point [m]; straight unless given.
    chords : bool
        Straight elements between nodes on the arc.
    local_z : (3,) floats, optional
        Direction of the section's height at the start of the beam, carried along by an arc; z, or y for beams along z,
        unless given.
    twist_deg : float
        How far the section turns about the beam from start to end [deg].
    temperature_change : float
        From that of its shape without stress [K]; its material needs a ``thermal_expansion``.
    rotary_inertia : (2,) floats, optional
        Per length, about the section's y and z [kg m], about its axis their sum; that of material and section unless
        given.
    """

    name: str
    start: str = msgspec.field(name="from")
    end: str = msgspec.field(name="to")
    section: str = ""
    material: str = ""
    elements: int = 1
    through: Vector | None = None
    chords: bool = False
    local_z: Vector | None = None
    twist_deg: float = 0.0
    temperature_change: float = 0.0
    rotary_inertia: tuple[float, float] | None = None


class ShellSurface(Record, frozen=True):
    """A geometrically exact shell: a flat or twisted patch between four nodes, or a mesh.

    Attributes
    ----------
    name : str
        Of the shell and of its nodes: NAME/I/J of a patch, NAME/K of a mesh, K from 0 in the order of its file. Their
        sets are NAME:SET; a connection, mass or load of a set is one of each of its nodes, loads in shares of the
        length of its edges. A patch has the sets ``start``, ``end``, ``left`` and ``right``.
    corners : (4,) str
        Nodes or bodies around a patch: I runs from the first to the second, J from the first to the fourth.
    elements : (2,) int
        Of a patch, along I and J.
    mesh : str
        Instead of corners: a file of quadrangles and triangles, in metres; named nodes that lie on one of its nodes are
        the same.
    places, cells, sets : lists
        Instead of a file what it holds: positions [m], four of these around each quadrangle, sets of these by name.
    material : str
        A name from ``[materials]``; needed.
    thickness : float
        [m]; needed.
    offset : float
        Height of the middle of the thickness above the nodes, along the normal [m].
    drilling : float
        Stiffness against rotations about the normal that the surface does not share, in shares of its shear stiffness.
    fold_deg : float
        Elements that meet at a larger angle keep their own normals: a fold; the others share one [deg].
    """

    name: str
    corners: tuple[str, str, str, str] | None = None
    elements: tuple[int, int] = (1, 1)
    mesh: str = ""
    places: list[Vector] = []
    cells: list[tuple[int, int, int, int]] = []
    sets: dict[str, list[int]] = {}
    material: str = ""
    thickness: float = 0.0
    offset: float = 0.0
    drilling: float = 1.0
    fold_deg: float = 25.0


class Connection(Record, frozen=True):
    """A joint between a node and the ground or another node.

    Attributes
    ----------
    name : str
        What reports call it.
    type : str
        What it leaves free.
    node : str
        A node, a body, an inner node of a beam, a node or a set of a shell.
    to : str
        Another one.
    position : (3,) floats, optional
        Where the joint sits, as built [m]; where ``node`` is unless given.
    axis : (3,) floats, optional
        Of revolute, prismatic, screw and cylindrical joints; the one of a universal joint that is fixed to ``to``.
    second_axis : (3,) floats, optional
        The axis of a universal joint that is fixed to ``node``.
    pitch : float
        Of a screw, which needs it: how far it advances along its axis per radian [m/rad].
    motion : Motion, optional
        Prescribed coordinate of a revolute, prismatic or screw joint, from 0 on; at rest over the load parameter.
    """

    name: str
    type: str
    node: str
    to: str = GROUND
    position: Vector | None = None
    axis: Vector | None = None
    second_axis: Vector | None = None
    pitch: float = 0.0
    motion: Motion | None = None


class LineSpring(Record, frozen=True, tag_field="type", tag="line"):
    """A spring and damper along the line between two points.

    Attributes
    ----------
    node : str
        A node, a body, or an inner node of a beam.
    to : str
        Another one.
    position : (3,) floats, optional
        End on ``node``, as built [m]; where it is unless given.
    to_position : (3,) floats, optional
        End on ``to``, as built [m]; where that node is unless given. The ground needs it.
    stiffness : float
        [N/m]
    damping : float
        [N s/m]
    length : float, optional
        Without force [m]; as built unless given.
    """

    node: str
    to: str = GROUND
    position: Vector | None = None
    to_position: Vector | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    length: float | None = None


class TurningSpring(Record, frozen=True, tag_field="type", tag="turning"):
    """A torsion spring and damper about an axis.

    Attributes
    ----------
    node : str
        A node, a body, or an inner node of a beam.
    axis : (3,) floats
        In the world, as built.
    to : str
        Another one.
    stiffness : float
        [N m/rad]
    damping : float
        [N m s/rad]
    rest_deg : float
        Angle from where it is built at which there is no moment [deg].
    """

    node: str
    axis: Vector
    to: str = GROUND
    stiffness: float = 0.0
    damping: float = 0.0
    rest_deg: float = 0.0


Spring = LineSpring | TurningSpring


class Load(Record, frozen=True):
    """A force and a moment at a node, or over a set of a shell's nodes.

    Attributes
    ----------
    node : str
        A node, a body, an inner node of a beam, a node or a set of a shell.
    force : (3,) floats
        [N], in the world's axes.
    moment : (3,) floats
        [N m], in the world's axes.
    follower : bool
        Force and moment turn with the node: they are those of the node's frame.
    factor : list of Load
        Profiles over time, which add up; at rest over the load parameter. Unless given, loads act in full during a
        motion and grow with the load parameter at rest.
    """

    node: str
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)
    follower: bool = False
    factor: tuple[Profile, ...] = ()


class BodySceneRecord(SceneTables, frozen=True, kw_only=True):
    """A scene: named nodes, beams and shells between them, bodies, what joins and loads them, and what is to be found.

    Attributes
    ----------
    simulation : Analysis
        What is to be found.
    name : str
        Of the scene; that of the file unless given.
    gravity : (3,) floats
        In the world [m/s²].
    materials : dict of Material
        By name, as in link descriptions.
    sections : dict of Section
        By name, as in link descriptions.
    nodes : dict of (3,) floats
        Where beams end [m]; their axes are those of the world.
    bodies : list of Body
        Rigid bodies, ``[[bodies]]``.
    beams : list of Beam
        Geometrically exact beams, ``[[beams]]``.
    shells : list of ShellSurface
        Geometrically exact shells, ``[[shells]]``.
    masses : list of PointMass
        Rigid masses on nodes, ``[[masses]]``.
    connections : list of Connection
        Joints, ``[[connections]]``.
    springs : list of Spring
        Springs and dampers, ``[[springs]]``.
    loads : list of Load
        Forces and moments, ``[[loads]]``.
    contacts : list of ContactOfBody
        Nodes that planes keep on their side, ``[[contacts]]``.
    report : list of str
        Nodes whose places are reported beside named nodes and bodies, such as BEAM/4.
    sensors : list of AnySensor
        Instruments of a motion, whose ``point`` is a node or body and whose ``joint`` a connection with one coordinate,
        ``[[sensors]]``; nothing is recovered from beams, and connections have no motors.
    """

    simulation: Analysis
    materials: dict[str, Material] = {}
    sections: dict[str, Section] = {}
    nodes: dict[str, Vector] = {}
    bodies: list[Body] = []
    beams: list[Beam] = []
    shells: list[ShellSurface] = []
    masses: list[PointMass] = []
    connections: list[Connection] = []
    springs: list[Spring] = []
    loads: list[Load] = []
    contacts: list[ContactOfBody] = []
    report: list[str] = []
    sensors: list[AnySensor] = []


@dataclass(frozen=True, repr=False)
class BodyScene(SceneFile):
    """A checked scene of bodies and its file."""

    record: BodySceneRecord
