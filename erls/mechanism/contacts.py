"""Contacts: points against planes, and the stops of joints, that answer by the law of `erls.maths.contact_law`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from erls.maths.contact_places import RATE, SLIDES
from erls.maths.so3 import Array

_FAR = 1e300
_GIVE = 1e-9  # of the size of a mechanism, or rad: how far what sticks is moved by all that friction holds
_SETTLING = 1e-4  # s, in which it comes to rest there


@dataclass(frozen=True)
class ContactLaw:
    """F = k δⁿ (1 + d σ(δ̇ / w)).

    Attributes
    ----------
    stiffness : float
        k [N/mⁿ], or [N m/radⁿ] where something turns.
    exponent : float
        n: 1.5 after Hertz, 1 for a linear spring.
    restitution : float
        e: rate after an impact over that before, of a free rigid body.
    transition_rate : float
        w: rate of the depth beyond which damping grows no more [m/s or rad/s].
    """

    stiffness: float
    exponent: float
    restitution: float
    transition_rate: float

    @property
    def loss(self) -> float:
        """d, by which a free rigid body rebounds with ``restitution``."""
        square = self.restitution**2
        return (1 - square) / (1 + square)

    @property
    def numbers(self) -> Array:
        """(4,) as in `erls.maths.contact_law`."""
        return np.array([self.stiffness, self.exponent, self.loss, self.transition_rate])


def holding_friction(sliding: float, size: float) -> Array:
    """(9,) friction of what may stick, as in `erls.maths.contact_law`, with a coefficient, or force, while it slides;
    ``size`` is that of the mechanism [m], or 1 rad. Smooth at rates that count as rest until modes are set.
    """
    give = _GIVE * size
    return np.array([sliding, give / _SETTLING, 0.0, 1.0, 0.0, 0.0, 0.0, give, _SETTLING])


def constant_friction(force: float) -> Array:
    """(9,) friction that stays as it is."""
    return np.array([abs(force), 1.0, SLIDES, -np.copysign(1.0, force), 0.0, 0.0, 0.0, 1.0, 1.0])


@dataclass(frozen=True)
class Stops:
    """Ends of the range of a joint.

    Attributes
    ----------
    lower, upper : float
        Coordinates at which they are met [rad or m]; infinite where there is none.
    law : ContactLaw
    """

    lower: float
    upper: float
    law: ContactLaw

    @property
    def numbers(self) -> Array:
        """(6,) as in `erls.maths.contact_law`; one that is not there is far away, as 0 · ∞ is no number."""
        return np.concatenate([np.clip([self.lower, self.upper], -_FAR, _FAR), self.law.numbers])

    def force(self, angle: float, rate: float) -> tuple[float, float]:
        """Force on the coordinate, and what of it is elastic."""
        from erls.maths.contact_law import stop_force  # here, as below: it imports the compiler
        from erls.maths.jit import plain

        whole, elastic = plain(stop_force)(self.numbers, angle, rate)
        return float(whole), float(elastic)

    def energy(self, angle: float) -> float:
        """Elastic energy."""
        from erls.maths.contact_law import stop_energy
        from erls.maths.jit import plain

        return float(plain(stop_energy)(self.numbers, angle))


@dataclass(frozen=True)
class PointContact:
    """A node of a link that a plane keeps on its side; the plane is fixed to the ground, or to a node of a link.

    Attributes
    ----------
    name : str
    link, node : int
        Where it is pushed: number of the link, and of the node in its model.
    base : (link, node) or None
        What carries the plane; None for the ground.
    position, normal : (3,) arrays
        A point of the plane, and its outward unit normal: from that node in the mesh axes of its link as built, or in
        the world [m].
    law : ContactLaw
    friction : float
        Coefficient µ.
    friction_rate : float
        Speed along the plane at which friction reaches 76 % of µ F [m/s].
    static_friction : float
        Coefficient of what holds a point that sticks, not less than µ; 0 where none does.
    """

    name: str
    link: int
    node: int
    base: tuple[int, int] | None
    position: Array
    normal: Array
    law: ContactLaw
    friction: float = 0.0
    friction_rate: float = 0.01
    static_friction: float = 0.0

    @property
    def sticks(self) -> bool:
        """Whether friction holds the point where it rests."""
        return self.static_friction > 0.0

    def sliding(self, reach: float) -> Array:
        """(9,) friction as in `erls.maths.contact_law`, of a mechanism of that size [m]; until modes are set
        smooth at speeds that count as rest, where the point may stick.
        """
        result = holding_friction(self.friction, reach)
        if not self.sticks:
            result[RATE] = self.friction_rate
        return result

    @property
    def axes(self) -> Array:
        """(9,) unit vectors of the plane: its normal, and two along it."""
        least = np.eye(3)[int(np.argmin(np.abs(self.normal)))]
        along = np.cross(self.normal, least)
        along /= math.sqrt(float(along @ along))
        return np.concatenate([self.normal, along, np.cross(self.normal, along)])
