"""Couplings: a joint coordinate that follows others by ratios, as gears, belts and differentials tie them.

    e = θ - Σ rᵢ θᵢ - offset

is zero of an ideal coupling, or what an elastic one is wound up by. It acts along joint coordinates alone: on the joint
that follows by a force, on the others by -rᵢ times that force, so that its power is that of e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.mechanism.joint_types import Condition, JointType, Z


@dataclass(frozen=True)
class Term:
    """A joint coordinate and what e changes by per unit of it: 1 of the joint that follows, -rᵢ of the others."""

    joint: str
    factor: float


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
