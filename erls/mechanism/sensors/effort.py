"""What a motor gives, or what arrives behind gear and rotor."""

from __future__ import annotations

from erls.maths.so3 import Array
from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Finder, SeenLinks, Sensor
from erls.mechanism.sensors.joints import JointSensor


class Effort(JointSensor, frozen=True, kw_only=True, tag="effort"):
    """Torque [N m] or force [N] along a joint.

    With ``side = "motor"`` what the motor gives on its shaft, as its current tells: the effort of the drive over
    ``gear_ratio``. With ``load`` what a torque sensor behind the gear reads, between the joint and the link that it
    carries: that of drive, spring, damper and friction together, less what the rotor's inertia takes.
    """

    def bind(self, finder: Finder, place: Place) -> Sensor:
        """Check, and say what is read."""
        at = self.found(finder, place, forced=True)
        if self.side == "load" and at.rotor and at.closing:
            remedy = "use side = 'motor'"
            raise place.error("side", "what the rotor of a closing joint takes is not known", "load", remedy=remedy)

        def motor(seen: SeenLinks) -> Array:
            return seen.joint_force(at).drive[:, None] / at.gear_ratio

        def load(seen: SeenLinks) -> Array:
            force = seen.joint_force(at)
            total = force.drive + force.passive
            if at.rotor:
                total = total - at.rotor * seen.joint(at).acceleration
            return total[:, None]

        if self.side == "motor":
            return Sensor(self.name, [("", "N m")], motor)
        return Sensor(self.name, [("", at.effort_unit)], load)
