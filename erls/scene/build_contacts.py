"""Contacts of a scene, and stops of its joints, as those of a mechanism."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.contacts import ContactLaw, PointContact, Stops
from erls.mechanism.place import Place
from erls.scene.build_friction import build_friction
from erls.scene.chain import Scene
from erls.scene.contacts import WORLD, AgainstPlane, Plane, PlaneOfBody
from erls.scene.contacts import Stops as StopsRecord

if TYPE_CHECKING:  # reading a scene checks its joints, and needs no models of links
    from erls.mechanism.chain import Point
    from erls.mechanism.links import Link
    from fe_import.model import IntArray


def contact_law(record: AgainstPlane | StopsRecord, place: Place) -> ContactLaw:
    """The law of a contact or of stops.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    exponent = place.number("exponent", record.exponent)
    if not 1.0 <= exponent <= 5.0:
        raise place.error("exponent", "outside of 1 to 5", exponent, remedy="give 1.5 after Hertz, or 1")
    restitution = place.number("restitution", record.restitution)
    if not 0.0 <= restitution <= 1.0:
        raise place.error("restitution", "outside of 0 to 1", restitution, remedy="give a number from 0 to 1")
    stiffness = place.positive("stiffness", record.stiffness)
    return ContactLaw(stiffness, exponent, restitution, place.positive("transition_rate", record.transition_rate))


def build_stops(record: StopsRecord, place: Place) -> Stops:
    """Stops of a joint.

    Raises
    ------
    SceneError
        BAD_FIELD: no stop, one beyond the other, faulty numbers.
    """
    ends = {}
    for name, none in (("lower", -math.inf), ("upper", math.inf)):
        plain, degrees = getattr(record, name), getattr(record, f"{name}_deg")
        ends[name] = none if plain is None and degrees is None else place.quantity(name, plain, degrees)
    if math.isinf(ends["lower"]) and math.isinf(ends["upper"]):
        raise place.error("lower", "neither a lower nor an upper stop", remedy="give one, or remove 'stops'")
    if not ends["lower"] < ends["upper"]:
        raise place.error("upper", "not above the lower stop", ends["upper"], remedy="exchange them")
    return Stops(ends["lower"], ends["upper"], contact_law(record, place))


def build_contacts(
    scene: Scene, links: Sequence[Link], points: Sequence[Point], numbers: IntArray
) -> list[PointContact]:
    """Points against planes.

    Parameters
    ----------
    scene : Scene
    links : sequence of Link
        Those of the scene.
    points : sequence of Point
        Those of the scene, on its links.
    numbers : (n,) int array
        Of these links in the mechanism.

    Raises
    ------
    SceneError
        BAD_FIELD: faulty numbers, a normal without length, a plane on the node that it meets, or on one that does not
        turn.
    """
    known = {point.name: point for point in points}
    result = []
    for k, record in enumerate(scene.record.contacts):
        place = Place(scene.folder, f"{scene.path}: contacts[{k}]")
        within, plane, point = place.at("plane"), record.plane, known[record.point]
        position, normal = plane_of(plane, within)
        base = None
        if plane.on != WORLD:
            at = [link.name for link in links].index(plane.on)
            node = known[plane.point].node if plane.point else links[at].inboard.node
            model = links[at].model
            if node not in model.rotation_nodes:
                raise SceneError(
                    Cause.BAD_FIELD,
                    "this node has no rotation, so it cannot carry a plane",
                    where=within.field("point"),
                    value=plane.point,
                    remedy="name a point on an interface, or none for the inboard one",
                )
            if (at, node) == (point.link, point.node):
                field = "point" if plane.point else "on"
                raise within.error(
                    field, "the point is where its plane is fixed", getattr(plane, field), remedy="name another point"
                )
            base, position = (int(numbers[at]), node), position - model.nodes[node]
        given = replace(against_plane(record, place), link=int(numbers[point.link]), node=point.node, base=base)
        result.append(replace(given, position=position, normal=normal))
    return result


def plane_of(plane: Plane | PlaneOfBody, place: Place) -> tuple[Array, Array]:
    """(3,) a point of a plane and its unit normal.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    position, normal = (np.array([place.number(n, x) for x in getattr(plane, n)]) for n in ("position", "normal"))
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise place.error("normal", "without a direction", list(plane.normal), remedy="give one that is not zero")
    return position, normal / length


def against_plane(record: AgainstPlane, place: Place) -> PointContact:
    """Law and friction of a contact, whose sides are not said yet.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    none = np.zeros(3)
    rubs: dict[str, float] = {}
    if record.friction:
        found = build_friction(record.friction, place.at("friction"), "coefficient", "static_coefficient")
        rubs = {"friction": found.sliding, "friction_rate": found.rate, "static_friction": found.static}
    return PointContact(
        name=record.name,
        link=-1,
        node=-1,
        base=None,
        position=none,
        normal=none,
        law=contact_law(record, place),
        **rubs,
    )
