"""Forces and moments on nodes of links, and forces on all of their mass, which change with time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.curves import Curve

CENTRE = -1
"""In place of a node: the centre of mass of a link with what it carries, on which a force per mass acts as a whole."""


@dataclass(frozen=True)
class PointLoad:
    """A force and a moment on a node of a link, or a force on all of its mass.

    Attributes
    ----------
    link, node : int
        Where they act: number of the link, and of the node in its model, or `CENTRE`.
    wrench : (6,) array
        Force [N] and moment [N m]; on the centre force per mass [N/kg].
    axes : (link, node) or None
        Node whose axes the wrench is given in: it turns with them. As built these are the mesh axes of that link. The
        load's own node makes it a follower; None stands for the world.
    factor : Curve or None
        What multiplies the wrench at a time; 1 at all times for None.
    number : int
        Of the load of the scene that it is, or is a part of.
    """

    link: int
    node: int
    wrench: Array
    axes: tuple[int, int] | None = None
    factor: Curve | None = None
    number: int = 0

    @property
    def follower(self) -> bool:
        """Whether it turns with the node that it acts on."""
        return self.axes == (self.link, self.node)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which it jumps or has a kink [s]."""
        return () if self.factor is None else self.factor.breakpoints

    def at(self, t: float) -> Array:
        """(6,) wrench at a time, in its axes."""
        return np.asarray(self.wrench * (1.0 if self.factor is None else self.factor.value(t)))
