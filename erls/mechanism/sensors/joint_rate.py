"""A tachometer."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor
from erls.mechanism.sensors.joints import JointSensor


class JointRate(JointSensor, frozen=True, kw_only=True, tag="joint_rate"):
    """Rate of a joint's physical angle, as a tachometer reads it [rad/s]; of one that slides [m/s]."""

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = self.found(finder, place)
        return self.geared(at, "/s", lambda seen: seen.joint(at).rate)
