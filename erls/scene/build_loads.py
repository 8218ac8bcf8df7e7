"""Loads of a scene as those of a mechanism.

A force per length acts on the nodes of the beams by the consistent loads of a cubic element: half of it, and ± ℓ²/12 of
its moment, at each end, which bend elements of uniform section as the force itself does (J. Przemieniecki, Theory of
Matrix Structural Analysis, 1968, sec. 7).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Point
from erls.mechanism.links import Link
from erls.mechanism.loads import CENTRE, PointLoad
from erls.mechanism.place import Place
from erls.mechanism.profiles import build_loads as build_profiles
from erls.scene.chain import Load, Scene
from fe_import.model import IntArray


def build_loads(scene: Scene, links: Sequence[Link], points: Sequence[Point], numbers: IntArray) -> list[PointLoad]:
    """Forces and moments on nodes.

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
        BAD_FIELD: a profile, a node that does not turn under a moment or as the node of a follower, a force per length
        on a link that is not made of beams.
    """
    known = {point.name: point for point in points}
    found: list[PointLoad] = []
    for k, load in enumerate(scene.record.loads):
        place = Place(scene.folder, f"{scene.path}: loads[{k}]")
        factor = build_profiles(load.factor, place, "factor") if load.factor else None
        for at, link in enumerate(links):
            if at != known[load.point].link if load.point else load.link not in ("", link.name):
                continue
            number = int(numbers[at])
            for node, wrench in _wrenches(load, known, link, place):
                turner = node if load.follower else link.inboard.node if load.axes == "link" else None
                axes = None if turner is None else (number, turner)
                found.append(PointLoad(number, node, wrench, axes, factor, k))
    return found


def _wrenches(
    load: Load, points: Mapping[str, Point], link: Link, place: Place
) -> Iterable[tuple[int, Array]]:
    """Nodes of a link and what a load does to each, (6,)."""
    if load.point:
        node = points[load.point].node
        _check_turning(load, node, link, place)
        return [(node, np.array([*load.force, *load.moment]))]
    if any(load.force_per_mass):
        return [(CENTRE, np.array([*load.force_per_mass, 0.0, 0.0, 0.0]))]
    return _along(np.array(load.force_per_length), link, place)


def _check_turning(load: Load, node: int, link: Link, place: Place) -> None:
    """A node turns where a load needs it to."""
    if (load.follower or any(load.moment)) and node not in link.model.rotation_nodes:
        field, what = ("follower", "turn a load") if load.follower else ("moment", "take a moment")
        raise SceneError(
            Cause.BAD_FIELD,
            f"this node has no rotation, so it cannot {what}",
            where=place.field(field),
            value=load.point,
            remedy="put the load on an interface, or give a force in axes of the world or of the link",
        )


def _along(force: Array, link: Link, place: Place) -> Iterator[tuple[int, Array]]:
    """Nodes of a link made of beams, and the wrench (6,) that a force per length leaves on each."""
    if link.description is None:
        raise SceneError(
            Cause.BAD_FIELD,
            "a force per length needs a link made of beams",
            where=place.field("link"),
            value=link.name,
            remedy="give 'model' with a table [frame], or forces on points",
        )
    model = link.model
    wrenches = np.zeros((len(model.nodes), 6))
    for first, second in model.lines.tolist():
        along = model.nodes[second] - model.nodes[first]
        length = float(np.linalg.norm(along))
        ends = np.concatenate([force * length / 2, length / 12 * cross(along, force)])
        wrenches[first] += ends
        wrenches[second] += ends * [1, 1, 1, -1, -1, -1]
    for node in np.flatnonzero(wrenches.any(axis=1)).tolist():
        yield node, wrenches[node]
