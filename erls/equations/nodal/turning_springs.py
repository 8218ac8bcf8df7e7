"""Torsion springs and dampers about an axis fixed to two nodes, or to a node and the ground.

With ψ = log(R₁ᵀ R₂) of frames that coincide as built, the angle is α = a · ψ, whole turns counted; about the axis of a
revolute joint it is the joint's angle. α̇ = w · (ω₂ − Rᵀ ω₁) with w = T⁻ᵀ(ψ) a, and the moment is k (α − α₀) + c α̇.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.maths import rotation_maps as rotations
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


@dataclass(frozen=True)
class Wound:
    """ψ (e, 3), Rᵀ (e, 3, 3), w (e, 3), and α̇ over the twists of the nodes (e, 6k)."""

    psi: Array
    back: Array
    w: Array
    rows: Array


class TurningSprings:
    """Torsion springs with one number of nodes, as `erls.equations.nodal.elements.Elements`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, springs: Sequence[TurningSpring]) -> None:
        self.nodes: IntArray = np.array([s.nodes for s in springs], dtype=np.int64)
        self._first, self._second = np.array([[s.first, s.second] for s in springs], dtype=float).swapaxes(0, 1)
        self._axis = np.array([s.axis for s in springs], dtype=float)
        self._stiffness, self._damping, self._rest = np.array([[s.stiffness, s.damping, s.rest] for s in springs]).T

    def remember(self, poses: Array, before: Wound | None) -> Wound:
        """How far the springs are wound up, next to how far they were."""
        first = poses[:, 0, :3, :3] @ self._first if self.nodes.shape[1] == 2 else self._first
        turn = np.swapaxes(first, 1, 2) @ poses[:, -1, :3, :3] @ self._second
        psi = rotations.log(turn) if before is None else rotations.log_near(turn, before.psi)
        back = np.swapaxes(turn, 1, 2)
        w = _times(np.swapaxes(rotations.tangent_inverse(psi), 1, 2), self._axis)
        rows = np.zeros((len(psi), 6 * self.nodes.shape[1]))
        rows[:, -3:] = _times(self._second, w)
        if self.nodes.shape[1] == 2:
            rows[:, 3:6] = -_times(self._first @ turn, w)
        return Wound(psi, back, w, rows)

    def mass(self, poses: Array, memory: Wound) -> Array:
        """None."""
        return np.zeros((len(self.nodes), 6 * self.nodes.shape[1], 6 * self.nodes.shape[1]))

    def angles(self, memory: Wound) -> Array:
        """(e,) α [rad]."""
        result: Array = (self._axis * memory.psi).sum(axis=1)
        return result

    def moments(self, memory: Wound, v: Array) -> Array:
        """(e,) [N m]"""
        rates = (memory.rows * v).sum(axis=1)
        result: Array = self._stiffness * (self.angles(memory) - self._rest) + self._damping * rates
        return result

    def forces(self, t: float, poses: Array, memory: Wound, v: Array, a: Array) -> Array:
        """(e, 6k)"""
        result: Array = self.moments(memory, v)[:, None] * memory.rows
        return result

    def derivatives(
        self, t: float, poses: Array, memory: Wound, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(e, 6k, 6k) twice; how rates change with the turn is left out."""
        outer = memory.rows[:, :, None] * memory.rows[:, None, :]
        stiffness, damping = self._stiffness[:, None, None] * outer, self._damping[:, None, None] * outer
        if not material:
            stiffness += self.moments(memory, v)[:, None, None] * self._turning(memory)
        return stiffness, damping

    def energy(self, t: float, poses: Array, memory: Wound, v: Array) -> tuple[float, float]:
        """None, and that of the springs."""
        return 0.0, float(self._stiffness @ (self.angles(memory) - self._rest) ** 2) / 2

    def _turning(self, memory: Wound) -> Array:
        """(e, 6k, 6k) derivative of the row by increments of the nodes."""
        e, size = len(memory.psi), 6 * self.nodes.shape[1]
        relative = np.zeros((e, 3, size))  # turn of the second frame against the first, in its axes
        relative[:, :, -3:] = np.swapaxes(self._second, 1, 2)
        if size == 12:
            relative[:, :, 3:6] = -memory.back @ np.swapaxes(self._first, 1, 2)
        units = np.broadcast_to(np.eye(3)[:, None], (3, e, 3))
        slopes = rotations.tangent_inverse_derivative(np.broadcast_to(memory.psi, (3, e, 3)), units)
        by_psi = np.einsum("iekl,ek->eli", slopes, self._axis)
        change = by_psi @ rotations.tangent_inverse(memory.psi) @ relative
        result = np.zeros((e, size, size))
        result[:, -3:] = self._second @ change
        if size == 12:
            turn = np.swapaxes(memory.back, 1, 2)
            result[:, 3:6] = -self._first @ turn @ (change - rotations.skews(memory.w) @ relative)
        return result


def _times(matrix: Array, vector: Array) -> Array:
    product: Array = (matrix @ vector[..., None])[..., 0]
    return product
