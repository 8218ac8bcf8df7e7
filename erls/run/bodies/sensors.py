"""Motion of the nodes of a scene of bodies and beams, and what its sensors make of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.scenes.build import Assembly
from erls.equations.serial.motion_series import spin_of
from erls.errors import SceneError
from erls.maths.so3 import Array, cross_all
from erls.mechanism.place import Place
from erls.mechanism.sensors.base import JointMotion, Moved, Node, NodeMotion, Sensor, Site
from erls.run.bodies.connections import ONE_COORDINATE, joint_frames
from erls.scene.bodies.schema import BodyScene
from fe_import.files.toml import choose

if TYPE_CHECKING:
    from erls.run.bodies.motion import BodyMotion

_ALL = -1  # in place of a link


def body_sensors(scene: BodyScene, assembly: Assembly) -> tuple[Sensor, ...]:
    """Sensors of a scene, which know what they read.

    Raises
    ------
    SceneError
        Naming file, field, value and remedy.
    """
    finder = BodyFinder(assembly)
    places = (Place(scene.folder, f"{scene.path}: sensors[{k}]") for k in range(len(scene.record.sensors)))
    return tuple(sensor.bind(finder, place) for sensor, place in zip(scene.record.sensors, places, strict=True))


class BodyFinder:
    """A `erls.mechanism.sensors.base.Finder`.

    Parameters
    ----------
    assembly : Assembly
    """

    def __init__(self, assembly: Assembly) -> None:
        self._numbers = assembly.numbers
        self._joints = [joint.name for joint in assembly.full.rows.joints]
        self._units = {j.name: ONE_COORDINATE[j.type] for j in assembly.full.rows.joints if j.type in ONE_COORDINATE}

    def node(self, point: str, turning: bool, place: Place) -> Node:
        """A node, a body, or an inner node of a beam; all turn."""
        choose(point, self._numbers, place.field("point"), SceneError)
        return Node(_ALL, self._numbers[point])

    def joint(self, name: str, place: Place) -> Moved:
        """A connection that has one coordinate."""
        choose(name, self._units, place.field("joint"), SceneError)
        unit = self._units[name]
        return Moved(self._joints.index(name), 1.0, 0.0, unit, "", True)

    def site(self, point: str, quantity: str, element: int | None, place: Place) -> Site:
        """Nothing is recovered."""
        self._refuse(place, point)

    def compliance(self, at: Site, direction: Array | None, offset: Array, place: Place) -> Array:
        """Nothing is recovered."""
        self._refuse(place, at.site)

    def _refuse(self, place: Place, value: object) -> NoReturn:
        message = "nothing is recovered in a scene of bodies and beams"
        raise place.error("type", message, value, remedy="use a chain of links, with a table [recovery] in their files")


@dataclass(frozen=True)
class BodyInstants:
    """A motion at times (k,), as its run interpolates it; a `erls.mechanism.sensors.base.Seen`."""

    run: BodyMotion
    t: Array

    @cached_property
    def _nodes(self) -> dict[int, NodeMotion]:
        return {}

    def node(self, at: Node) -> NodeMotion:
        """Motion of a node."""
        if at.node not in self._nodes:
            self._nodes[at.node] = node_motion(*self.run.moving(self.t, [at.node]))
        return self._nodes[at.node]

    def pull(self, link: int) -> Array:
        """(k, 3) gravity [m/s²]."""
        return np.tile(np.array(self.run.scene.record.gravity), (len(self.t), 1))

    def joint(self, at: Moved) -> JointMotion:
        """Coordinate and rate of a connection; its acceleration is not looked for."""
        joint: Joint = self.run.assembly.full.rows.joints[at.number]
        rate = self._rate(joint, at.unit == "rad")
        return JointMotion(self.run.joint_angle(joint.name, self.t), rate, np.full(len(self.t), np.nan))

    def _rate(self, joint: Joint, turns: bool) -> Array:
        """(k,) about or along the z axis of the inner frame."""
        outer = self.node(Node(_ALL, joint.outer))
        still = np.zeros((len(self.t), 3))
        ground = NodeMotion(still, still, still, outer.turn, still, still)
        inner = self.node(Node(_ALL, joint.inner)) if joint.inner != GROUND else ground
        poses = self.run.poses(self.t, [max(joint.inner, 0), joint.outer])
        first, second = joint_frames(joint, poses[:, 0], poses[:, 1])
        axis = first[:, :3, 2]
        if turns:
            return _dot(axis, outer.spin - inner.spin)
        speed = outer.velocity + cross_all(outer.spin, second[:, :3, 3] - outer.place)
        speed = speed - inner.velocity - cross_all(inner.spin, first[:, :3, 3] - inner.place)
        return _dot(axis, speed) + _dot(cross_all(inner.spin, axis), second[:, :3, 3] - first[:, :3, 3])


def _dot(a: Array, b: Array) -> Array:
    """(k,) of vectors (k, 3)."""
    return np.asarray((a * b).sum(axis=1))


def node_motion(place: Array, rate: Array, acceleration: Array) -> NodeMotion:
    """Of stored places and rotation matrices (k, 1, 12) of a node, with their derivatives."""
    shape = (len(place), 3, 3)
    left, _, right = np.linalg.svd(place[:, 0, 3:].reshape(shape))
    turn = left @ right
    spin, spin_rate = spin_of(turn, rate[:, 0, 3:].reshape(shape), acceleration[:, 0, 3:].reshape(shape))
    spin, spin_rate = (np.einsum("kij,kj->ki", turn, x) for x in (spin, spin_rate))
    return NodeMotion(place[:, 0, :3], rate[:, 0, :3], acceleration[:, 0, :3], turn, spin, spin_rate)
