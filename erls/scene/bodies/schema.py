"""The records of a scene of bodies: every one is a table of the file, and unknown keys are errors with a suggestion.

Positions, directions and velocities are those of the world, as built; angles in degrees where a name ends in ``_deg``.
"""

from __future__ import annotations

import msgspec

from erls.mechanism.motions import Motion
from erls.mechanism.profiles import Load as Profile
from erls.scene.bodies.analyses import Analysis
from fe_import.description.link import Inertia, Material, Vector
from fe_import.elements.sections import Section

GROUND = "ground"


class _Record(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    pass


class Body(_Record, frozen=True):
    """A rigid body; its frame is a node of the same name.

    ``position`` and ``rotation_deg`` (about fixed x, then y, then z) place the frame; ``centre_of_mass`` lies in it,
    and ``inertia`` is about the centre of mass in the axes of the frame. ``velocity`` is that of the frame's origin.
    """

    name: str
    mass: float
    inertia: Inertia = (0.0, 0.0, 0.0)
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    velocity: Vector = (0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)


class Beam(_Record, frozen=True):
    """A beam between two nodes or bodies: straight, or an arc ``through`` a third point.

    Its inner nodes are NAME/1, NAME/2 ... ``local_z``, at its start, is the direction of the section's height, z unless
    given (y for beams along z); an arc carries it along, and ``twist_deg`` turns it about the beam from start to end.
    ``chords``: straight elements between nodes on the arc.
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


class PointMass(_Record, frozen=True):
    """Mass [kg], and inertia about the node in the axes of its frame, added to a node."""

    node: str
    mass: float
    inertia: Inertia = (0.0, 0.0, 0.0)


class Connection(_Record, frozen=True):
    """A joint between a ``node`` and the ground or another node.

    It sits at ``position``, where ``node`` is unless given. ``axis``: of revolute, prismatic and cylindrical joints,
    and the one of a universal joint that is fixed to ``to``, with ``second_axis`` fixed to ``node``. ``motion``
    prescribes the coordinate of a revolute or prismatic joint, from 0 on; at rest over the load parameter.
    """

    name: str
    type: str
    node: str
    to: str = GROUND
    position: Vector | None = None
    axis: Vector | None = None
    second_axis: Vector | None = None
    motion: Motion | None = None


class LineSpring(_Record, frozen=True, tag_field="type", tag="line"):
    """A spring [N/m] and damper [N s/m] along the line from ``to_position`` on the ground or the node ``to`` to
    ``position`` on ``node``; where the nodes are unless given. ``length`` without force: as built unless given.
    """

    node: str
    to: str = GROUND
    position: Vector | None = None
    to_position: Vector | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    length: float | None = None


class TurningSpring(_Record, frozen=True, tag_field="type", tag="turning"):
    """A torsion spring [N m/rad] and damper [N m s/rad] about an ``axis``, between a ``node`` and the ground or ``to``;
    without moment at ``rest_deg`` from where it is built.
    """

    node: str
    axis: Vector
    to: str = GROUND
    stiffness: float = 0.0
    damping: float = 0.0
    rest_deg: float = 0.0


Spring = LineSpring | TurningSpring


class Load(_Record, frozen=True):
    """A force [N] and a moment [N m] at a node, in the world's axes, or with ``follower`` in those of the node's frame.

    ``factor``: profiles over time, which add up; at rest over the load parameter. Unless given, loads act in full
    during a motion and grow with the load parameter at rest.
    """

    node: str
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)
    follower: bool = False
    factor: tuple[Profile, ...] = ()


class BodySceneRecord(_Record, frozen=True):
    """A scene: named ``nodes`` that beams run between, bodies, what connects and loads them, and what is to be found.

    ``report``: nodes whose places are reported beside named nodes and bodies, such as BEAM/4.
    """

    simulation: Analysis
    name: str = ""
    gravity: Vector = (0.0, 0.0, -9.81)
    materials: dict[str, Material] = {}
    sections: dict[str, Section] = {}
    nodes: dict[str, Vector] = {}
    bodies: list[Body] = []
    beams: list[Beam] = []
    masses: list[PointMass] = []
    connections: list[Connection] = []
    springs: list[Spring] = []
    loads: list[Load] = []
    report: list[str] = []
