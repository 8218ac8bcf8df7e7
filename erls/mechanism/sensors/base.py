"""Sensors of a scene file, and what they ask of whatever moves.

Rules for a new kind of sensor:

1. One file here with one record, whose ``bind`` checks its numbers and says what is read; one line in
   `erls.mechanism.sensors.registry`, one row in the table of ``tests/erls/test_sensors.py``.
2. A reading depends on time, coordinates, rates and accelerations alone, never on a run: a sensor reads `Seen`, which
   finds what it is asked for, once for all sensors, and nothing else. So runs, steppers and linearizations read alike.
3. ``bind`` names point, link or joint to a `Finder`, which refuses what is not there by file, field, value and remedy,
   before anything moves.
4. Readings are (k, c) arrays over k times and the c components in ``columns``, each with its unit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import msgspec
import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.place import Place
from fe_import.model import IntArray

AXES = ("node", "link", "world")
SIDES = ("load", "motor")


class Node(NamedTuple):
    """A node of a link, by their numbers; of bodies and beams, where there are no links, ``link`` is -1."""

    link: int
    node: int


class NodeMotion(NamedTuple):
    """Motion of a node at k times, in the world.

    Attributes
    ----------
    place, velocity, acceleration : (k, 3) arrays
        [m], [m/s], [m/s²]
    turn : (k, 3, 3) array
        Its axes: as built those of the mesh.
    spin, spin_rate : (k, 3) arrays
        Angular velocity [rad/s] and acceleration [rad/s²].
    """

    place: Array
    velocity: Array
    acceleration: Array
    turn: Array
    spin: Array
    spin_rate: Array


class Moved(NamedTuple):
    """A joint, or a closing one behind them, by its number; what its motor turns by per turn of the joint, and the
    inertia of its rotor as the joint feels it [kg m² or kg]; unit of its coordinate and of the force along it, which is
    empty where that is not known; whether it is a closing one, whose acceleration is not known.
    """

    number: int
    gear_ratio: float
    rotor: float
    unit: str
    effort_unit: str
    closing: bool = False


class JointMotion(NamedTuple):
    """Motion of a joint at k times: physical angle, rate, acceleration (k,) [rad or m]."""

    angle: Array
    rate: Array
    acceleration: Array


class JointForce(NamedTuple):
    """What acts along a joint at k times [N m or N]: its drive, and spring, damper and friction together, (k,)."""

    drive: Array
    passive: Array


class Site(NamedTuple):
    """A place of a link for which it has recovery maps: number of the link, of the place within them, names of its six
    components, and unit vectors (3, 3) in whose directions they are counted, in the mesh frame.
    """

    link: int
    site: int
    components: tuple[str, ...]
    axes: Array


class Seen(Protocol):
    """A mechanism at k times."""

    def node(self, at: Node) -> NodeMotion:
        """Motion of a node."""

    def pull(self, link: int) -> Array:
        """(k, 3) gravity and forces per mass on what sits on a link [m/s²], world axes."""

    def joint(self, at: Moved) -> JointMotion:
        """Motion of a joint."""


class SeenLinks(Seen, Protocol):
    """A chain of links at k times: sensors of what only links have are bound by a `Finder` that knows links."""

    def link_axes(self, link: int) -> Array:
        """(k, 3, 3) mesh axes of a link, which turn with its inboard interface."""

    def joint_force(self, at: Moved) -> JointForce:
        """Forces along it."""

    def recovered(self, at: Site) -> Array:
        """(k, 6) stress [Pa] or section forces [N, N m] there."""


class Finder(Protocol):
    """Who knows what names in a sensor mean; whoever asks says where the name stands.

    Each raises
        SceneError
            BAD_REFERENCE, BAD_FIELD.
        FEImportError
            A link that holds nothing to recover from.
    """

    def node(self, point: str, turning: bool, place: Place) -> Node:
        """A named point; ``turning``: it has to turn."""

    def joint(self, name: str, place: Place) -> Moved:
        """A joint, or one of its coordinates; a closing joint that has one."""

    def site(self, point: str, quantity: str, element: int | None, place: Place) -> Site:
        """A place at a named point with recovery maps of a quantity: the first one, or that of an element."""

    def compliance(self, at: Site, direction: Array | None, offset: Array, place: Place) -> Array:
        """(6,) strain per unit of each component."""


class Sensor(NamedTuple):
    """A sensor that knows what it reads.

    Attributes
    ----------
    name : str
    columns : sequence of (str, str)
        Name of each component, empty for the only one, and its unit.
    read : callable
        (k, c) readings of the `Seen` of the mechanism whose `Finder` bound it, of links a `SeenLinks`.
    """

    name: str
    columns: Sequence[tuple[str, str]]
    read: Callable[[Any], Array]


class SensorRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="type"):
    """Base of all sensors.

    Attributes
    ----------
    name : str
        What tables and reports call it.
    """

    name: str


class PointSensor(SensorRecord, frozen=True, kw_only=True):
    """Base of sensors that read a vector at a point.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``.
    direction : (3,) floats, optional
        Only the component along it is read; all three unless given.
    """

    point: str
    direction: tuple[float, float, float] | None = None

    def along(self, unit: str, vectors: Callable[[Any], Array], place: Place) -> Sensor:
        """Reading of vectors (k, 3): their components, or the one that is asked for."""
        if self.direction is None:
            return Sensor(self.name, [(axis, unit) for axis in "xyz"], vectors)
        way = unit_vector(self.direction, place)
        return Sensor(self.name, [("", unit)], lambda seen: (vectors(seen) @ way)[:, None])


class TurningSensor(PointSensor, frozen=True, kw_only=True):
    """Base of sensors that turn with what they sit on.

    Attributes
    ----------
    axes : str
        Of what is read: the mesh axes of the link, which turn with the displaced ``node`` of the point, or with the
        inboard interface of the ``link``; or those of the ``world``.
    """

    axes: str = "node"

    def own_axes(self, finder: Finder, place: Place) -> tuple[Node, Callable[[Any, Array], Array]]:
        """The node, and what turns vectors (k, 3) of the world into these axes."""
        place.choice("axes", self.axes, AXES)
        at = finder.node(self.point, self.axes == "node", place)
        if self.axes == "link" and at.link < 0:
            remedy = "use axes = 'node' or 'world'"
            raise place.error("axes", "there are no links here", self.axes, remedy=remedy)
        if self.axes == "world":
            return at, lambda seen, vectors: vectors
        if self.axes == "link":
            return at, lambda seen, vectors: turned_back(seen.link_axes(at.link), vectors)
        return at, lambda seen, vectors: turned_back(seen.node(at).turn, vectors)


def turned_back(turn: Array, vectors: Array) -> Array:
    """(k, 3) world vectors in axes that have turned by (k, 3, 3)."""
    return np.asarray(np.einsum("kji,kj->ki", turn, vectors))


def unit_vector(direction: Sequence[float], place: Place) -> Array:
    """(3,) of length 1.

    Raises
    ------
    SceneError
        BAD_FIELD: no direction at all.
    """
    length = float(np.linalg.norm(direction))
    if not length:
        raise place.error("direction", "a direction needs a length", direction, remedy="give three numbers, not all 0")
    return np.array(direction) / length


def component_of(wanted: str, known: Sequence[str], place: Place) -> IntArray:
    """Numbers of the components that are read: all, or the one of that name."""
    if not wanted:
        return np.arange(len(known))
    place.choice("component", wanted, known)
    return np.array([list(known).index(wanted)])
