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
    """Pose of the first Denavit-Hartenberg frame in the world; rotation about fixed x, then y, then z."""

    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)


class DH(_Record, frozen=True):
    """Denavit-Hartenberg row; ``convention`` is ``standard`` or ``modified``, with no default."""

    convention: str
    a: float = 0.0
    alpha: float | None = None
    alpha_deg: float | None = None
    d: float = 0.0
    theta: float | None = None
    theta_deg: float | None = None


class JointInitial(_Record, frozen=True):
    """Joint coordinate and rate at time 0; ``_deg`` for revolute joints."""

    position: float | None = None
    position_deg: float | None = None
    rate: float | None = None
    rate_deg: float | None = None


class Friction(_Record, frozen=True):
    """Coulomb friction ``force`` [N m or N], smooth around zero over ``transition_rate`` [rad/s or m/s]."""

    force: float
    transition_rate: float = 0.01


class Motor(_Record, frozen=True):
    """Rotor inertia [kg m²] behind a gear (reflected inertia: rotor_inertia · gear_ratio²), and the motor's own
    ``mass`` and ``inertia`` (about its centre, mesh axes), which sit on the outboard interface of the link before.
    """

    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)


class Rotor(_Record, frozen=True):
    """Rotor inertia [kg m²] behind a gear (reflected inertia: rotor_inertia · gear_ratio²), of a closing joint."""

    rotor_inertia: float = 0.0
    gear_ratio: float = 1.0


class Joint(_Record, frozen=True):
    """A joint between the link before it (or the ground) and its own link."""

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
    """A rigid link: mass [kg], centre of mass, inertia about it, and named positions, all in the link's frame."""

    mass: float
    points: dict[str, Vector]
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    inertia: Inertia = (0.0, 0.0, 0.0)


class MeshPose(_Record, frozen=True):
    """Pose of the link's mesh frame.

    ``frame``: in the link's Denavit-Hartenberg frame (``dh``), or in the frame of its inboard joint (``joint``).
    """

    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    frame: str = "dh"


class Link(_Record, frozen=True):
    """A link: exactly one of ``model`` (link description, reduced on the fly), ``modal_file`` and ``rigid``.

    ``elastic_modes`` keeps only the lowest ones; ``flexible = false`` none. ``reduction`` replaces fields of that table
    of the link description. ``inboard`` and ``outboard`` name the
    interfaces where the joints sit; the first and the second one unless given. ``damping`` replaces that of the
    modal file. ``substructures`` splits a link made of beams into so many rigidly joined pieces, each with a frame of
    its own that turns with the deformation (formulation ``ffr``; ``nodal`` needs none); mode counts then hold for
    every piece.
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
    """A named point whose position is reported: a named node or interface of a link, or the mesh node nearest to a
    ``position`` in the mesh frame.
    """

    name: str
    link: str
    node: str = ""
    position: Vector | None = None


class Payload(_Record, frozen=True):
    """A rigid body on a named point: mass [kg], inertia about its centre, centre from the point (mesh axes) [m]."""

    point: str
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)
    offset: Vector = (0.0, 0.0, 0.0)


class Event(_Record, frozen=True):
    """A time at which a coordinate crosses a value: ``angle`` or ``rate`` of a joint, ``x``, ``y`` or ``z`` of a named
    point in the world; ``direction`` is ``any``, ``rising`` or ``falling``; with ``stop`` the run ends there.
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
    """``deformation``: links start undeformed (``zero``) or in static equilibrium, joints held (``static``)."""

    deformation: str = "zero"


class Loop(_Record, frozen=True):
    """A joint that closes a loop, between a ``node`` of ``link`` and the ground, or ``to_node`` of ``to_link``; nodes
    are interfaces or named nodes.

    ``position``: where the node meets the ground, in the world; where it is at the initial joint coordinates unless
    given. ``axis``: in the world at those coordinates, fixed to both sides from then on; that of the joint which
    carries the link unless given.

    Drive, spring, damper, friction and rotor act along the coordinate of a revolute or prismatic one: how far the link
    has moved about or along the axis. It is ``coordinate`` at the initial joint coordinates; unless given, 0 there, or
    the distance of ``node`` from where it meets the other side.
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
    """A scene: a serial chain of joints and links, what closes and drives it, and how it is simulated."""

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
