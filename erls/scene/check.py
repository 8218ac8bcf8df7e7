"""The conditions on a scene that the types of its records cannot state, checked before any link is reduced."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import msgspec

from erls.errors import Cause, SceneError
from erls.mechanism.dh import CONVENTIONS
from erls.mechanism.effects import named_effects
from erls.mechanism.joints import JOINT_TYPES
from erls.mechanism.loops import LOOP_TYPES
from erls.mechanism.place import LARGEST, LATEST
from erls.scene.integrators import FIXED_STEP, INTEGRATORS
from fe_import.description.check import check_damping
from fe_import.files.toml import choose

if TYPE_CHECKING:
    from erls.scene.chain import Event, Link, Loop, SceneRecord, Simulation

DIRECTIONS = ("any", "rising", "falling")  # of events
OF_JOINTS, OF_POINTS = ("angle", "rate"), ("x", "y", "z")
GAUGES = ("joint-angle", "minimum-norm")
BODY_FRAMES = ("tangent", "mean-axis")
COORDINATES = ("independent", "absolute")
FRAMES = ("dh", "joint")
DEFORMATIONS = ("zero", "static")
_ACTING = ("coordinate", "coordinate_deg", "drive", "stiffness", "damping", "friction", "motor")  # on one coordinate
MOST_STEPS = 100_000_000  # fill any memory; more are a slip
SMALLEST_RTOL = 3e-14  # rounding
SHORTEST = 1e-9  # s, a thousand times what separates two breakpoints


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
    for path, value in every_number(msgspec.to_builtins(scene)):
        if not abs(value) <= LARGEST:
            remedy = f"give a number between {-LARGEST:g} and {LARGEST:g}"
            raise _bad(f"{file}: {path}", "not a finite number of plausible size", value, remedy)
    _check_simulation(scene.simulation, f"{file}: simulation")
    choose(scene.initial.deformation, DEFORMATIONS, f"{file}: initial.deformation", SceneError)
    if not scene.name.isprintable():
        raise _bad(f"{file}: name", "a name is one line of printable characters", scene.name, "rename it")
    if not scene.joints:
        raise _bad(f"{file}: joints", "a scene needs at least one joint", None, "add [[joints]]")
    if len(scene.joints) != len(scene.links):
        counts = f"{len(scene.links)} links, {len(scene.joints)} joints"
        message = "joint k carries link k, so there must be as many links as joints"
        raise _bad(f"{file}: links", message, counts, "add or remove one")
    for kind in ("joints", "links", "points", "loops", "events"):
        named = [(f"{file}: {kind}[{k}].name", item.name) for k, item in enumerate(getattr(scene, kind))]
        check_names(named)
    for k, joint in enumerate(scene.joints):
        choose(joint.type, JOINT_TYPES, f"{file}: joints[{k}].type", SceneError)
        choose(joint.dh.convention, CONVENTIONS, f"{file}: joints[{k}].dh.convention", SceneError)
    for k, link in enumerate(scene.links):
        _check_link(link, f"{file}: links[{k}]")
        _check_substructures(link, scene.simulation.formulation, f"{file}: links[{k}].substructures")
    for k, point in enumerate(scene.points):
        choose(point.link, [link.name for link in scene.links], f"{file}: points[{k}].link", SceneError)
        if bool(point.node) == (point.position is not None):
            remedy = "name a node of the link, or give a position in its mesh frame"
            raise _bad(f"{file}: points[{k}]", "give exactly one of 'node' and 'position'", point.name, remedy)
    for k, payload in enumerate(scene.payloads):
        choose(payload.point, [p.name for p in scene.points], f"{file}: payloads[{k}].point", SceneError)
    for k, loop in enumerate(scene.loops):
        _check_loop(loop, scene, f"{file}: loops[{k}]")
    for k, event in enumerate(scene.events):
        _check_event(event, scene, f"{file}: events[{k}]")
    if scene.simulation.bandwidth is not None:
        _check_bandwidth(scene, f"{file}: simulation.bandwidth")
    if scene.loops:
        if scene.simulation.coordinates != "independent":
            message, right = "loops tie independent coordinates", "remove it, or the loops"
            raise _bad(f"{file}: simulation.coordinates", message, scene.simulation.coordinates, right)
        for kind in ("joints", "loops"):
            for k, item in enumerate(getattr(scene, kind)):
                if getattr(item.drive, "feed_forward", False):
                    message = "the inverse dynamics of the chain does not know its loops"
                    raise _bad(f"{file}: {kind}[{k}].drive.feed_forward", message, True, "set it to false")


def _check_event(event: Event, scene: SceneRecord, place: str) -> None:
    if bool(event.joint) == bool(event.point):
        raise _bad(place, "give exactly one of 'joint' and 'point'", event.name, "name what the event watches")
    if event.joint:
        choose(event.joint, [joint.name for joint in scene.joints], f"{place}.joint", SceneError)
    else:
        choose(event.point, [point.name for point in scene.points], f"{place}.point", SceneError)
    choose(event.coordinate, OF_JOINTS if event.joint else OF_POINTS, f"{place}.coordinate", SceneError)
    choose(event.direction, DIRECTIONS, f"{place}.direction", SceneError)
    if (event.value is None) == (event.value_deg is None):
        raise _bad(place, "give exactly one of 'value' and 'value_deg'", event.name, "say what is crossed")
    turns = any(joint.name == event.joint and joint.type == "revolute" for joint in scene.joints)
    if event.value_deg is not None and not turns:
        raise _bad(f"{place}.value_deg", "only revolute joints have degrees", event.value_deg, "use value, in metres")


def every_number(value: Any, path: str = "") -> Iterable[tuple[str, float]]:
    """All numbers of nested tables and lists with their places."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from every_number(item, f"{path}.{key}" if path else key)
    elif isinstance(value, (list, tuple)):
        for k, item in enumerate(value):
            yield from every_number(item, f"{path}[{k}]")
    elif isinstance(value, (int, float)):
        yield path, value


def _check_simulation(s: Simulation, place: str) -> None:
    choose(s.integrator, INTEGRATORS, f"{place}.integrator", SceneError)
    choose(s.gauge, GAUGES, f"{place}.gauge", SceneError)
    choose(s.body_frame, BODY_FRAMES, f"{place}.body_frame", SceneError)
    choose(s.coordinates, COORDINATES, f"{place}.coordinates", SceneError)
    if s.coordinates == "absolute":
        for name, value, right in (("formulation", s.formulation, "ffr"), ("integrator", s.integrator, FIXED_STEP)):
            if value != right:
                message = "absolute coordinates do not go with this"
                raise _bad(f"{place}.{name}", message, value, f"use {right}, or coordinates = 'independent'")
    if s.formulation == "nodal" and s.integrator not in (FIXED_STEP, "auto"):
        message = "nodal frames need an integrator for constraints"
        raise _bad(f"{place}.integrator", message, s.integrator, f"use {FIXED_STEP}, or auto")
    if s.elements_per_member is not None and s.elements_per_member < 1:
        message = "a member needs at least one element"
        raise _bad(f"{place}.elements_per_member", message, s.elements_per_member, "give 1 or more")
    tolerances = "atol", "tolerance", "effects_tolerance", "effects_effort_tolerance"
    for name in ("duration", "step", "output_step", "bandwidth", *tolerances):
        value = getattr(s, name)
        if value is not None and not value > 0:
            raise _bad(f"{place}.{name}", f"{name} must be positive", value, "give a number above 0")
    if s.duration < SHORTEST:
        raise _bad(f"{place}.duration", "shorter than any run", s.duration, f"give at least {SHORTEST:g} s")
    if s.duration > LATEST:
        raise _bad(f"{place}.duration", "longer than any run", s.duration, f"give at most {LATEST:g} s")
    if s.duration / MOST_STEPS > (s.step or 1e-3):
        name = "duration" if s.step is None else "step"
        remedy = f"a run has at most {MOST_STEPS:.0e} steps: shorten it, or give a larger step"
        raise _bad(f"{place}.{name}", "too many steps", getattr(s, name), remedy)
    if not SMALLEST_RTOL <= s.rtol < 1:
        remedy = f"give {SMALLEST_RTOL:g} (rounding) to 1"
        raise _bad(f"{place}.rtol", "not a relative tolerance", s.rtol, remedy)
    named_effects(s.effects, f"{place}.effects")
    if not 0 <= s.spectral_radius <= 1:
        raise _bad(f"{place}.spectral_radius", "out of range", s.spectral_radius, "give 0 to 1")


def check_names(places: Iterable[tuple[str, str]]) -> None:
    """Names, each behind its place, differ and can stand in tables and, as keys, in files."""
    seen: set[str] = set()
    for place, name in places:
        if not name or name == "." or "/" in name or not name.isprintable():
            message = "a name is one line of printable characters without '/'"
            raise _bad(place, message, name, "rename it")
        if name in seen:
            raise _bad(place, "names must differ", name, "rename one")
        seen.add(name)


def _check_link(link: Link, place: str) -> None:
    if link.reduction and not link.model:
        message = "'reduction' changes how a model is reduced, and this link names none"
        raise _bad(f"{place}.reduction", message, None, "remove it, or give 'model'")
    if bool(link.model) + bool(link.modal_file) + (link.rigid is not None) != 1:
        message = "give exactly one of 'model', 'modal_file' and 'rigid'"
        raise _bad(place, message, link.name, "a link has one source")
    choose(link.mesh_pose.frame, FRAMES, f"{place}.mesh_pose.frame", SceneError)
    if link.elastic_modes is not None and link.elastic_modes < 0:
        message = "a mode count cannot be negative"
        raise _bad(f"{place}.elastic_modes", message, link.elastic_modes, "give 0 or more")
    if link.damping is not None:
        check_damping(link.damping, f"{place}.damping", SceneError)
    if link.rigid is None:
        return
    for name in ("elastic_modes", "damping"):
        if getattr(link, name):
            raise _bad(f"{place}.{name}", "a rigid link does not vibrate", link.name, f"remove {name!r}")
    if link.rigid.mass < 0:
        raise _bad(f"{place}.rigid.mass", "a mass cannot be negative", link.rigid.mass, "give 0 or more")
    if not link.rigid.points:
        remedy = "give the inboard one at least, points = { root = [0, 0, 0] }"
        raise _bad(f"{place}.rigid.points", "a rigid link needs named points", None, remedy)
    check_names((f"{place}.rigid.points", name) for name in link.rigid.points)


def _check_substructures(link: Link, formulation: str, place: str) -> None:
    if link.substructures < 1:
        raise _bad(place, "a link has at least one piece", link.substructures, "give 1 or more")
    if link.substructures == 1:
        return
    if not link.model:
        message = "only a link made of beams can be split, from its description"
        raise _bad(place, message, link.substructures, "give 'model' with a table [frame], or remove the field")
    if formulation == "erls" and link.flexible:
        message = (
            "ERLS counts all displacements from its rigid links, to first order, so that pieces would change nothing"
        )
        remedy = "use formulation = 'ffr', where the frames of the pieces turn with the deformation"
        raise _bad(place, message, link.substructures, remedy)


def _check_bandwidth(scene: SceneRecord, place: str) -> None:
    s = scene.simulation
    for found, what in (
        (bool(scene.loops), "loops"),
        (any(link.substructures > 1 and link.flexible for link in scene.links), "substructures"),
        (s.formulation == "nodal", "formulation = 'nodal'"),
        (s.coordinates == "absolute", "coordinates = 'absolute'"),
    ):
        if found:
            message = f"static correction of modes above a bandwidth does not go with {what}"
            remedy = "remove the bandwidth, so that all modes are integrated"
            raise _bad(place, message, s.bandwidth, remedy)


def _check_loop(loop: Loop, scene: SceneRecord, place: str) -> None:
    links = [link.name for link in scene.links]
    choose(loop.type, LOOP_TYPES, f"{place}.type", SceneError)
    choose(loop.link, links, f"{place}.link", SceneError)
    if loop.to_link:
        choose(loop.to_link, links, f"{place}.to_link", SceneError)
    if loop.to_link == loop.link:
        message = "a loop closes between two links, or a link and the ground"
        raise _bad(f"{place}.to_link", message, loop.to_link, "name another link, or leave it out for the ground")
    if bool(loop.to_link) != bool(loop.to_node):
        remedy = "give both 'to_link' and 'to_node', or neither for the ground"
        raise _bad(f"{place}.to_node", "a link and a node belong together", loop.to_node, remedy)
    if loop.to_link and loop.position is not None:
        message = "between two links the nodes say where the joint is"
        raise _bad(f"{place}.position", message, loop.position, "remove it")
    kind = LOOP_TYPES[loop.type]
    if loop.axis is None and kind.slides:
        raise _bad(f"{place}.axis", f"a {loop.type} joint needs its axis", None, "give its direction in the world")
    if loop.axis is not None and not kind.has_axis:
        raise _bad(f"{place}.axis", f"a {loop.type} joint has no axis", loop.axis, "remove it")
    if loop.axis is not None and not any(loop.axis):
        raise _bad(f"{place}.axis", "an axis needs a direction", loop.axis, "give three numbers, not all zero")
    if loop.type not in JOINT_TYPES:
        plain = type(loop)(name=loop.name, link=loop.link, node=loop.node)
        for field in _ACTING:
            if getattr(loop, field) != getattr(plain, field):
                message = f"a {loop.type} joint has no single coordinate that this could act along"
                raise _bad(f"{place}.{field}", message, loop.type, "remove it, or use " + " or ".join(JOINT_TYPES))


def _bad(where: str, message: str, value: Any, remedy: str) -> SceneError:
    return SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)
