"""Points against planes; forces are in `erls.equations.nodal.contact_forces`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.equations.nodal.springs import with_ground
from erls.maths.so3 import Array
from erls.mechanism.contacts import PointContact


@dataclass(frozen=True)
class NodalContact:
    """A point of a node against a plane.

    Attributes
    ----------
    nodes : tuple of int
        The point's node alone where the plane is fixed to the ground; else the node that carries the plane, and it.
    arm : (3,) array
        The point, in the axes of its node [m].
    contact : PointContact
        Law and plane, whose ``position`` and ``normal`` are in the axes of the node that carries it, or in the world.
    """

    nodes: tuple[int, ...]
    arm: Array
    contact: PointContact


class Contacts:
    """All contacts of a system of some size [m] as arrays, for `erls.equations.nodal.contact_forces`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, contacts: Sequence[NodalContact], reach: float = 1.0) -> None:
        self.contacts = tuple(c.contact for c in contacts)
        self.nodes: IntArray = with_ground([c.nodes for c in contacts])
        laws = []
        for arm, c in ((x.arm, x.contact) for x in contacts):
            laws.append([*arm, *c.position, *c.axes, *c.law.numbers, *c.sliding(reach)])
        self.laws = np.array(laws, dtype=float).reshape(-1, 28)
