"""Joints: one-parameter motions about or along z, with the forces that act in them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import twist_transform
from erls.maths.so3 import Array
from erls.mechanism.drives import Drive


@dataclass(frozen=True)
class JointType:
    """A kind of joint.

    Attributes
    ----------
    revolute : bool
        Turns about z; otherwise slides along z.
    screw : (6,) array
        Twist [v; ω] of unit joint velocity in the joint frame.
    free_row : int
        Row of the relative displacement (u, φ) in the joint frame that the joint leaves free.
    """

    revolute: bool
    screw: Array
    free_row: int


JOINT_TYPES = {
    "revolute": JointType(True, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), 5),
    "prismatic": JointType(False, np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), 2),
}


@dataclass(frozen=True)
class JointForces:
    """Passive forces in a joint [N m and rad, or N and m].

    Attributes
    ----------
    stiffness, rest : float
        Spring towards ``rest``.
    damping : float
        Viscous.
    friction : float
        Coulomb friction, made smooth: ``friction`` · tanh(rate / ``transition_rate``).
    transition_rate : float
        Rate at which friction reaches 76 % of its size.
    """

    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    transition_rate: float = 0.01

    def force(self, angle: float, rate: float) -> float:
        """Force on the joint coordinate."""
        result = -self.stiffness * (angle - self.rest) - self.damping * rate
        if self.friction:
            result -= self.friction * math.tanh(rate / self.transition_rate)
        return result

    def gains(self, rate: float) -> tuple[float, float]:
        """-∂force/∂angle and -∂force/∂rate."""
        slope = 0.0
        if self.friction:
            slope = (
                self.friction
                / self.transition_rate
                / math.cosh(min(abs(rate) / self.transition_rate, 300)) ** 2
            )
        return self.stiffness, self.damping + slope

    @property
    def active(self) -> bool:
        """Whether any force can arise."""
        return bool(self.stiffness or self.damping or self.friction)


@dataclass(frozen=True)
class Joint:
    """A joint between link k-1 (or the base) and link k.

    Attributes
    ----------
    name : str
    type : JointType
    before : (4, 4) array
        Pose of the joint frame that is fixed to link k-1, in that link's mesh frame (or in the world, base pose
        included, for the first joint).
    after : (4, 4) array
        Pose of link k's mesh frame in the joint frame that is fixed to link k.
    forces : JointForces
    rotor_inertia : float
        Inertia reflected to the joint (rotor inertia times squared gear ratio) [kg m² or kg].
    drive : Drive
    position, rate : float
        Initial coordinate and rate [rad, rad/s or m, m/s].
    """

    name: str
    type: JointType
    before: Array
    after: Array
    forces: JointForces
    rotor_inertia: float
    drive: Drive
    position: float
    rate: float

    @property
    def screw(self) -> Array:
        """(6,) twist of unit joint velocity in link k's mesh frame."""
        return np.asarray(twist_transform(self.after) @ self.type.screw)
