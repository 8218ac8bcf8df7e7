"""Stress of a link made of solid elements."""

from __future__ import annotations

import numpy as np

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor, SensorRecord, component_of
from fe_import.modal.recovery_maps import von_mises

_VON_MISES = "von_mises"


class Stress(SensorRecord, frozen=True, kw_only=True, tag="stress"):
    """Stress at a node of a solid link, mesh axes [Pa]. The link description needs a table ``[recovery]`` that takes in
    the point.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``.
    component : str
        ``xx``, ``yy``, ``zz``, ``xy``, ``yz``, ``zx`` or ``von_mises``; all six unless given.
    """

    point: str
    component: str = ""

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = finder.site(self.point, "stress", None, place)
        numbers = component_of(self.component, (*at.components, _VON_MISES), place)
        if self.component == _VON_MISES:
            return Sensor(self.name, [("", "Pa")], lambda seen: np.asarray(von_mises(seen.recovered(at)))[:, None])
        numbers = numbers[numbers < len(at.components)]
        columns = [(at.components[k], "Pa") for k in numbers.tolist()]
        return Sensor(self.name, columns, lambda seen: seen.recovered(at)[:, numbers])
