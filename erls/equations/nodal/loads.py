"""Forces and moments at nodes: dead ones keep their direction in the world, follower ones turn with the node."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.maths.so3 import Array


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
    factor : callable
        What multiplies both at a time; t itself unless given, the load parameter of `erls.equations.nodal.statics`.
    breakpoints : tuple
        Times at which the factor jumps.
    """

    node: int
    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    follower: bool = False
    factor: Callable[[float], float] = _ramp
    breakpoints: tuple[float, ...] = ()


class NodalLoads:
    """All loads at nodes as arrays, for `erls.equations.nodal.body_forces`."""

    def __init__(self, loads: Sequence[NodalLoad]) -> None:
        self.loads = tuple(loads)
        self.nodes: IntArray = np.array([[x.node] for x in loads], dtype=np.int64).reshape(-1, 1)
        self.wrenches = np.array([[*x.force, *x.moment] for x in loads], dtype=float).reshape(-1, 6)
        self.dead = np.array([not x.follower for x in loads], dtype=np.int64)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Of all factors."""
        return tuple(sorted({t for x in self.loads for t in x.breakpoints}))
