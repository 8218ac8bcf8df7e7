"""Section forces of a link made of beams."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor, SensorRecord, component_of


class SectionForce(SensorRecord, frozen=True, kw_only=True, tag="section_force"):
    """Normal and shear forces N, Vy, Vz [N], torque T and bending moments My, Mz [N m] in a beam at a point, in the
    local axes of its element: what the part at larger local x does to the other. The link description needs a table
    ``[recovery]`` that takes in the point.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``.
    component : str
        ``N``, ``Vy``, ``Vz``, ``T``, ``My`` or ``Mz``; all unless given.
    element : int, optional
        The element whose end at the point is meant, counted from 0 in the order of the members; the first one unless
        given.
    """

    point: str
    component: str = ""
    element: int | None = None

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = finder.site(self.point, "section forces", self.element, place)
        numbers = component_of(self.component, at.components, place)
        columns = [(at.components[k], "N" if k < 3 else "N m") for k in numbers.tolist()]
        return Sensor(self.name, columns, lambda seen: seen.recovered(at)[:, numbers])
