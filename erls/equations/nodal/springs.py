"""Springs and dampers along the line between two points, fixed to nodes or to the ground.

With the points' distance l and the direction n from the first to the second, the tension is N = k (l − l₀) + c l̇, and
l̇ = J ν with J = [−n at the first point, n at the second], each as a wrench of its node.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.maths.rotation_maps import skews
from erls.maths.so3 import Array


@dataclass(frozen=True)
class Spring:
    """A spring with a damper.

    Attributes
    ----------
    nodes : tuple of int
        The second node alone when the first point is fixed to the ground; first and second otherwise.
    first, second : (3,) array
        The points in the frames of their nodes, in the world for the ground [m].
    stiffness, damping : float
        [N/m], [N s/m]
    length : float
        Without force [m].
    """

    nodes: tuple[int, ...]
    first: Array
    second: Array
    stiffness: float
    damping: float
    length: float


@dataclass(frozen=True)
class Stretched:
    """Lengths (e,), J (e, 6k) of their rates, and of each point its arm and n (e, 3) in its node's axes."""

    lengths: Array
    rows: Array
    sides: tuple[tuple[Array, Array], ...]


class Springs:
    """Springs with one number of nodes, as `erls.equations.nodal.elements.Elements`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, springs: Sequence[Spring]) -> None:
        self.nodes: IntArray = np.array([s.nodes for s in springs], dtype=np.int64)
        self._arms = np.array([[s.first, s.second] for s in springs], dtype=float)
        self._stiffness, self._damping, self._rest = np.array([[s.stiffness, s.damping, s.length] for s in springs]).T

    def remember(self, poses: Array, before: Stretched | None) -> Stretched:
        """Lengths and directions."""
        count = self.nodes.shape[1]
        arms = [self._arms[:, k - count] for k in range(count)]
        ends = [(poses[:, k, :3, :3] @ arms[k][:, :, None])[:, :, 0] + poses[:, k, :3, 3] for k in range(count)]
        apart = ends[-1] - (ends[0] if count == 2 else self._arms[:, 0])
        lengths = np.linalg.norm(apart, axis=1)
        along = apart / np.maximum(lengths, 1e-300)[:, None]
        sides, rows = [], []
        for k in range(count):
            local = (np.swapaxes(poses[:, k, :3, :3], 1, 2) @ along[:, :, None])[:, :, 0]
            sides.append((arms[k], local))
            sign = 1.0 if k == count - 1 else -1.0
            rows.append(sign * np.concatenate([local, np.cross(arms[k], local)], axis=1))
        return Stretched(lengths, np.concatenate(rows, axis=1), tuple(sides))

    def mass(self, poses: Array, memory: Stretched) -> Array:
        """None."""
        return np.zeros((len(self.nodes), 6 * self.nodes.shape[1], 6 * self.nodes.shape[1]))

    def tensions(self, memory: Stretched, v: Array) -> Array:
        """(e,) [N]"""
        rates = (memory.rows * v).sum(axis=1)
        result: Array = self._stiffness * (memory.lengths - self._rest) + self._damping * rates
        return result

    def forces(self, t: float, poses: Array, memory: Stretched, v: Array, a: Array) -> Array:
        """(e, 6k)"""
        result: Array = self.tensions(memory, v)[:, None] * memory.rows
        return result

    def derivatives(
        self, t: float, poses: Array, memory: Stretched, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(e, 6k, 6k) twice; how rates change with the direction is left out."""
        outer = memory.rows[:, :, None] * memory.rows[:, None, :]
        stiffness, damping = self._stiffness[:, None, None] * outer, self._damping[:, None, None] * outer
        if not material:
            stiffness += self.tensions(memory, v)[:, None, None] * self._turning(poses, memory)
        return stiffness, damping

    def energy(self, t: float, poses: Array, memory: Stretched, v: Array) -> tuple[float, float]:
        """None, and that of the springs."""
        return 0.0, float(self._stiffness @ (memory.lengths - self._rest) ** 2) / 2

    def _turning(self, poses: Array, memory: Stretched) -> Array:
        """(e, 6k, 6k) derivative of J by increments of the nodes."""
        count, size = self.nodes.shape[1], 6 * self.nodes.shape[1]
        spread = np.zeros((len(self.nodes), 3, size))  # of the distance, in the world's axes
        for k, (arm, _) in enumerate(memory.sides):
            sign, turn = (1.0 if k == count - 1 else -1.0), poses[:, k, :3, :3]
            spread[:, :, 6 * k : 6 * k + 3], spread[:, :, 6 * k + 3 : 6 * k + 6] = (
                sign * turn,
                -sign * turn @ skews(arm),
            )
        result = np.zeros((len(self.nodes), size, size))
        for k, (arm, local) in enumerate(memory.sides):
            sign, back = (1.0 if k == count - 1 else -1.0), np.swapaxes(poses[:, k, :3, :3], 1, 2)
            along = (poses[:, k, :3, :3] @ local[:, :, None])[:, :, 0]
            across = np.eye(3) - along[:, :, None] * along[:, None, :]
            change = back @ across @ spread / np.maximum(memory.lengths, 1e-300)[:, None, None]
            change[:, :, 6 * k + 3 : 6 * k + 6] += skews(local)
            result[:, 6 * k : 6 * k + 3] = sign * change
            result[:, 6 * k + 3 : 6 * k + 6] = sign * skews(arm) @ change
        return result
