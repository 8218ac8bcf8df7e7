"""The sensors of a chain: what their names mean in its mechanism, and how its links strain."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import msgspec
import numpy as np

from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Moved, Node, Sensor, Site
from erls.mechanism.sensors.strain_gauge import StrainGauge
from erls.run.chain.recovered import maps_of
from erls.scene.chain import Scene
from erls.scene.joints import Coordinate
from fe_import.description.link import load_link
from fe_import.description.meshes import Solid
from fe_import.description.records import Frame, LinkDescription
from fe_import.files.toml import choose
from fe_import.models.frame_parts import frame_parts
from fe_import.models.model import unit_factors

_ALONG = 1 - 1e-4  # cosine of the angle between a gauge and its beam


def sensors_of(scene: Scene, mechanism: Mechanism) -> tuple[Sensor, ...]:
    """Sensors of a scene, which know what they read.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.
    """
    finder = ChainFinder(scene, mechanism)
    return tuple(sensor.bind(finder, _place(scene, k)) for k, sensor in enumerate(scene.record.sensors))


def with_compliances(scene: Scene, mechanism: Mechanism) -> Scene:
    """The scene with what strain gauges need of the link descriptions written into it; all sensors are tried.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.
    """
    sensors = [
        msgspec.structs.replace(sensor, compliance=_compliance(scene, mechanism, k, sensor))
        if isinstance(sensor, StrainGauge) and sensor.compliance is None
        else sensor
        for k, sensor in enumerate(scene.record.sensors)
    ]
    found = replace(scene, record=msgspec.structs.replace(scene.record, sensors=sensors)) if sensors else scene
    sensors_of(found, mechanism)
    return found


def _compliance(scene: Scene, mechanism: Mechanism, number: int, gauge: StrainGauge) -> tuple[float, ...]:
    return tuple(gauge.strain_row(ChainFinder(scene, mechanism), _place(scene, number)).tolist())


def _place(scene: Scene, number: int) -> Place:
    return Place(scene.folder, f"{scene.path}: sensors[{number}]")


class ChainFinder:
    """A `erls.mechanism.sensors.base.Finder`.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self._scene, self._mechanism = scene, mechanism

    def node(self, point: str, turning: bool, place: Place) -> Node:
        """A named point."""
        points = {p.name: Node(p.link, p.node) for p in self._mechanism.points}
        choose(point, points, place.field("point"), SceneError)
        at = points[point]
        if turning and at.node not in self._mechanism.links[at.link].model.rotation_nodes:
            message = "this node has no rotation, so that nothing turns with it"
            remedy = "put the point on an interface or on beams; an accelerometer may take axes = 'link' instead"
            raise place.error("point", message, point, remedy=remedy)
        return at

    def joint(self, name: str, place: Place) -> Moved:
        """A joint, or a closing one."""
        mechanism, joints = self._mechanism, [joint.name for joint in self._mechanism.joints]
        moving: dict[str, tuple[int, Any]] = {name: (k, mechanism.joints[k]) for k, name in enumerate(joints)}
        closing = {loop.name: (len(joints) + k, loop.freedom) for k, loop in enumerate(mechanism.loops) if loop.freedom}
        known = {**moving, **closing}
        choose(name, known, place.field("joint"), SceneError)
        number, found = known[name]
        ratio = self._gear_ratio(name)
        if ratio == 0.0:
            raise place.error("joint", "its motor has gear_ratio 0", name, remedy="give the motor a gear ratio")
        unit, effort = found.freedom.units
        return Moved(number, ratio, found.rotor_inertia, unit, effort, name in closing)

    def _gear_ratio(self, name: str) -> float:
        record, (joint, _, coordinate) = self._scene.record, name.partition("/")
        for own in record.joints:
            if own.name == joint:
                inner = own.coordinates.get(coordinate, Coordinate())
                return float(inner.motor.gear_ratio if coordinate else own.motor.gear_ratio)
        own_ratio = (float(loop.motor.gear_ratio) for loop in record.loops if loop.name == joint)
        return next(own_ratio, 1.0)  # charges of motors have none

    def site(self, point: str, quantity: str, element: int | None, place: Place) -> Site:
        """A place with recovery maps."""
        at = self.node(point, False, place)
        maps = maps_of(self._mechanism.links[at.link])
        if quantity not in ("", maps.quantity):
            message = f"links like this one have {maps.quantity}, not {quantity}"
            remedy = "use type = 'stress' on solids, 'section_force' on beams"
            raise place.error("point", message, point, remedy=remedy)
        sites = np.flatnonzero(maps.nodes == at.node)
        if not len(sites):
            remedy = "add it to 'nodes' or 'sets' of the table [recovery] of the link description, or give all = true"
            raise place.error("point", "nothing is recovered at this node", point, remedy=remedy)
        if element is not None and maps.quantity != "stress":
            ends = maps.elements[sites].tolist()
            if element not in ends:
                remedy = "elements that end there: " + ", ".join(map(str, ends))
                raise place.error("element", "this element does not end at the point", element, remedy=remedy)
            sites = sites[[ends.index(element)]]
        site = int(sites[0])
        return Site(at.link, site, maps.components, maps.axes[site])

    def compliance(self, at: Site, direction: Array | None, offset: Array, place: Place) -> Array:
        """(6,) strain per unit of each component, from the link description."""
        mechanism, link = self._mechanism, self._mechanism.links[at.link]
        record = self._scene.record.links[mechanism.bodies.index(at.link)]
        remedy = "give 'compliance', strain per unit of " + ", ".join(at.components)
        if not record.model:
            raise place.error("point", "a modal file says nothing of material and section", link.name, remedy=remedy)
        path = self._scene.folder / record.model
        description = load_link(path).description
        if description.frame is not None:
            element = int(maps_of(link).elements[at.site])
            return _beam_row(description, description.frame, str(path), element, at, direction, offset, place)
        if description.solid is None or not description.solid.material:
            raise place.error("point", "its material is not the same all over the link", link.name, remedy=remedy)
        return _solid_row(description, description.solid, str(path), direction, place)


def _beam_row(
    link: LinkDescription, frame: Frame, where: str, element: int, at: Site, direction: Array | None, offset: Array,
    place: Place,
) -> Array:  # fmt: skip
    """ε = N / EA + z M_y / E I_y - y M_z / E I_z."""
    if direction is not None and abs(float(at.axes[0] @ direction)) < _ALONG:
        remedy = f"leave it out, or give the direction of the beam, {np.round(at.axes[0], 4).tolist()}"
        raise place.error("direction", "a gauge on a beam lies along it", direction.tolist(), remedy=remedy)
    own = frame_parts(link, frame, where).mesh.elements[element]
    s, (_, y, z) = own.section, (at.axes @ offset).tolist()
    return np.asarray(np.array([1 / s.area, 0.0, 0.0, 0.0, z / s.inertia_y, -y / s.inertia_z]) / own.youngs_modulus)


def _solid_row(link: LinkDescription, solid: Solid, where: str, direction: Array | None, place: Place) -> Array:
    """ε = ((1 + ν) dᵀ σ d - ν tr σ) / E, Hooke's law."""
    if direction is None:
        raise place.error("direction", "a gauge on a solid needs one", None, remedy="give it, in mesh axes")
    length, mass, time = unit_factors(link, where)
    material, (x, y, z) = link.materials[solid.material], direction.tolist()
    along = np.array([x * x, y * y, z * z, 2 * x * y, 2 * y * z, 2 * z * x])
    nu, modulus = material.poissons_ratio, material.youngs_modulus * mass / (length * time**2)
    return np.asarray(((1 + nu) * along - nu * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])) / modulus)
