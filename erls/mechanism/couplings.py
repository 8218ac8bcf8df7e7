"""Couplings: a joint coordinate that follows others by ratios, as gears, belts and differentials tie them, or by a cam.

    e = θ - Σ rᵢ θᵢ - c(θ_c) - offset

is zero of an ideal coupling, or what an elastic one is wound up by. It acts along joint coordinates alone: on the joint
that follows by a force, on the others by -rᵢ, or -c', times that force, so that its power is that of e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.mechanism.curves import Piecewise
from erls.mechanism.joint_types import Condition, JointType, Z


@dataclass(frozen=True)
class Cam:
    """A curve over a coordinate.

    Attributes
    ----------
    curve : Piecewise
        Over the coordinate in place of time.
    origin, period : float
        Where it begins, and after how much of the coordinate it repeats; 0: it does not.
    """

    curve: Piecewise
    origin: float
    period: float


@dataclass(frozen=True)
class Term:
    """A joint coordinate and what e changes by per unit of it, or of what a cam makes of it: 1 of the joint that
    follows, -rᵢ and -1 of the others.
    """

    joint: str
    factor: float
    cam: Cam | None = None


@dataclass(frozen=True)
class Coupling:
    """What ties joint coordinates.

    Attributes
    ----------
    terms : tuple of Term
        That of the joint that follows first.
    offset : float
        Of its coordinate [rad or m].
    turns : bool
        Whether e is an angle.
    """

    terms: tuple[Term, ...]
    offset: float
    turns: bool


IDEAL = JointType("coupling", None, (Condition("ratio", np.eye(3)[Z], np.zeros((3, 3))),), axes=0)
ELASTIC = JointType("coupling", None, (), axes=0)
"""A coupling closes a chain as a joint does whose frames, both in the world, lie e apart along z: one condition, or a
force along it.
"""
