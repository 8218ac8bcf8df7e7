"""Joints of one coordinate, with the forces that act along it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import twist_transform
from erls.maths.so3 import Array
from erls.mechanism.contacts import Stops, holding_friction
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import Freedom
from fe_import.model import InterfaceNode

FRICTION_LAWS = ("smooth", "stick")
_SUDDEN = 1e-12  # rate that counts as rest, of friction on a motion that is prescribed


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
        Coulomb friction of a joint that slides.
    transition_rate : float
        Rate at which smooth friction, ``friction`` · tanh(rate / ``transition_rate``), reaches 76 % of its size.
    law : str
        A member of ``FRICTION_LAWS``: ``smooth``, or ``stick``, by which a joint at rest holds up to ``static`` and one
        that slides feels ``friction`` against its rate.
    static : float
        At least ``friction``; 0 where friction is smooth.
    stops : Stops or None
        Ends of the range.
    """

    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    transition_rate: float = 0.01
    law: str = "smooth"
    static: float = 0.0
    stops: Stops | None = None

    @property
    def sticks(self) -> bool:
        """Whether friction holds the joint where it rests."""
        return self.law == "stick" and self.static > 0.0

    def smooth_friction(self, prescribed: bool) -> tuple[float, float]:
        """Force and transition rate of friction that follows from the rate: sudden along a prescribed motion; none
        where the joint may rest, which its equations see to.
        """
        if self.law == "smooth":
            return self.friction, self.transition_rate
        return self.friction if prescribed else 0.0, _SUDDEN

    def grip(self, freedom: Freedom, size: float) -> Array:
        """(9,) friction that may stick, as in `erls.maths.contact_law`, in a mechanism of that size [m]."""
        return holding_friction(self.friction, 1.0 if freedom.turns else size)

    def force(self, angle: float, rate: float) -> float:
        """Force on the joint coordinate."""
        result = -self.stiffness * (angle - self.rest) - self.damping * rate
        if self.friction:
            reached = math.tanh(rate / self.transition_rate) if self.law == "smooth" else float(np.sign(rate))
            result -= self.friction * reached
        return result if self.stops is None else result + self.stops.force(angle, rate)[0]

    def elastic_force(self, angle: float) -> float:
        """What of it follows from `energy`."""
        result = -self.stiffness * (angle - self.rest)
        return result if self.stops is None else result + self.stops.force(angle, 0.0)[1]

    def energy(self, angle: float) -> float:
        """Elastic energy of spring and stops."""
        result = self.stiffness * (angle - self.rest) ** 2 / 2
        return result if self.stops is None else result + self.stops.energy(angle)

    @property
    def active(self) -> bool:
        """Whether any force can arise."""
        return bool(self.stiffness or self.damping or self.friction or self.sticks or self.stops)


@dataclass(frozen=True)
class Joint:
    """A joint between two links, or the ground and a link.

    Attributes
    ----------
    name : str
    freedom : Freedom
    before : (4, 4) array
        Pose of the joint frame that is fixed to the link it stands on, in that link's mesh frame (in the world, base
        pose included, on the ground).
    after : (4, 4) array
        Pose of the mesh frame of the link that it carries, in the joint frame that is fixed to that link.
    forces : JointForces
    rotor_inertia : float
        Inertia reflected to the joint (rotor inertia times squared gear ratio) [kg m² or kg].
    drive : Drive
    position, rate : float
        Initial coordinate and rate [rad, rad/s or m, m/s].
    parent : int
        Number of the link that it stands on, -1 for the ground.
    seat : InterfaceNode or None
        Where it stands on that link; None on the ground.
    fixed : bool
        Whether it is there to hold two links together: its motion is prescribed, and nothing drives it.
    """

    name: str
    freedom: Freedom
    before: Array
    after: Array
    forces: JointForces
    rotor_inertia: float
    drive: Drive
    position: float
    rate: float
    parent: int = -1
    seat: InterfaceNode | None = None
    fixed: bool = False

    @property
    def screw(self) -> Array:
        """(6,) twist of unit joint velocity in the mesh frame of the link that it carries."""
        return np.asarray(twist_transform(self.after) @ self.freedom.screw)
