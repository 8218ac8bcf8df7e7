"""A gyroscope: how fast what it sits on turns."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor, TurningSensor


class Gyroscope(TurningSensor, frozen=True, kw_only=True, tag="gyroscope"):
    """Angular velocity of what a point sits on against the world [rad/s], in its own axes, as a rate gyroscope there
    reads it. The point has to turn: an interface, or any node of a link made of beams.
    """

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        finder.node(self.point, True, place)
        at, turned = self.own_axes(finder, place)
        return self.along("rad/s", lambda seen: turned(seen, seen.node(at).spin), place)
