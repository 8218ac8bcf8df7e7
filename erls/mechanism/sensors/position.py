"""Where a point is."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, PointSensor, Sensor


class Position(PointSensor, frozen=True, kw_only=True, tag="position"):
    """Place of a point in the world [m], as a tracker sees it."""

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = finder.node(self.point, False, place)
        return self.along("m", lambda seen: seen.node(at).place, place)
