"""Forces on the joint coordinates: drives, feed-forward, springs, dampers, friction; and rotors."""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.rigid_dynamics import inverse_dynamics


class JointEfforts:
    """What acts along the joint coordinates, which are the physical angles [N m or N].

    Attributes
    ----------
    rotors : (joints,) array
        Reflected inertia on each coordinate.
    active, leading : lists of int
        Joints with a drive, spring, damper or friction; those whose drive feeds forward.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.rotors = np.array([j.rotor_inertia for j in mechanism.joints])
        self.active = [
            k for k, j in enumerate(mechanism.joints) if j.forces.active or j.drive.kind not in ("free", "motion")
        ]
        self.leading = [k for k in self.active if mechanism.joints[k].drive.feed_forward]
        self._known: tuple[float, Array] = (np.nan, np.zeros(0))

    @property
    def any(self) -> bool:
        """Whether any force or rotor acts in a joint."""
        return bool(self.active) or bool(self.rotors.any())

    def at(self, t: float, angles: Array, rates: Array) -> Array:
        """(joints,) force on each coordinate; zero for what a prescribed motion takes."""
        result = np.zeros(len(self.rotors))
        for k in self.active:
            joint, angle, rate = self.mechanism.joints[k], float(angles[k]), float(rates[k])
            result[k] = joint.drive.limited(self._wanted(k, t, angle, rate)) + joint.forces.force(angle, rate)
        return result

    def _wanted(self, k: int, t: float, angle: float, rate: float) -> float:
        """Force that the drive of joint k asks of its motor."""
        torque = self.mechanism.joints[k].drive.torque(t, angle, rate)
        return torque + float(self._feed_forward(t)[k]) if k in self.leading else torque

    def gains(self, t: float, angles: Array, rates: Array) -> tuple[Array, Array]:
        """(joints,) twice: minus the derivatives of the forces by angle and by rate."""
        stiffness, damping = np.zeros((2, len(self.rotors)))
        for k in self.active:
            joint, angle, rate = self.mechanism.joints[k], float(angles[k]), float(rates[k])
            passive, active = joint.forces.gains(rate), joint.drive.gains_at(self._wanted(k, t, angle, rate))
            stiffness[k], damping[k] = passive[0] + active[0], passive[1] + active[1]
        return stiffness, damping

    def _feed_forward(self, t: float) -> Array:
        """(joints,) what the rigid chain needs for the wanted motions; joints without one are held where they begin."""
        if self._known[0] != t:
            wanted = np.array([j.drive.reference(t) or (j.position, 0.0, 0.0) for j in self.mechanism.joints])
            self._known = (t, inverse_dynamics(self.mechanism, *wanted.T))
        return self._known[1]
