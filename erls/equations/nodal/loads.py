"""Forces and moments at nodes: dead ones keep their direction, in the world or in the axes of another node, follower
ones turn with the node.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.joints import GROUND
from erls.equations.nodal.scatter import IntArray
from erls.maths.so3 import Array, cross


def _ramp(t: float) -> float:
    return t


@dataclass(frozen=True)
class NodalLoad:
    """A force and a moment at a node.

    Attributes
    ----------
    node : int
    force, moment : (3,) array
        [N], [N m]; in the world's axes, or the node's if ``follower``.
    follower : bool
    position : (3,) array
        Where the force acts, in the node's axes [m].
    axes : int
        Another node in whose axes force and moment are given; `GROUND` for the world.
    factor : callable
        What multiplies both at a time; t itself unless given, the load parameter of `erls.equations.nodal.statics`.
    breakpoints : tuple
        Times at which the factor jumps.
    """

    node: int
    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    follower: bool = False
    position: Array = field(default_factory=lambda: np.zeros(3))
    axes: int = GROUND
    factor: Callable[[float], float] = _ramp
    breakpoints: tuple[float, ...] = ()


class NodalLoads:
    """All loads at nodes as arrays, for `erls.equations.nodal.body_forces`."""

    def __init__(self, loads: Sequence[NodalLoad]) -> None:
        self.loads = tuple(loads)
        self.nodes: IntArray = np.array([[x.node, x.axes] for x in loads], dtype=np.int64).reshape(-1, 2)
        self.positions = np.array([x.position for x in loads], dtype=float).reshape(-1, 3)
        self.wrenches = np.array([[*x.force, *x.moment] for x in loads], dtype=float).reshape(-1, 6)
        self.dead = np.array([not x.follower for x in loads], dtype=np.int64)

    def power(self, t: float, poses: Array, twists: Array) -> float:
        """Of all [W], at poses (k, 4, 4) and twists (k, 6) of the nodes in their own axes."""
        total = 0.0
        for x in self.loads:
            force, moment, turn = x.force, x.moment, poses[x.node, :3, :3]
            if not x.follower:
                given = np.eye(3) if x.axes == GROUND else poses[x.axes, :3, :3]
                force, moment = turn.T @ given @ force, turn.T @ given @ moment
            speed, spin = twists[x.node, :3], twists[x.node, 3:]
            total += x.factor(t) * float(force @ (speed + cross(spin, x.position)) + moment @ spin)
        return total

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Of all factors."""
        return tuple(sorted({t for x in self.loads for t in x.breakpoints}))
