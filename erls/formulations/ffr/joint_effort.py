"""Forces on the joint coordinates: drives, feed-forward, springs, dampers, friction; and rotors."""

from __future__ import annotations

import numpy as np

from erls.lie.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.rigid_dynamics import inverse_dynamics


class JointEfforts:
    """What acts along the joint coordinates, which are the physical angles [N m or N].

    Attributes
    ----------
    rotors : (joints,) array
        Reflected inertia on each coordinate.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.rotors = np.array([j.rotor_inertia for j in mechanism.joints])
        self._active = [
            k for k, j in enumerate(mechanism.joints) if j.forces.active or j.drive.kind not in ("free", "motion")
        ]
        self._leading = [k for k in self._active if mechanism.joints[k].drive.feed_forward]
        self._known: tuple[float, Array] = (np.nan, np.zeros(0))

    @property
    def any(self) -> bool:
        """Whether any force or rotor acts in a joint."""
        return bool(self._active) or bool(self.rotors.any())

    def at(self, t: float, angles: Array, rates: Array) -> Array:
        """(joints,) force on each coordinate; zero for what a prescribed motion takes."""
        result = np.zeros(len(self.rotors))
        for k in self._active:
            joint, angle, rate = self.mechanism.joints[k], float(angles[k]), float(rates[k])
            torque = joint.drive.torque(t, angle, rate)
            if k in self._leading:
                torque += float(self._feed_forward(t)[k])
            result[k] = joint.drive.limited(torque) + joint.forces.force(angle, rate)
        return result

    def gains(self, rates: Array) -> tuple[Array, Array]:
        """(joints,) twice: minus the derivatives of the forces by angle and by rate."""
        stiffness, damping = np.zeros((2, len(self.rotors)))
        for k in self._active:
            joint = self.mechanism.joints[k]
            passive, active = joint.forces.gains(float(rates[k])), joint.drive.gains
            stiffness[k], damping[k] = passive[0] + active[0], passive[1] + active[1]
        return stiffness, damping

    def _feed_forward(self, t: float) -> Array:
        """(joints,) what the rigid chain needs for the wanted motions; joints without one are held where they begin."""
        if self._known[0] != t:
            wanted = np.array([j.drive.reference(t) or (j.position, 0.0, 0.0) for j in self.mechanism.joints])
            self._known = (t, inverse_dynamics(self.mechanism, *wanted.T))
        return self._known[1]
