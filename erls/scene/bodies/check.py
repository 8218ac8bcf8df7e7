"""The conditions on a scene of bodies that the types of its records cannot state."""

from __future__ import annotations

import math

from erls.errors import SceneError
from erls.mechanism.joint_types import DRIVEN_TYPES, HOLDING_TYPES, JOINT_TYPES
from erls.scene.bodies.analyses import GROUPS, TANGENTS, Analysis, Buckling, Continuation, Dynamics, Frequencies
from erls.scene.bodies.schema import (
    GROUND,
    Beam,
    BodySceneRecord,
    Connection,
    Load,
    ShellSurface,
    Spring,
    TurningSpring,
)
from erls.scene.check_sensors import check_sensors
from erls.scene.checks import (
    bad,
    check_joint_fields,
    check_names,
    check_stepping,
    check_tables,
    check_wrench,
    directed,
    not_negative,
    positive,
)
from erls.scene.contacts import WORLD, ContactOfBody
from erls.scene.integrators import MATRICES
from fe_import.description.check import check_expansion, check_temperature
from fe_import.elements.sections import check_section
from fe_import.files.toml import choose

FORMULATIONS = ("nodal",)
MOST_ELEMENTS = 100_000
EDGES = ("start", "end", "left", "right")
"""Sets of a patch of shells."""


def check_body_scene(scene: BodySceneRecord, file: str) -> None:
    """Refuse a scene that cannot be meant.

    Parameters
    ----------
    scene : BodySceneRecord
    file : str
        Name of the file, for messages.

    Raises
    ------
    SceneError, FEImportError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    check_tables(scene, file)
    _check_simulation(scene.simulation, f"{file}: simulation")
    nodes = _check_all_names(scene, file)
    _check_properties(scene, file)
    for k, beam in enumerate(scene.beams):
        _check_beam(beam, scene, nodes, f"{file}: beams[{k}]")
        if beam.temperature_change:
            where = f"{file}: materials.{beam.material}.thermal_expansion"
            check_expansion(scene.materials[beam.material], where, SceneError)
    nodes += [f"{b.name}/{k}" for b in scene.beams for k in range(1, b.elements)]
    for k, shell in enumerate(scene.shells):
        _check_shell(shell, scene, nodes, f"{file}: shells[{k}]")
    nodes += [name for shell in scene.shells for name in _of_shell(shell, scene)]
    for k, mass in enumerate(scene.masses):
        choose(mass.node, nodes, f"{file}: masses[{k}].node", SceneError)
        not_negative(f"{file}: masses[{k}].mass", mass.mass)
    for k, connection in enumerate(scene.connections):
        _check_connection(connection, nodes, f"{file}: connections[{k}]")
    for k, spring in enumerate(scene.springs):
        _check_spring(spring, nodes, f"{file}: springs[{k}]")
    for k, load in enumerate(scene.loads):
        _check_load(load, nodes, f"{file}: loads[{k}]")
    for k, contact in enumerate(scene.contacts):
        _check_contact(contact, nodes, f"{file}: contacts[{k}]")
    if scene.sensors and not isinstance(scene.simulation, Dynamics):
        message = "sensors read motions, and nothing moves here"
        raise bad(f"{file}: sensors", message, len(scene.sensors), 'remove them, or use simulation.type = "dynamics"')
    joints = [joint.name for joint in scene.connections]
    check_sensors(scene.sensors, file, {}, {*nodes, *joints, "t", "energy"})
    for k, name in enumerate(scene.report):
        choose(name, nodes, f"{file}: report[{k}]", SceneError)
    ends = {end for beam in scene.beams for end in (beam.start, beam.end)}
    ends |= {corner for shell in scene.shells for corner in shell.corners or ()}
    for name in scene.nodes:
        if name not in ends and all(shell.corners for shell in scene.shells):
            message = "no beam ends at this node, and no shell"
            raise bad(f"{file}: nodes.{name}", message, None, "remove it, or add what ends there")


def _check_simulation(s: Analysis, place: str) -> None:
    choose(s.formulation, FORMULATIONS, f"{place}.formulation", SceneError)
    if isinstance(s, Dynamics):
        check_stepping(s, place)
        positive(f"{place}.tolerance", s.tolerance)
        choose(s.group, GROUPS, f"{place}.group", SceneError)
        choose(s.iteration_matrix, MATRICES, f"{place}.iteration_matrix", SceneError)
        not_negative(f"{place}.newton_tolerance", s.newton_tolerance)
        if not 0 <= s.residual_tolerance < 1:
            raise bad(f"{place}.residual_tolerance", "not a share", s.residual_tolerance, "give 0 or more, below 1")
        return
    choose(s.tangent, TANGENTS, f"{place}.tangent", SceneError)
    if not 1 <= s.load_steps <= 10_000:
        raise bad(f"{place}.load_steps", "no such number of load steps", s.load_steps, "give 1 to 10000")
    if isinstance(s, Continuation):
        positive(f"{place}.load", s.load)
        if s.tangent != "full":
            raise bad(f"{place}.tangent", "paths need the full tangent", s.tangent, 'give "full", or leave it out')
        if not 1 <= s.most_steps <= 10_000:
            raise bad(f"{place}.most_steps", "no such number of steps", s.most_steps, "give 1 to 10000")
    if isinstance(s, (Buckling, Frequencies)):
        if s.count < 1:
            raise bad(f"{place}.count", "a count must be positive", s.count, "give 1 or more")
        not_negative(f"{place}.load", s.load)


def _check_all_names(scene: BodySceneRecord, file: str) -> list[str]:
    """Names of nodes and bodies, which differ from each other and from the ground."""
    bodies = [(f"{file}: bodies[{k}].name", body.name) for k, body in enumerate(scene.bodies)]
    named = [(f"{file}: nodes.{name}", name) for name in scene.nodes] + bodies
    check_names([("", GROUND), *named])
    for kind in ("beams", "shells", "connections", "contacts"):
        check_names((f"{file}: {kind}[{k}].name", x.name) for k, x in enumerate(getattr(scene, kind)))
    if not (scene.bodies or scene.beams or scene.shells):
        remedy = "add [[bodies]], [[beams]] or [[shells]]"
        raise bad(f"{file}: bodies", "a scene needs a body, a beam or a shell", None, remedy)
    return [name for _, name in named]


def _check_properties(scene: BodySceneRecord, file: str) -> None:
    for name, material in scene.materials.items():
        place = f"{file}: materials.{name}"
        if not material.youngs_modulus > 0:
            raise bad(f"{place}.youngs_modulus", "must be positive", material.youngs_modulus, "give pascals")
        if not -1 < material.poissons_ratio <= 0.5:
            message = "Poisson's ratio out of range"
            raise bad(f"{place}.poissons_ratio", message, material.poissons_ratio, "give -1 to 0.5")
        not_negative(f"{place}.density", material.density)
    for name, section in scene.sections.items():
        check_section(section, f"{file}: sections.{name}")
    for k, body in enumerate(scene.bodies):
        not_negative(f"{file}: bodies[{k}].mass", body.mass)


def _check_beam(beam: Beam, scene: BodySceneRecord, nodes: list[str], place: str) -> None:
    choose(beam.start, nodes, f"{place}.from", SceneError)
    choose(beam.end, nodes, f"{place}.to", SceneError)
    choose(beam.section, scene.sections, f"{place}.section", SceneError)
    choose(beam.material, scene.materials, f"{place}.material", SceneError)
    check_temperature(beam.temperature_change, f"{place}.temperature_change", SceneError)
    if beam.start == beam.end:
        raise bad(f"{place}.to", "a beam runs between two nodes", beam.end, "name another node")
    if not 1 <= beam.elements <= MOST_ELEMENTS:
        message = "no such number of elements"
        raise bad(f"{place}.elements", message, beam.elements, f"give 1 to {MOST_ELEMENTS}")
    if beam.local_z is not None and not any(beam.local_z):
        raise bad(f"{place}.local_z", "a direction is needed", beam.local_z, "give a direction across the beam")
    if beam.rotary_inertia is not None and not all(0 <= x < math.inf for x in beam.rotary_inertia):
        message = "no beam has this"
        raise bad(f"{place}.rotary_inertia", message, beam.rotary_inertia, "give two finite numbers, not negative")


def _check_shell(shell: ShellSurface, scene: BodySceneRecord, nodes: list[str], place: str) -> None:
    if [shell.corners is not None, bool(shell.mesh), bool(shell.places)].count(True) != 1:
        message = "a shell lies between four corners or comes from a mesh"
        raise bad(place, message, shell.mesh or None, "give one of 'corners' and 'mesh', or 'places' with 'cells'")
    numbers = [k for row in (*shell.cells, *shell.sets.values()) for k in row]
    if numbers and not (min(numbers) >= 0 and max(numbers) < len(shell.places)):
        raise bad(f"{place}.cells", "numbers of places that are not there", max(numbers), "they count from 0")
    if bool(shell.places) != bool(shell.cells):
        raise bad(f"{place}.cells", "'places' and 'cells' go together", None, "give both, or a mesh")
    for k, corner in enumerate(shell.corners or ()):
        choose(corner, nodes, f"{place}.corners[{k}]", SceneError)
    if shell.corners is not None and len(set(shell.corners)) < 4:
        raise bad(f"{place}.corners", "four different nodes", list(shell.corners), "name each once")
    if not all(n >= 1 for n in shell.elements) or shell.elements[0] * shell.elements[1] > MOST_ELEMENTS:
        message = "no such number of elements"
        raise bad(f"{place}.elements", message, list(shell.elements), f"give 1 or more, {MOST_ELEMENTS} in all at most")
    if any(sign in shell.name for sign in "/:"):
        raise bad(f"{place}.name", "a name of a shell has no / and no :", shell.name, "they name its nodes and sets")
    choose(shell.material, scene.materials, f"{place}.material", SceneError)
    positive(f"{place}.thickness", shell.thickness)
    if not 0 < shell.drilling <= 10:
        raise bad(f"{place}.drilling", "no such share", shell.drilling, "give more than 0, and at most 10")
    if not 0 <= shell.fold_deg <= 180:
        raise bad(f"{place}.fold_deg", "no such angle", shell.fold_deg, "give 0 to 180 degrees")


def _of_shell(shell: ShellSurface, scene: BodySceneRecord) -> list[str]:
    """Names of the nodes and sets of a patch; what is said of those of a mesh, which are known when it is read."""
    if shell.corners is None:
        asked = [*(x.node for x in (*scene.masses, *scene.connections, *scene.springs, *scene.loads, *scene.contacts))]
        asked += [*(x.to for x in (*scene.connections, *scene.springs)), *scene.report]
        asked += [getattr(sensor, "point", "") for sensor in scene.sensors]
        return [name for name in asked if name.startswith((f"{shell.name}/", f"{shell.name}:"))]
    along, across = shell.elements
    inside = {(0, 0), (along, 0), (along, across), (0, across)}  # corners have names of their own
    found = [(i, j) for i in range(along + 1) for j in range(across + 1) if (i, j) not in inside]
    return [*(f"{shell.name}/{i}/{j}" for i, j in found), *(f"{shell.name}:{edge}" for edge in EDGES)]


def _check_connection(joint: Connection, nodes: list[str], place: str) -> None:
    choose(joint.type, HOLDING_TYPES, f"{place}.type", SceneError)
    choose(joint.node, nodes, f"{place}.node", SceneError)
    choose(joint.to, [GROUND, *nodes], f"{place}.to", SceneError)
    if joint.node == joint.to:
        raise bad(f"{place}.to", "a connection needs two nodes", joint.to, "name another node, or the ground")
    check_joint_fields(joint, joint.type, place)
    wanted = JOINT_TYPES[joint.type].axes
    for k, name in enumerate(("axis", "second_axis")):
        axis = getattr(joint, name)
        if axis is None and k < wanted:
            raise bad(f"{place}.{name}", f"a {joint.type} joint needs it", None, "give its direction in the world")
        if axis is not None and k >= wanted:
            raise bad(f"{place}.{name}", f"a {joint.type} joint has none", axis, "remove it")
        directed(f"{place}.{name}", axis)
    if joint.motion is not None and JOINT_TYPES[joint.type].driven is None:
        message = "its motion cannot be prescribed"
        raise bad(f"{place}.motion", message, joint.type, f"let the joint be one of {', '.join(DRIVEN_TYPES)}")


def _check_spring(spring: Spring, nodes: list[str], place: str) -> None:
    choose(spring.node, nodes, f"{place}.node", SceneError)
    choose(spring.to, [GROUND, *nodes], f"{place}.to", SceneError)
    if spring.node == spring.to:
        raise bad(f"{place}.to", "a spring needs two ends", spring.to, "name another node, or the ground")
    not_negative(f"{place}.stiffness", spring.stiffness)
    not_negative(f"{place}.damping", spring.damping)
    if isinstance(spring, TurningSpring):
        directed(f"{place}.axis", spring.axis)
        return
    not_negative(f"{place}.length", spring.length or 0.0)
    if spring.to == GROUND and spring.to_position is None:
        raise bad(f"{place}.to_position", "where on the ground", None, "give its position in the world")


def _check_contact(contact: ContactOfBody, nodes: list[str], place: str) -> None:
    choose(contact.node, nodes, f"{place}.node", SceneError)
    choose(contact.plane.on, [WORLD, *nodes], f"{place}.plane.on", SceneError)
    if contact.plane.on == contact.node:
        remedy = "name another node, or the world"
        raise bad(f"{place}.plane.on", "the node that the plane is to keep off", contact.plane.on, remedy)
    if contact.friction is not None and contact.friction.law == "stick":
        message, remedy = "no exact sticking of bodies", "use law = 'smooth', or a scene of links"
        raise bad(f"{place}.friction.law", message, "stick", remedy)


def _check_load(load: Load, nodes: list[str], place: str) -> None:
    choose(load.node, nodes, f"{place}.node", SceneError)
    check_wrench(place, load.force, load.moment)
