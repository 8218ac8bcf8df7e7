"""An accelerometer: what its proof mass needs to move along, weight included."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor, TurningSensor


class Accelerometer(TurningSensor, frozen=True, kw_only=True, tag="accelerometer"):
    """Specific force at a point [m/s²], as an accelerometer that sits there reads it: its acceleration less gravity, in
    its own axes; at rest it reads 9.81 m/s² upward, in free fall nothing. Forces on all mass (``force_per_mass``) pull
    its proof mass as gravity does.
    """

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at, turned = self.own_axes(finder, place)
        return self.along(
            "m/s2", lambda seen: turned(seen, seen.node(at).acceleration - seen.pull(at.link)), place
        )
