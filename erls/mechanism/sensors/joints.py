"""What sensors in joints share: a name, and on which side of the gear they sit."""

from __future__ import annotations

from collections.abc import Callable

from erls.maths.so3 import Array
from erls.mechanism.place import Place
from erls.mechanism.sensors.base import SIDES, Finder, Moved, Seen, Sensor, SensorRecord


class JointSensor(SensorRecord, frozen=True, kw_only=True):
    """Base of sensors in joints.

    Attributes
    ----------
    joint : str
        A joint, ``joint/coordinate`` of one with several, or a closing joint with one.
    side : str
        Of the gear of its motor: ``load``, or ``motor``, which turns ``gear_ratio`` times as far.
    """

    joint: str
    side: str = "load"

    def found(self, finder: Finder, place: Place, forced: bool = False) -> Moved:
        """The joint; ``forced``: what acts along it is read, too."""
        place.choice("side", self.side, SIDES)
        at = finder.joint(self.joint, place)
        if not at.effort_unit and (forced or self.side == "motor"):
            remedy = "read its joint_angle or joint_rate, side = 'load'"
            raise place.error("joint", "connections have no motors", self.joint, remedy=remedy)
        return at

    def geared(self, at: Moved, per_time: str, read: Callable[[Seen], Array]) -> Sensor:
        """Reading of the joint's coordinate, or a derivative, (k,), on the side that is asked for."""
        ratio, unit = (at.gear_ratio, "rad") if self.side == "motor" else (1.0, at.unit)
        return Sensor(self.name, [("", unit + per_time)], lambda seen: ratio * read(seen)[:, None])
