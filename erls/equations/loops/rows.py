"""The conditions of all closing joints: their rows as data, what is found at a state, the forces that they take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.formulation import LoopForce
from erls.maths.so3 import Array
from erls.mechanism.joint_types import JOINT_TYPES, Condition
from erls.mechanism.loops import Loop


@dataclass(frozen=True)
class Effort:
    """What acts along the coordinate of a closing joint.

    Attributes
    ----------
    coordinate, rate : float
        [rad, rad/s or m, m/s]
    turning : float
        Second derivative of the coordinate at zero accelerations.
    force : float
        Of drive, spring, damper and friction; a prescribed motion's own left out [N m or N].
    """

    coordinate: float
    rate: float
    turning: float
    force: float


@dataclass(frozen=True)
class Closure:
    """How well the loops are closed.

    Attributes
    ----------
    violation, rate, bias : (m,) arrays
        Φ [m, rad], Φ̇, and Φ̈ at zero accelerations.
    rows : (m, joints + elastic) array
        Φ̇ over the rates of (θ, elastic), those of prescribed joints included.
    gradients : list of (m_k, 6) arrays
        Of every loop's Φ over the twist of its outer frame, in that frame's axes.
    outer : list of (4, 4) arrays
        Pose of the outer frame of every loop.
    moves : list of (6, joints + elastic) arrays
        Twist of it in the inner frame over the rates of (θ, elastic), in its own axes.
    left : list of (3, 3) arrays
        Turn that the conditions measure: that of the outer frame in the inner one, less a prescribed motion.
    efforts : list of Effort
        Zeros for joints with more than one coordinate, or none.
    """

    violation: Array
    rate: Array
    bias: Array
    rows: Array
    gradients: list[Array]
    outer: list[Array]
    moves: list[Array]
    left: list[Array]
    efforts: list[Effort]


class LoopRows:
    """The rows of all loops, one after another.

    Attributes
    ----------
    names : tuple of str
        Loop and direction of each row.
    turns : (m,) bool array
        Which rows are angles.
    owner : (m,) int array
        Loop of each row.
    conditions : list of tuples of Condition
        Of each loop.
    """

    def __init__(self, loops: Sequence[Loop]) -> None:
        self.loops = tuple(loops)
        self.conditions: list[tuple[Condition, ...]] = [
            loop.type.driven_conditions if loop.prescribed else loop.type.conditions for loop in loops
        ]
        kinds = [JOINT_TYPES["fixed"] if loop.prescribed else loop.type for loop in loops]  # no turn is left
        self._aligned = [kind.aligned for kind in kinds]
        pairs = [(k, row) for k, found in enumerate(self.conditions) for row in found]
        self.names = tuple(f"{loops[k].kind} {loops[k].name!r}, {row.name}" for k, row in pairs)
        tied = [None if loop.coupling is None else loop.coupling.turns for loop in loops]
        angles = [not row.line.any() if tied[k] is None else tied[k] for k, row in pairs]
        self.turns = np.array(angles, dtype=bool)
        self.owner = np.array([k for k, _ in pairs], dtype=np.int64)
        self._ends = np.cumsum([len(found) for found in self.conditions])

    def wrenches(self, found: Closure, multipliers: Array) -> list[Array]:
        """(6,) what multipliers λ (m,) do to the outer links, in the axes of the outer frames: -Φ_yᵀ λ in all."""
        parts = np.split(multipliers, self._ends[:-1])
        return [-gradient.T @ part for gradient, part in zip(found.gradients, parts, strict=True)]

    def upside_down(self, found: Closure) -> list[str]:
        """Loops whose frames meet back to front, which their rows cannot tell from right."""
        result: list[str] = []
        for loop, aligned, left in zip(self.loops, self._aligned, found.left, strict=True):
            if any(left[axis, axis] < 0 for axis in aligned):
                result.append(loop.name)
        return result


def applied(outer: Array, wrench: Array) -> LoopForce:
    """A wrench (6,) in the axes of an outer frame, at its pose (4, 4), as a force in the world."""
    return LoopForce(outer[:3, :3] @ wrench[:3], outer[:3, :3] @ wrench[3:], outer[:3, 3])
