"""Torsion springs and dampers; forces are in `erls.equations.nodal.spring_forces`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.springs import with_ground
from erls.maths.so3 import Array


@dataclass(frozen=True)
class TurningSpring:
    """A torsion spring with a damper.

    Attributes
    ----------
    nodes : tuple of int
        The second node alone when the first side is the ground; first and second otherwise.
    first, second : (3, 3) array
        Axes of the spring in the frames of the nodes, in the world for the ground; as built they coincide.
    axis : (3,) array
        Unit vector in those axes.
    stiffness, damping : float
        [N m/rad], [N m s/rad]
    rest : float
        Angle without moment [rad].
    """

    nodes: tuple[int, ...]
    first: Array
    second: Array
    axis: Array
    stiffness: float
    damping: float
    rest: float


class TurningSprings:
    """All torsion springs of a system as arrays, for `erls.equations.nodal.spring_forces`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, springs: Sequence[TurningSpring]) -> None:
        self.nodes = with_ground([s.nodes for s in springs])
        self.frames = np.array([[s.first, s.second] for s in springs], dtype=float).reshape(-1, 18)
        self.laws = np.array([[*s.axis, s.stiffness, s.damping, s.rest] for s in springs], dtype=float).reshape(-1, 6)
