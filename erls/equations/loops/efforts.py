"""Forces along the coordinates of closing joints: drives, springs, dampers, friction and rotors.

They belong to the equations of the chain, on whose coordinates they act through the relative twist of the joint's
frames; `ActuatedTree` is the chain with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la

from erls.equations.formulation import Energy, Reaction, State, TreeFormulation
from erls.equations.loops.rows import Closure, LoopRows
from erls.equations.serial.joint_frames import FrameMotion
from erls.maths.so3 import Array
from erls.mechanism.loop_turns import turning_signs
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom


@dataclass(frozen=True)
class Effort:
    """What acts along the coordinate of a closing joint.

    Attributes
    ----------
    number : int
        Of the loop.
    coordinate, rate : float
        [rad, rad/s or m, m/s]
    force : float
        Of drive, spring, damper and friction; a prescribed motion's own left out [N m or N].
    wanted : float
        What the drive asks of its motor [N m or N].
    row : (joints + elastic,) array
        The rate over the rates of (θ, elastic).
    bias : float
        Second derivative of the coordinate at zero accelerations.
    """

    number: int
    coordinate: float
    rate: float
    force: float
    wanted: float
    row: Array
    bias: float


class LoopEfforts:
    """Coordinates of closing joints and the forces along them.

    Parameters
    ----------
    tree : TreeFormulation
    rows : LoopRows
    """

    def __init__(self, tree: TreeFormulation, rows: LoopRows) -> None:
        self.tree, self.rows = tree, rows
        self.loops = rows.loops
        self.signs = [turning_signs(tree.mechanism, loop)[0] for loop in self.loops]
        self.start = np.array([joint.position for joint in tree.mechanism.joints])

    @property
    def any(self) -> bool:
        """Whether any force that is no reaction, or rotor, acts."""
        return any(loop.freedom is not None and loop.freedom.active for loop in self.loops)

    def at(self, t: float, y: Array, found: Closure) -> list[Effort]:
        """Of every loop with one coordinate."""
        result: list[Effort] = []
        for k, loop in enumerate(self.loops):
            if (free := loop.freedom) is None:
                continue
            along, motion = free.freedom.row, found.relative[k]
            value, rate = self._coordinate(k, free, motion.pose, t, y), float(motion.twist[along])
            wanted = free.drive.torque(t, value, rate)
            force = free.drive.limited(wanted) + free.forces.force(value, rate)
            result.append(Effort(k, value, rate, force, wanted, found.moves[k][along], float(motion.bias[along])))
        return result

    def _coordinate(self, k: int, free: LoopFreedom, relative: Array, t: float, y: Array) -> float:
        """Coordinate of a loop, on the turn that the joints between its links say."""
        if not free.freedom.turns:
            return free.zero + float(relative[2, 3])
        angle = float(np.arctan2(relative[1, 0] - relative[0, 1], relative[0, 0] + relative[1, 1]))
        turned = float(self.signs[k] @ (self._joints(t, y) - self.start))
        return free.zero + angle + 2 * np.pi * round((turned - angle) / (2 * np.pi))

    def _joints(self, t: float, y: Array) -> Array:
        """(joints,) coordinates of the chain."""
        result = np.empty(self.tree.joints)
        result[self.tree.free_joints] = y[: len(self.tree.free_joints)]
        for k in np.setdiff1d(np.arange(self.tree.joints), self.tree.free_joints):
            result[k] = self.tree.mechanism.joints[k].drive.reference(t)[0]
        return result

    def rotor(self, effort: Effort) -> float:
        """Reflected inertia on the coordinate."""
        return self._freedom(effort.number).rotor_inertia

    def gains(self, effort: Effort) -> tuple[float, float]:
        """Minus the derivatives of the force by coordinate and rate."""
        free = self._freedom(effort.number)
        passive, active = free.forces.gains(effort.rate), free.drive.gains_at(effort.wanted)
        return passive[0] + active[0], passive[1] + active[1]

    def along(self, number: int) -> int:
        """Component of a twist in the outer frame that the coordinate of a loop moves."""
        return self._freedom(number).freedom.row

    def stored(self, effort: Effort) -> float:
        """Energy of the spring [J]."""
        forces = self._freedom(effort.number).forces
        return 0.5 * forces.stiffness * (effort.coordinate - forces.rest) ** 2

    def _freedom(self, number: int) -> LoopFreedom:
        loop: Loop = self.loops[number]
        assert loop.freedom is not None
        return loop.freedom


class ActuatedTree:
    """A chain with forces along the coordinates of the joints that close it; a `TreeFormulation`.

    Reactions in its joints are those of the chain alone: who adds the forces of the loops adds these as well.

    Parameters
    ----------
    tree : TreeFormulation
    efforts : LoopEfforts
    """

    def __init__(self, tree: TreeFormulation, efforts: LoopEfforts) -> None:
        self.bare, self.efforts = tree, efforts
        self.mechanism, self.joints = tree.mechanism, tree.joints
        self.free, self.free_joints = tree.free, tree.free_joints

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.bare.size

    @property
    def length_scales(self) -> Array:
        """(n,) those of the chain."""
        return self.bare.length_scales

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of the drives of the chain."""
        return self.bare.breakpoints

    @property
    def compiled(self) -> None:
        """None: that of the chain knows nothing of these forces."""
        return None

    def _acting(self, t: float, y: Array, v: Array) -> list[Effort]:
        found = self.efforts.at(t, y, self.efforts.rows.closure(t, y, v))
        return [replace(effort, row=effort.row[self.free]) for effort in found]

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f."""
        result = self.bare.residual(t, y, v, a).copy()
        for effort in self._acting(t, y, v):
            turning = self.efforts.rotor(effort) * (effort.row @ a + effort.bias)
            result += effort.row * (turning - effort.force)
        return result

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) with the rotors."""
        result = self.bare.mass_matrix(t, y).copy()
        for effort in self._acting(t, y, np.zeros(self.size)):
            result += self.efforts.rotor(effort) * np.outer(effort.row, effort.row)
        return result

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) with the loops open."""
        try:
            factor = la.cho_factor(self.mass_matrix(t, y), check_finite=False)
        except la.LinAlgError:
            return self.bare.acceleration(t, y, v)  # which names the coordinate
        return np.asarray(la.cho_solve(factor, -self.residual(t, y, v, np.zeros(self.size)), check_finite=False))

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """Those of the chain with springs, dampers, friction and controllers."""
        stiffness, damping = (matrix.copy() for matrix in self.bare.stiffness_and_damping(t, y, v))
        for effort in self._acting(t, y, v):
            k, c = self.efforts.gains(effort)
            stiffness += k * np.outer(effort.row, effort.row)
            damping += c * np.outer(effort.row, effort.row)
        return stiffness, damping

    def initial_state(self) -> tuple[Array, Array]:
        """That of the chain."""
        return self.bare.initial_state()

    def state(self, t: float, y: Array, v: Array) -> State:
        """That of the chain."""
        return self.bare.state(t, y, v)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """With springs and rotors."""
        result = self.bare.energy(t, y, v)
        for effort in self._acting(t, y, v):
            turning = 0.5 * self.efforts.rotor(effort) * effort.rate**2
            result = replace(
                result, kinetic=result.kinetic + turning, springs=result.springs + self.efforts.stored(effort)
            )
        return result

    def frames(self, t: float, y: Array, v: Array, ends: Sequence[LoopEnd]) -> list[FrameMotion]:
        """Those of the chain."""
        return self.bare.frames(t, y, v, ends)

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """In the joints of the chain, with the loops open."""
        return self.reactions_at(t, y, v, self.acceleration(t, y, v))

    def reactions_at(self, t: float, y: Array, v: Array, a: Array) -> list[Reaction]:
        """Those of the chain."""
        return self.bare.reactions_at(t, y, v, a)

    def describe(self) -> dict[str, Any]:
        """Names and sizes."""
        return self.bare.describe()
