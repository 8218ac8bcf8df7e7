"""An encoder."""

from __future__ import annotations

from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, Sensor
from erls.mechanism.sensors.joints import JointSensor


class JointAngle(JointSensor, frozen=True, kw_only=True, tag="joint_angle"):
    """Physical angle of a joint, as an encoder reads it [rad]; of one that slides its coordinate [m]."""

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = self.found(finder, place)
        return self.geared(at, "", lambda seen: seen.joint(at).angle)
