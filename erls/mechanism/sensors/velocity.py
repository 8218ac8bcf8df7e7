"""How fast a point moves."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor, TurningSensor


class Velocity(TurningSensor, frozen=True, kw_only=True, tag="velocity"):
    """Velocity of a point against the world [m/s]."""

    axes: str = "world"

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at, turned = self.own_axes(finder, place)
        return self.along("m/s", lambda seen: turned(seen, seen.node(at).velocity), place)
