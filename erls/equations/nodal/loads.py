"""Forces and moments at nodes: dead ones keep their direction in the world, follower ones turn with the node."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.maths.rotation_maps import skews
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
        What multiplies both at a time; t itself unless given, which is the load parameter of
    `erls.equations.nodal.statics`. breakpoints : tuple
        Times at which the factor jumps.
    """

    node: int
    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    follower: bool = False
    factor: Callable[[float], float] = _ramp
    breakpoints: tuple[float, ...] = ()


class NodalLoads:
    """All loads at nodes, as `erls.equations.nodal.elements.Elements`."""

    def __init__(self, loads: Sequence[NodalLoad]) -> None:
        self.loads = tuple(loads)
        self.nodes: IntArray = np.array([[x.node] for x in loads], dtype=np.int64).reshape(-1, 1)
        self._wrench = np.array([[x.force, x.moment] for x in loads], dtype=float).reshape(-1, 2, 3)
        self._dead = np.array([not x.follower for x in loads])[:, None, None]

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Of all factors."""
        return tuple(sorted({t for x in self.loads for t in x.breakpoints}))

    def remember(self, poses: Array, before: None) -> None:
        """Nothing."""

    def mass(self, poses: Array, memory: None) -> Array:
        """None."""
        return np.zeros((len(self.nodes), 6, 6))

    def forces(self, t: float, poses: Array, memory: None, v: Array, a: Array) -> Array:
        """(e, 6)"""
        return -self._local(t, poses).reshape(-1, 6)

    def derivatives(
        self, t: float, poses: Array, memory: None, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(e, 6, 6) twice: dead loads turn in the node's axes."""
        stiffness, none = np.zeros((2, len(self.nodes), 6, 6))
        turning = np.where(self._dead[..., None], -skews(self._local(t, poses)), 0.0)
        stiffness[:, :3, 3:], stiffness[:, 3:, 3:] = turning[:, 0], turning[:, 1]
        return stiffness, none

    def energy(self, t: float, poses: Array, memory: None, v: Array) -> tuple[float, float]:
        """Loads are counted as work done from outside."""
        return 0.0, 0.0

    def _local(self, t: float, poses: Array) -> Array:
        """(e, 2, 3) forces and moments in node axes."""
        scaled = np.array([x.factor(t) for x in self.loads])[:, None, None] * self._wrench
        result: Array = np.where(self._dead, scaled @ poses[:, 0, :3, :3], scaled)
        return result
