"""A scene of bodies as nodes, elements and joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beam, Beams
from erls.equations.nodal.elements import Elements
from erls.equations.nodal.joints import GROUND, Joint, Motion
from erls.equations.nodal.loads import NodalLoad, NodalLoads
from erls.equations.nodal.redundant import without_redundant
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.equations.nodal.scenes.beam_mesh import course
from erls.equations.nodal.scenes.contacts import contacts
from erls.equations.nodal.scenes.shell_mesh import Surface, surface
from erls.equations.nodal.scenes.springs import springs
from erls.equations.nodal.section import BeamSection, beam_section
from erls.equations.nodal.shell import Shells, lumped_shells
from erls.errors import Cause, SceneError
from erls.maths.groups import R3_SO3, SE3
from erls.maths.motion_maps import inverse
from erls.maths.se3 import pose
from erls.maths.so3 import Array, fixed_axes
from erls.mechanism.joint_types import JOINT_TYPES
from erls.mechanism.place import Place
from erls.mechanism.profiles import build_loads
from erls.scene.bodies.analyses import Dynamics
from erls.scene.bodies.schema import GROUND as GROUND_NAME
from erls.scene.bodies.schema import Beam as BeamRecord
from erls.scene.bodies.schema import BodyScene, BodySceneRecord, Connection, Load
from erls.scene.build_loops import two_axes
from erls.scene.contacts import WORLD
from fe_import.elements.sections import section_constants
from fe_import.files.toml import choose
from fe_import.models.inertia import inertia_matrix


@dataclass(frozen=True)
class Assembly:
    """The equations of a scene, and what its names stand for.

    Attributes
    ----------
    system : NodalSystem
        Its joints are the connections, in their order, with redundant conditions left out.
    full : NodalSystem
        The same with all conditions.
    left_out : tuple of str
        Names of the redundant ones.
    numbers : dict
        Of all nodes by name.
    reported : tuple of str
        Nodes whose places are reported.
    velocity : (n,) array
        At the start, as the system's group has it.
    beams : dict
        Elements of each beam, in their order.
    shells : dict
        Nodes and elements of each shell.
    """

    system: NodalSystem
    full: NodalSystem
    left_out: tuple[str, ...]
    numbers: dict[str, int]
    reported: tuple[str, ...]
    velocity: Array
    beams: dict[str, list[Beam]]
    shells: dict[str, Surface]

    @property
    def elements(self) -> int:
        """Number of elements of beams and shells."""
        return sum(map(len, self.beams.values())) + sum(len(s.elements) for s in self.shells.values())


def assemble(scene: BodyScene) -> Assembly:
    """Put a scene together.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.
    """
    record, file = scene.record, str(scene.path)
    numbers = {name: k for k, name in enumerate([*record.nodes, *(b.name for b in record.bodies)])}
    poses = [pose(position=np.array(x)) for x in record.nodes.values()]
    poses += [pose(fixed_axes(*np.radians(b.rotation_deg)), np.array(b.position)) for b in record.bodies]
    beams = {
        beam.name: _elements(record, beam, numbers, poses, f"{file}: beams[{k}]", file)
        for k, beam in enumerate(record.beams)
    }
    shells = {
        shell.name: surface(record, shell, numbers, poses, scene.folder, f"{file}: shells[{k}]")
        for k, shell in enumerate(record.shells)
    }
    _refuse_loose(record, beams, shells, numbers, file)
    record = _without_sets(record, shells, numbers, file)
    gravity, built = np.array(record.gravity), np.array(poses)
    plates = [element for own in shells.values() for element in own.elements]
    bodies = _bodies(record, numbers, file) + lumped_shells(plates, built)
    dynamic = isinstance(record.simulation, Dynamics)
    loads = [
        _load(x, numbers[x.node], Place(scene.folder, f"{file}: loads[{k}]"), dynamic)
        for k, x in enumerate(record.loads)
    ]
    elements: list[Elements] = []
    if beams:
        elements.append(Beams([e for own in beams.values() for e in own], built, gravity))
    if plates:
        elements.append(Shells(plates, built))
    if bodies:
        elements.append(RigidBodies(bodies, gravity))
    if loads:
        elements.append(NodalLoads(loads))
    elements += contacts(record, numbers, built, file)
    elements += springs(record, numbers, built, file)
    joints = [
        _joint(x, numbers, built, scene.folder, f"{file}: connections[{k}]") for k, x in enumerate(record.connections)
    ]
    world = isinstance(record.simulation, Dynamics) and record.simulation.group != "SE(3)"
    group = R3_SO3 if world else SE3
    full = NodalSystem(built, elements, joints, group)
    joints, left_out = without_redundant(full)
    system = NodalSystem(built, elements, joints, group) if left_out else full
    reported = tuple(dict.fromkeys([*record.nodes, *(b.name for b in record.bodies), *record.report]))
    velocity = _velocity(record, numbers, built, world)
    return Assembly(system, full, left_out, numbers, reported, velocity, beams, shells)


def _refuse_loose(
    record: BodySceneRecord,
    beams: dict[str, list[Beam]],
    shells: dict[str, Surface],
    numbers: dict[str, int],
    file: str,
) -> None:
    """A named node must be an end of a beam or lie on a shell."""
    used = {node for own in beams.values() for element in own for node in element.nodes}
    used |= {int(node) for own in shells.values() for node in own.nodes}
    for name in record.nodes:
        if numbers[name] not in used:
            message, remedy = "no beam ends at this node, and it lies on no shell", "move it onto one, or remove it"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{file}: nodes.{name}", remedy=remedy)


def _without_sets(
    record: BodySceneRecord, shells: dict[str, Surface], numbers: dict[str, int], file: str
) -> BodySceneRecord:
    """The record with a connection, mass or load for each node of a set.

    Raises
    ------
    SceneError
        BAD_REFERENCE: a node or set that a mesh does not have.
    """
    if not shells:
        return record
    sets = {name: found for own in shells.values() for name, found in own.sets.items()}
    names: dict[int, str] = {}
    for name, number in numbers.items():
        names.setdefault(number, name)
    changed: dict[str, list[Any]] = {}
    for kind in ("masses", "connections", "loads"):
        changed[kind] = []
        for k, item in enumerate(getattr(record, kind)):
            if item.node not in sets:
                choose(item.node, [*numbers, *sets], f"{file}: {kind}[{k}].node", SceneError)
                changed[kind].append(item)
                continue
            for number, share in zip(*sets[item.node], strict=True):
                own: dict[str, Any] = {"node": names[int(number)]}
                if kind == "connections":
                    own["name"] = f"{item.name}/{names[int(number)]}"
                elif kind == "masses":
                    own |= {"mass": item.mass * share, "inertia": (share * np.array(item.inertia)).tolist()}
                else:
                    own |= {part: tuple(share * x for x in getattr(item, part)) for part in ("force", "moment")}
                changed[kind].append(msgspec.structs.replace(item, **own))
    alone = [
        *((x.node, f"springs[{k}].node") for k, x in enumerate(record.springs)),
        *((x.node, f"contacts[{k}].node") for k, x in enumerate(record.contacts)),
        *((x.plane.on, f"contacts[{k}].plane.on") for k, x in enumerate(record.contacts) if x.plane.on != WORLD),
        *((x.to, f"{kind}[{k}].to") for kind in ("connections", "springs")
          for k, x in enumerate(getattr(record, kind)) if x.to != GROUND_NAME),
        *((name, f"sensors[{k}].point") for k, x in enumerate(record.sensors) if (name := getattr(x, "point", ""))),
        *((name, f"report[{k}]") for k, name in enumerate(record.report)),
    ]  # fmt: skip
    for name, field in alone:
        choose(name, list(numbers), f"{file}: {field}", SceneError)
    return msgspec.structs.replace(record, **changed)


def _elements(
    record: BodySceneRecord, beam: BeamRecord, numbers: dict[str, int], poses: list[Array], place: str, file: str
) -> list[Beam]:
    """Of one beam; its inner nodes are added to ``numbers`` and ``poses``."""
    ends = numbers[beam.start], numbers[beam.end]
    found = course(beam, poses[ends[0]][:3, 3], poses[ends[1]][:3, 3], place)
    chain = [ends[0]]
    for k, station in enumerate(found.stations[1:-1], start=1):
        name = f"{beam.name}/{k}"
        if name in numbers:
            raise SceneError(
                Cause.BAD_FIELD,
                "two nodes of one name: inner nodes of a beam are named NAME/1 ...",
                where=place,
                value=name,
                remedy="rename the node or the beam",
            )
        chain.append(len(poses))
        numbers[name] = len(poses)
        poses.append(pose(position=station[:3, 3]))
    chain.append(ends[1])
    section = _section(record, beam, file)
    warm = beam.temperature_change * (record.materials[beam.material].thermal_expansion or 0.0)
    ends_of = zip(chain[:-1], chain[1:], found.elements, strict=True)
    return [Beam((a, b), frames, section, warm) for a, b, frames in ends_of]


def _section(record: BodySceneRecord, beam: BeamRecord, file: str) -> BeamSection:
    material = record.materials[beam.material]
    place = f"{file}: sections.{beam.section}"
    s = section_constants(record.sections[beam.section], material.poissons_ratio, "saint-venant", place)
    e, density = material.youngs_modulus, material.density
    shear = e / (2 * (1 + material.poissons_ratio))
    rotary = beam.rotary_inertia or (density * s.inertia_y, density * s.inertia_z)
    return beam_section(
        e * s.area,
        (s.shear_factor_y * shear * s.area, s.shear_factor_z * shear * s.area),
        shear * s.torsion_constant,
        (e * s.inertia_y, e * s.inertia_z),
        density * s.area,
        rotary,
    )


def _bodies(record: BodySceneRecord, numbers: dict[str, int], file: str) -> list[RigidBody]:
    found = []
    for k, body in enumerate(record.bodies):
        inertia = inertia_matrix(body.inertia, f"{file}: bodies[{k}].inertia", SceneError)
        found.append(RigidBody(numbers[body.name], body.mass, inertia, np.array(body.centre_of_mass)))
    for k, point in enumerate(record.masses):
        inertia = inertia_matrix(point.inertia, f"{file}: masses[{k}].inertia", SceneError)
        found.append(RigidBody(numbers[point.node], point.mass, inertia))
    return found


def _joint(record: Connection, numbers: dict[str, int], poses: Array, folder: Path, place: str) -> Joint:
    node = numbers[record.node]
    other = GROUND if record.to == GROUND_NAME else numbers[record.to]
    where = poses[node, :3, 3] if record.position is None else np.array(record.position)
    frame = pose(_joint_axes(record, place), where)
    motion, breakpoints = _motion(record, folder, place)
    inner = frame if other == GROUND else inverse(poses[other]) @ frame
    ends = other, node, inner, inverse(poses[node]) @ frame
    return Joint(record.name, record.type, *ends, motion, breakpoints, pitch=record.pitch)


def _joint_axes(record: Connection, place: str) -> Array:
    """Columns of the joint's frame: z along its axis; of a universal joint x and y along the first and the second."""
    if record.axis is None:
        return np.eye(3)
    first = np.array(record.axis) / np.linalg.norm(record.axis)
    if record.second_axis is not None:
        return two_axes(first, record.second_axis, f"{place}.second_axis")
    across = np.cross(first, np.eye(3)[int(np.abs(first).argmin())])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(first, across), first], axis=1)


def _motion(record: Connection, folder: Path, place: str) -> tuple[Motion | None, tuple[float, ...]]:
    if record.motion is None:
        return None, ()
    driven = JOINT_TYPES[record.type].driven
    curve = record.motion.build(Place(folder, f"{place}.motion", revolute=driven is not None and driven.turns))
    start = curve.value(0.0)
    if abs(start) > 1e-12:
        raise SceneError(
            Cause.BAD_FIELD,
            "a prescribed motion starts at 0, where the scene is built",
            where=f"{place}.motion",
            value=start,
            remedy="subtract its first value",
        )
    return curve.derivatives, curve.breakpoints


def _load(record: Load, node: int, place: Place, dynamic: bool) -> NodalLoad:
    factor: Callable[[float], float] = (lambda t: 1.0) if dynamic else (lambda t: t)
    breakpoints: tuple[float, ...] = ()
    if record.factor:
        curve = build_loads(record.factor, place, "factor")
        factor, breakpoints = curve.value, curve.breakpoints
    wrench = np.array(record.force), np.array(record.moment)
    return NodalLoad(node, *wrench, record.follower, factor=factor, breakpoints=breakpoints)


def _velocity(record: BodySceneRecord, numbers: dict[str, int], poses: Array, world: bool) -> Array:
    """(n,) of the bodies; beams start at rest."""
    result = np.zeros((len(poses), 6))
    for body in record.bodies:
        node = numbers[body.name]
        turn = poses[node, :3, :3]
        result[node, :3] = np.array(body.velocity) if world else turn.T @ np.array(body.velocity)
        result[node, 3:] = turn.T @ np.array(body.angular_velocity)
    return result.ravel()
