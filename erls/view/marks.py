"""What acts on a chain and what watches it, for pictures: loads as arrows, and where sensors sit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.formulation import State
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import link_mass_properties
from erls.mechanism.loads import CENTRE, PointLoad
from erls.mechanism.sensors.base import Node
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun
from erls.view.shapes import Arrow

LONGEST = 0.25
"""Arrow of the largest load of a run, of the size of the largest link."""

_LOOKS = 201  # along a run, for that load
_SHORTEST = 0.02  # of it, of what is drawn
_ASKEW = 1e-3  # cosine of the angle to the link from which on an arrow would lie within it


@dataclass(frozen=True)
class Acting:
    """Loads of a mechanism at one time.

    Attributes
    ----------
    load : PointLoad
    force, moment : (3,) arrays
        World axes, as parts of the largest of the run.
    """

    load: PointLoad
    force: Array
    moment: Array


def loads_of(run: ChainRun, times: Sequence[float] | Array) -> list[list[Acting]]:
    """Loads at each time."""
    loads = run.formulation.mechanism.loads
    if not loads:
        return [[] for _ in times]
    whole, now = _wrenches(run, run.spread(_LOOKS)), _wrenches(run, np.asarray(times, dtype=float))
    largest = np.linalg.norm(whole.reshape(*whole.shape[:2], 2, 3), axis=3).max(axis=(0, 1), initial=0.0)
    shares = now / np.repeat(np.where(largest > 0, largest, 1.0), 3)
    return [[Acting(load, *np.split(own, 2)) for load, own in zip(loads, at, strict=True)] for at in shares]


def _wrenches(run: ChainRun, times: Array) -> Array:
    """(k, loads, 6) forces [N] and moments [N m], world axes."""
    mechanism = run.formulation.mechanism
    found, seen = np.empty((len(times), len(mechanism.loads), 6)), run.instants(times)
    for k, load in enumerate(mechanism.loads):
        given = np.array([load.at(t) for t in times.tolist()])
        if load.node == CENTRE:
            given = given * link_mass_properties(mechanism.links[load.link]).mass
        if load.axes is not None:
            turn = seen.node(Node(*load.axes)).turn
            given = np.einsum("kij,kcj->kci", turn, given.reshape(-1, 2, 3)).reshape(-1, 6)
        found[:, k] = given
    return found


def arrows(mechanism: Mechanism, state: State, acting: Sequence[Acting], magnification: float) -> list[Arrow]:
    """Those of loads worth an arrow, lengths in metres: from where they act or to there, so that they lie outside of
    their link.
    """
    length = LONGEST * max(link.size for link in mechanism.links)
    found = []
    for one in acting:
        place, middle = _place(mechanism, state, one.load, magnification), _centre(mechanism, state, one.load.link)
        for part, turns in ((one.force, False), (one.moment, True)):
            if np.linalg.norm(part) > _SHORTEST:
                inward = part @ (place - middle) < -_ASKEW * np.linalg.norm(part) * np.linalg.norm(place - middle)
                found.append(Arrow(place - inward * length * part, length * part, turns))
    return found


def _place(mechanism: Mechanism, state: State, load: PointLoad, magnification: float) -> Array:
    """(3,) node that a load acts on, or centre of mass of its link."""
    if load.node == CENTRE:
        return _centre(mechanism, state, load.link)
    return np.asarray(node_positions(mechanism, state, load.link, [load.node], magnification)[0])


def _centre(mechanism: Mechanism, state: State, link: int) -> Array:
    """(3,) centre of mass of an undeformed link."""
    frame, centre = state.poses[link], link_mass_properties(mechanism.links[link]).centre_of_mass
    return np.asarray(frame[:3, :3] @ centre + frame[:3, 3])


def sensor_places(run: ChainRun) -> dict[str, Node | str]:
    """Of each sensor by its name: the node it sits on, or its joint; without those of links."""
    points = {point.name: Node(point.link, point.node) for point in run.formulation.mechanism.points}
    found: dict[str, Node | str] = {}
    for sensor in run.scene.record.sensors:
        point, joint = getattr(sensor, "point", None), getattr(sensor, "joint", None)
        if point in points:
            found[sensor.name] = points[point]
        elif joint is not None:
            found[sensor.name] = joint
    return found

