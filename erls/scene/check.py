"""The conditions on a chain that the types of its records cannot state, checked before any link is reduced."""

from __future__ import annotations

from erls.errors import SceneError
from erls.mechanism.dh import CONVENTIONS
from erls.mechanism.drives import MotionDrive
from erls.mechanism.joint_types import CHAIN_TYPES, HOLDING_TYPES, JOINT_TYPES, SINGLE_TYPES
from erls.scene.build_joints import GROUND, joint_coordinates
from erls.scene.chain import Event, Load, SceneRecord
from erls.scene.check_bushings import check_bushings
from erls.scene.check_circuits import charge_name, check_circuits, circuits, has_circuit
from erls.scene.check_couplings import check_couplings
from erls.scene.check_sensors import check_sensors
from erls.scene.check_servo import check_plan, check_servo
from erls.scene.check_settings import check_settings
from erls.scene.check_sticking import check_sticking
from erls.scene.checks import (
    bad,
    check_ends,
    check_joint_fields,
    check_names,
    check_tables,
    directed,
    not_negative,
    refuse_settings,
)
from erls.scene.contacts import WORLD, Contact
from erls.scene.joints import Acting, Coordinate, Joint, Loop
from erls.scene.links import Link
from fe_import.description.check import check_damping, check_temperature
from fe_import.files.toml import choose

DIRECTIONS = ("any", "rising", "falling")  # of events
OF_JOINTS, OF_POINTS = ("angle", "rate"), ("x", "y", "z")
FRAMES = ("dh", "joint")
DEFORMATIONS = ("zero", "static")
_TIED = ("joints", "loops", "bushings", "couplings")  # whose names are those of coordinates and reactions
ASSEMBLIES = ("rigid", "elastic")
AXES = ("world", "link")  # of loads
# on one coordinate
_ACTING = (
    "coordinate", "coordinate_deg", "drive", "stiffness", "rest", "rest_deg", "damping", "friction", "stops", "motor",
)  # fmt: skip


def check_scene(scene: SceneRecord, file: str) -> None:
    """Refuse a scene that cannot be meant.

    Parameters
    ----------
    scene : SceneRecord
    file : str
        Name of the file, for messages.

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    check_tables(scene, file)
    check_settings(scene.simulation, f"{file}: simulation")
    choose(scene.initial.deformation, DEFORMATIONS, f"{file}: initial.deformation", SceneError)
    choose(scene.initial.assemble, ASSEMBLIES, f"{file}: initial.assemble", SceneError)
    if scene.initial.assemble == "elastic":
        _check_assembly(scene, f"{file}: initial.assemble")
    if not scene.joints:
        raise bad(f"{file}: joints", "a scene needs at least one joint", None, "add [[joints]]")
    if len(scene.joints) != len(scene.links):
        counts = f"{len(scene.links)} links, {len(scene.joints)} joints"
        message = "joint k carries link k, so there must be as many links as joints"
        raise bad(f"{file}: links", message, counts, "add or remove one")
    for kind in ("joints", "links", "points", "contacts", "loops", "bushings", "couplings", "events"):
        named = [(f"{file}: {kind}[{k}].name", item.name) for k, item in enumerate(getattr(scene, kind))]
        check_names(named)
    tied = [(f"{file}: {kind}[{k}].name", item.name) for kind in _TIED for k, item in enumerate(getattr(scene, kind))]
    check_names(tied)
    taken = {name for _, name in tied}
    for k, joint in enumerate(scene.joints):
        choose(joint.type, CHAIN_TYPES, f"{file}: joints[{k}].type", SceneError)
        choose(joint.dh.convention, CONVENTIONS, f"{file}: joints[{k}].dh.convention", SceneError)
        _check_place(scene, k, f"{file}: joints[{k}]")
        _check_coordinates(joint, f"{file}: joints[{k}]")
    for k, link in enumerate(scene.links):
        _check_link(link, f"{file}: links[{k}]")
        _check_substructures(link, scene.simulation.formulation, f"{file}: links[{k}].substructures")
    for k, point in enumerate(scene.points):
        choose(point.link, [link.name for link in scene.links], f"{file}: points[{k}].link", SceneError)
        if bool(point.node) == (point.position is not None):
            remedy = "name a node of the link, or give a position in its mesh frame"
            raise bad(f"{file}: points[{k}]", "give exactly one of 'node' and 'position'", point.name, remedy)
    for k, payload in enumerate(scene.payloads):
        choose(payload.point, [p.name for p in scene.points], f"{file}: payloads[{k}].point", SceneError)
    for k, load in enumerate(scene.loads):
        _check_load(load, scene, f"{file}: loads[{k}]")
    for k, contact in enumerate(scene.contacts):
        _check_contact(contact, scene, f"{file}: contacts[{k}]")
    for k, loop in enumerate(scene.loops):
        _check_loop(loop, scene, f"{file}: loops[{k}]")
    for k, event in enumerate(scene.events):
        _check_event(event, scene, f"{file}: events[{k}]")
    check_bushings(scene, file)
    check_circuits(scene, file, taken)
    check_couplings(scene, file)
    _check_sensors(scene, file, taken)
    check_servo(scene, file)
    check_plan(scene, file)
    if scene.simulation.bandwidth is not None:
        _check_bandwidth(scene, f"{file}: simulation.bandwidth")
    _check_compound(scene, f"{file}: simulation")
    check_sticking(scene, file)
    if scene.loops or scene.bushings or scene.couplings or circuits(scene):
        if scene.loops:
            refuse_settings(scene.simulation, file, "[[loops]]", ("coordinates",))
        for k, joint in enumerate(scene.joints):
            _check_feed_forward(joint, f"{file}: joints[{k}]")
            for name, coordinate in joint.coordinates.items():
                _check_feed_forward(coordinate, f"{file}: joints[{k}].coordinates.{name}")
        for k, loop in enumerate(scene.loops):
            _check_feed_forward(loop, f"{file}: loops[{k}]")


def _check_sensors(scene: SceneRecord, file: str, tied: set[str]) -> None:
    points = [point.name for point in scene.points]
    moving = [name for joint in scene.joints for name in joint_coordinates(joint)]
    moving += [loop.name for loop in scene.loops if JOINT_TYPES[loop.type].one is not None]
    moving += [charge_name(joint.name) for joint in scene.joints if has_circuit(joint)]
    check_sensors(scene.sensors, file, {"point": points, "joint": moving}, {*points, *tied, "t", "energy"})


def _check_assembly(scene: SceneRecord, place: str) -> None:
    message = remedy = ""
    if not scene.loops:
        message, remedy = "there is no loop to close", "remove it, or add [[loops]]"
    elif scene.simulation.formulation == "nodal":
        message, remedy = "'nodal' assembles rigid links", "use formulation = 'erls' or 'ffr', or remove it"
    if message:
        raise bad(place, message, scene.initial.assemble, remedy)


_BORNE = {"point": ("force", "moment"), "link": ("force_per_length", "force_per_mass"), "mass": ("force_per_mass",)}


def _check_load(load: Load, scene: SceneRecord, place: str) -> None:
    if load.point and load.link:
        raise bad(place, "give one of 'point' and 'link'", load.point, "remove the other")
    choose(load.axes, AXES, f"{place}.axes", SceneError)
    if load.point:
        choose(load.point, [point.name for point in scene.points], f"{place}.point", SceneError)
    if load.link:
        choose(load.link, [link.name for link in scene.links], f"{place}.link", SceneError)
    where = "point" if load.point else "link" if load.link else "mass"
    given = [field for field in (*_BORNE["point"], *_BORNE["link"]) if any(getattr(load, field))]
    if not given:
        wanted = " or ".join(_BORNE[where])
        raise bad(place, "no force" if where != "point" else "neither a force nor a moment", None, f"give {wanted}")
    for field in given:
        if field not in _BORNE[where]:
            missing = "point" if field in _BORNE["point"] else "link"
            here = f"a {where} bears none" if where != "mass" else f"'{missing}' is missing"
            raise bad(f"{place}.{field}", here, getattr(load, field), f"name a {missing} for it, or remove it")
    if where != "point" and len(given) > 1:
        raise bad(f"{place}.{given[1]}", "one force for one load", getattr(load, given[1]), "make two loads of them")
    if load.follower and (load.axes != "world" or "force_per_mass" in given):
        field, message = ("axes", "a follower has the axes of its node")
        if "force_per_mass" in given:
            field, message = "follower", "mass turns with no node"
        raise bad(f"{place}.{field}", message, getattr(load, field), "remove 'axes' or 'follower'")


def _check_contact(contact: Contact, scene: SceneRecord, place: str) -> None:
    plane, points = contact.plane, {point.name: point for point in scene.points}
    choose(contact.point, list(points), f"{place}.point", SceneError)
    choose(plane.on, [WORLD, *(link.name for link in scene.links)], f"{place}.plane.on", SceneError)
    if not plane.point:
        return
    choose(plane.point, list(points), f"{place}.plane.point", SceneError)
    if points[plane.point].link != plane.on:
        message = f"this point is not on {plane.on!r}, which is to carry the plane"
        remedy = f"give on = {points[plane.point].link!r}, or another point"
        raise bad(f"{place}.plane.point", message, plane.point, remedy)


def _check_feed_forward(acting: Acting, place: str) -> None:
    if getattr(acting.drive, "feed_forward", False) is True:
        message = "the inverse dynamics of the tree does not know its loops and couplings"
        raise bad(f"{place}.drive.feed_forward", message, True, "set it to false or 'elastic'")


def _check_place(scene: SceneRecord, k: int, place: str) -> None:
    """Where a joint stands, and what it carries."""
    joint, links = scene.joints[k], [link.name for link in scene.links]
    if joint.carries:
        choose(joint.carries, links, f"{place}.carries", SceneError)
    if joint.on:
        choose(joint.on, [GROUND, *links], f"{place}.on", SceneError)
    carried = [other.carries or links[number] for number, other in enumerate(scene.joints)]
    if carried.count(carried[k]) > 1:
        message, remedy = "a link is carried by one joint; others close loops", "use [[loops]], or name another link"
        raise bad(f"{place}.carries", message, carried[k], remedy)
    if joint.on and joint.on != GROUND and joint.on not in carried[:k]:
        remedy = "list joints from the ground outward, so that the joint which carries that link comes first"
        raise bad(f"{place}.on", "stands on a link that no joint before it carries", joint.on, remedy)
    if joint.at and (joint.on == GROUND or (k == 0 and not joint.on)):
        raise bad(f"{place}.at", "the ground has no interfaces", joint.at, "remove it, and give the place by 'branch'")
    bearing = joint.on or (carried[k - 1] if k else GROUND)
    before = [other.on or (carried[j - 1] if j else GROUND) for j, other in enumerate(scene.joints[:k])]
    if bearing != GROUND and bearing in before and joint.branch is None:
        remedy = "give the pose at which its Denavit-Hartenberg row starts, in the mesh frame of that link"
        raise bad(f"{place}.branch", "missing, since another joint stands on the same link", bearing, remedy)


def _check_coordinates(joint: Joint, place: str) -> None:
    """What acts in a joint stands at its coordinate, or at each of its coordinates."""
    plain = type(joint)(name=joint.name, dh=joint.dh)
    check_joint_fields(joint, joint.type, place)
    known = [freedom.name for freedom in JOINT_TYPES[joint.type].freedoms or () if freedom.name]
    for name in joint.coordinates:
        if not known:
            message = f"a {joint.type} joint has no coordinates with names"
            raise bad(f"{place}.coordinates", message, name, "remove it")
        choose(name, known, f"{place}.coordinates", SceneError)
        _check_component(joint, name, f"{place}.coordinates.{name}")
    if JOINT_TYPES[joint.type].one is not None:
        return
    if has_circuit(joint):
        message = f"a {joint.type} joint has no single coordinate that a motor could turn"
        raise bad(f"{place}.motor", message, joint.type, "put joints of one coordinate each in its place")
    remedy = f"put it into coordinates.{known[0]}" if known else "remove it"
    for field in (*_ACTING, "initial"):
        given = getattr(joint, field, None)
        if field == "motor" and joint.motor.rotor_inertia == 0.0:
            continue  # its mass is that of the link below
        if given != getattr(plain, field, None):
            message = f"a {joint.type} joint has no single coordinate that this could act along"
            raise bad(f"{place}.{field}", message, joint.type, remedy)


def _check_component(joint: Joint, name: str, place: str) -> None:
    """Nothing acts along a component of a rotation vector, which is the turn about no axis."""
    if not any(freedom.name == name and freedom.vector for freedom in JOINT_TYPES[joint.type].freedoms or ()):
        return
    for field in (*_ACTING[2:], "motor"):
        if getattr(joint.coordinates[name], field) != getattr(Coordinate(), field):
            message = "nothing acts along a component of a rotation vector, which turns about no axis of its own"
            raise bad(f"{place}.{field}", message, name, "use joints of one turn each, or take it out")


def _check_event(event: Event, scene: SceneRecord, place: str) -> None:
    if bool(event.joint) == bool(event.point):
        raise bad(place, "give exactly one of 'joint' and 'point'", event.name, "name what the event watches")
    freedoms = {name: freedom for joint in scene.joints for name, freedom in joint_coordinates(joint).items()}
    if event.joint:
        choose(event.joint, freedoms, f"{place}.joint", SceneError)
    else:
        choose(event.point, [point.name for point in scene.points], f"{place}.point", SceneError)
    choose(event.coordinate, OF_JOINTS if event.joint else OF_POINTS, f"{place}.coordinate", SceneError)
    choose(event.direction, DIRECTIONS, f"{place}.direction", SceneError)
    if (event.value is None) == (event.value_deg is None):
        raise bad(place, "give exactly one of 'value' and 'value_deg'", event.name, "say what is crossed")
    if event.value_deg is not None and not (event.joint and freedoms[event.joint].turns):
        raise bad(f"{place}.value_deg", "only revolute joints have degrees", event.value_deg, "use value, in metres")


def _check_link(link: Link, place: str) -> None:
    if link.reduction and not link.model:
        message = "'reduction' changes how a model is reduced, and this link names none"
        raise bad(f"{place}.reduction", message, None, "remove it, or give 'model'")
    if link.changes and not link.model:
        message = "'changes' replace values of a description, and this link names none"
        raise bad(f"{place}.changes", message, None, "remove it, or give 'model'")
    if "reduction" in link.changes:
        message = "how a model is reduced is said by 'reduction'"
        raise bad(f"{place}.changes.reduction", message, None, f"give it as links.{link.name}.reduction")
    if bool(link.model) + bool(link.modal_file) + (link.rigid is not None) != 1:
        message = "give exactly one of 'model', 'modal_file' and 'rigid'"
        raise bad(place, message, link.name, "a link has one source")
    choose(link.mesh_pose.frame, FRAMES, f"{place}.mesh_pose.frame", SceneError)
    not_negative(f"{place}.elastic_modes", link.elastic_modes or 0, "a mode count cannot be negative")
    if link.damping is not None:
        check_damping(link.damping, f"{place}.damping", SceneError)
    if link.temperature_change is not None:
        check_temperature(link.temperature_change, f"{place}.temperature_change", SceneError)
    if link.rigid is None:
        return
    for name in ("elastic_modes", "damping", "temperature_change"):
        if getattr(link, name):
            raise bad(f"{place}.{name}", "a rigid link does not deform", link.name, f"remove {name!r}")
    not_negative(f"{place}.rigid.mass", link.rigid.mass, "a mass cannot be negative")
    if not link.rigid.points:
        remedy = "give the inboard one at least, points = { root = [0, 0, 0] }"
        raise bad(f"{place}.rigid.points", "a rigid link needs named points", None, remedy)
    check_names((f"{place}.rigid.points", name) for name in link.rigid.points)


def _check_substructures(link: Link, formulation: str, place: str) -> None:
    if link.substructures < 1:
        raise bad(place, "a link has at least one piece", link.substructures, "give 1 or more")
    if link.substructures == 1:
        return
    if not link.model:
        message = "only a link made of beams can be split, from its description"
        raise bad(place, message, link.substructures, "give 'model' with a table [frame], or remove the field")
    if formulation == "erls" and link.flexible:
        message = (
            "ERLS counts all displacements from its rigid links, to first order, so that pieces would change nothing"
        )
        remedy = "use formulation = 'ffr', where the frames of the pieces turn with the deformation"
        raise bad(place, message, link.substructures, remedy)


def _check_bandwidth(scene: SceneRecord, place: str) -> None:
    s = scene.simulation
    for found, what in (
        (bool(scene.loops), "loops"),
        (bool(scene.bushings), "bushings"),
        (bool(scene.couplings), "couplings"),
        (circuits(scene), "circuits of motors"),
        (any(link.substructures > 1 and link.flexible for link in scene.links), "substructures"),
        (s.formulation == "nodal", "formulation = 'nodal'"),
        (s.coordinates == "absolute", "coordinates = 'absolute'"),
        (bool(scene.contacts), "contacts"),
    ):
        if found:
            message = f"static correction of modes above a bandwidth does not go with {what}"
            remedy = "remove the bandwidth, so that all modes are integrated"
            raise bad(place, message, s.bandwidth, remedy)


def _check_compound(scene: SceneRecord, place: str) -> None:
    """What joints of several coordinates do not go with."""
    s = scene.simulation
    compound = next((joint for joint in scene.joints if len(joint_coordinates(joint)) > 1), None)
    screw = next((joint for joint in scene.joints if joint.type == "screw"), None)
    vector = next((j for j in scene.joints if any(f.vector for f in joint_coordinates(j).values())), None)
    for field, joint, found, remedy in (
        ("gauge", vector, s.gauge == "minimum-norm", "use gauge = 'joint-angle'"),
        ("gauge", screw, s.gauge == "minimum-norm", "use gauge = 'joint-angle'"),
        ("coordinates", compound, s.coordinates == "absolute", "use coordinates = 'independent'"),
        ("bandwidth", vector, s.bandwidth is not None, "remove the bandwidth, so that all modes are integrated"),
    ):
        if joint is not None and found:
            message = f"does not go with the {joint.type} joint {joint.name!r}"
            raise bad(f"{place}.{field}", message, getattr(s, field), remedy)


def _check_loop(loop: Loop, scene: SceneRecord, place: str) -> None:
    links = [link.name for link in scene.links]
    choose(loop.type, HOLDING_TYPES, f"{place}.type", SceneError)
    check_ends(loop, links, place, "a loop closes between")
    check_joint_fields(loop, loop.type, place)
    kind = JOINT_TYPES[loop.type]
    if loop.axis is None and kind.slides:
        raise bad(f"{place}.axis", f"a {loop.type} joint needs its axis", None, "give its direction in the world")
    if loop.axis is not None and not kind.axes:
        raise bad(f"{place}.axis", f"a {loop.type} joint has no axis", loop.axis, "remove it")
    if (loop.second_axis is not None) != (kind.axes == 2):
        message = "its second axis" if kind.axes == 2 else "no second axis"
        remedy = "give its direction in the world" if kind.axes == 2 else "remove it"
        raise bad(f"{place}.second_axis", f"a {loop.type} joint has {message}", loop.second_axis, remedy)
    if kind.axes == 2 and loop.axis is None:
        raise bad(f"{place}.axis", f"a {loop.type} joint needs both axes", None, "give its direction in the world")
    directed(f"{place}.axis", loop.axis)
    directed(f"{place}.second_axis", loop.second_axis)
    if kind.one is None:
        plain = type(loop)(name=loop.name, link=loop.link, node=loop.node)
        driven = kind.driven is not None and isinstance(loop.drive, MotionDrive)  # and only that
        for field in _ACTING[3 * driven :]:
            if getattr(loop, field) != getattr(plain, field):
                message = f"a {loop.type} joint has no single coordinate that this could act along"
                raise bad(f"{place}.{field}", message, loop.type, f"remove it, or use one of {', '.join(SINGLE_TYPES)}")
