"""A strain gauge: mechanical strain along one direction, at a place of a link."""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, SeenLinks, Sensor, SensorRecord, unit_vector


class StrainGauge(SensorRecord, frozen=True, kw_only=True, tag="strain_gauge"):
    """Strain of a link along one direction at a point [m/m], from its recovered stress or section forces; expansion by
    temperature is left out, as by a gauge that compensates it. The link description needs a table ``[recovery]`` that
    takes in the point.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``.
    direction : (3,) floats, optional
        Of the gauge, mesh axes. On a link made of beams it lies along the beam, and may be left out.
    offset : (3,) floats
        Of beams: from the axis of the beam at the point to the gauge, mesh axes [m]; its part across the beam counts.
    element : int, optional
        Of beams: the element whose end at the point is meant, counted from 0 in the order of the members; the first one
        unless given.
    compliance : (6,) floats, optional
        Strain per unit of each component of stress (xx, yy, zz, xy, yz, zx) [1/Pa] or section force (N, Vy, Vz [1/N],
        T, My, Mz [1/(N m)]) at the place, for a link that is a modal file; from material and section of the link
        description unless given. A run file holds it.
    """

    point: str
    direction: tuple[float, float, float] | None = None
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    element: int | None = None
    compliance: tuple[float, ...] | None = None

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = finder.site(self.point, "", self.element, place)
        row = self.strain_row(finder, place)

        def read(seen: SeenLinks) -> Array:
            return np.asarray((seen.recovered(at) @ row)[:, None])

        return Sensor(self.name, [("", "1")], read)

    def strain_row(self, finder: Finder, place: Place) -> Array:
        """(6,) strain per unit of each component."""
        at = finder.site(self.point, "", self.element, place)
        way = None if self.direction is None else unit_vector(self.direction, place)
        if self.compliance is None:
            return finder.compliance(at, way, np.array(self.offset), place)
        if len(self.compliance) != len(at.components):
            remedy = f"give {len(at.components)}: {', '.join(at.components)}"
            message = "one number for each component"
            raise place.error("compliance", message, len(self.compliance), len(at.components), remedy=remedy)
        return np.array(self.compliance)
