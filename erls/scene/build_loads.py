"""Loads of a scene as those of a mechanism."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.errors import Cause, SceneError
from erls.mechanism.chain import Point
from erls.mechanism.links import Link
from erls.mechanism.loads import PointLoad
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
        BAD_FIELD: a profile, or a node that does not turn under a moment or as the node of a follower.
    """
    known = {point.name: point for point in points}
    found = []
    for k, load in enumerate(scene.record.loads):
        place = Place(scene.folder, f"{scene.path}: loads[{k}]")
        found.append(_load(load, known[load.point], links[known[load.point].link], numbers, place))
    return found


def _load(load: Load, point: Point, link: Link, numbers: IntArray, place: Place) -> PointLoad:
    number = int(numbers[point.link])
    if (load.follower or any(load.moment)) and point.node not in link.model.rotation_nodes:
        field, what = ("follower", "turn a load") if load.follower else ("moment", "take a moment")
        raise SceneError(
            Cause.BAD_FIELD,
            f"this node has no rotation, so it cannot {what}",
            where=place.field(field),
            value=load.point,
            remedy="put the load on an interface, or give a force in axes of the world or of the link",
        )
    axes = None
    if load.follower or load.axes == "link":
        axes = number, point.node if load.follower else link.inboard.node
    factor = build_profiles(load.factor, place, "factor") if load.factor else None
    return PointLoad(number, point.node, np.array([*load.force, *load.moment]), axes, factor)
