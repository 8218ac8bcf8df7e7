"""The conditions of all closing joints at a state of the chain: Φ(t, y) = 0, its derivatives, the forces it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.formulation import LoopForce, TreeFormulation
from erls.equations.serial.joint_frames import (
    Conditions,
    FrameMotion,
    JointMotion,
    joint_motion,
    less_motion,
)
from erls.maths.so3 import Array, cross
from erls.mechanism.joint_types import JOINT_TYPES
from erls.mechanism.loops import Loop, LoopEnd


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
    outer : list of FrameMotion
        Outer frame of every loop.
    relative : list of JointMotion
        Motion of it in the inner frame.
    moves : list of (6, joints + elastic) arrays
        Twist of that motion over the rates of (θ, elastic), in the axes of the outer frame.
    left : list of (4, 4) arrays
        Pose that the conditions measure: the relative one, less a prescribed motion.
    """

    violation: Array
    rate: Array
    bias: Array
    rows: Array
    gradients: list[Array]
    outer: list[FrameMotion]
    relative: list[JointMotion]
    moves: list[Array]
    left: list[Array]


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
    """

    def __init__(self, tree: TreeFormulation, loops: Sequence[Loop]) -> None:
        self.tree, self.loops = tree, tuple(loops)
        self.kinds = [JOINT_TYPES["fixed"] if loop.prescribed else loop.type for loop in loops]  # nothing else moves
        self._conditions = [Conditions(kind) for kind in self.kinds]
        pairs = [(k, name) for k, found in enumerate(self._conditions) for name in found.names]
        self.names = tuple(f"loop {loops[k].name!r}, {name}" for k, name in pairs)
        self.turns = np.array([not line.any() for found in self._conditions for line in found.lines], dtype=bool)
        self.owner = np.array([k for k, _ in pairs])
        self.ends = np.cumsum([len(found.names) for found in self._conditions])
        self._ends = [end for loop in loops for end in (loop.outer, loop.inner) if end.link is not None]
        self._known: tuple[float, Array, Array, Closure] | None = None

    def closure(self, t: float, y: Array, v: Array) -> Closure:
        """Φ and its derivatives at a state of the chain; the last one is remembered, since integrators ask in several
        ways.
        """
        known = self._known
        if known is None or known[0] != t or not (np.array_equal(known[1], y) and np.array_equal(known[2], v)):
            known = self._known = (t, y.copy(), v.copy(), self._closure(t, y, v))
        return known[3]

    def _closure(self, t: float, y: Array, v: Array) -> Closure:
        moving = iter(self.tree.frames(t, y, v, self._ends))
        size = self.tree.joints + len(self.tree.free) - len(self.tree.free_joints)

        def frame(end: LoopEnd) -> FrameMotion:
            if end.link is not None:
                return next(moving)
            return FrameMotion(end.frame, np.zeros((6, size)), np.zeros(6), np.zeros(6))

        parts: list[tuple[Array, ...]] = []
        gradients: list[Array] = []
        outers: list[FrameMotion] = []
        motions: list[JointMotion] = []
        moves: list[Array] = []
        poses: list[Array] = []
        for loop, rows in zip(self.loops, self._conditions, strict=True):
            outer, inner = frame(loop.outer), frame(loop.inner)
            found = joint_motion(inner, outer)
            left = found if not loop.prescribed else _less_prescribed(loop, found, t)
            gradient = rows.gradient(left.pose)
            relative = outer.rows - found.transform @ inner.rows
            bias = gradient @ left.bias + rows.curvature(left.pose, left.twist)
            parts.append((rows.violation(left.pose), gradient @ left.twist, bias, gradient @ relative))
            gradients.append(gradient)
            outers.append(outer)
            motions.append(found)
            moves.append(relative)
            poses.append(left.pose)
        violation, rate, bias, every = (np.concatenate(part) for part in zip(*parts, strict=True))
        return Closure(violation, rate, bias, every, gradients, outers, motions, moves, poses)

    def wrenches(self, found: Closure, multipliers: Array) -> list[Array]:
        """(6,) what multipliers λ (m,) do to the outer links, in the axes of the outer frames: -Φ_yᵀ λ in all."""
        parts = np.split(multipliers, self.ends[:-1])
        return [-gradient.T @ part for gradient, part in zip(found.gradients, parts, strict=True)]

    def upside_down(self, found: Closure) -> list[str]:
        """Loops whose frames meet back to front, which their rows cannot tell from right."""
        result: list[str] = []
        for loop, kind, left in zip(self.loops, self.kinds, found.left, strict=True):
            if any(left[axis, axis] < 0 for axis in kind.aligned):
                result.append(loop.name)
        return result


def _less_prescribed(loop: Loop, found: JointMotion, t: float) -> JointMotion:
    """The motion beside the prescribed one."""
    assert loop.freedom is not None
    value, rate, acceleration = loop.freedom.drive.reference(t)  # type: ignore[misc]
    return less_motion(loop.freedom.freedom, found, (value - loop.freedom.zero, rate, acceleration))[0]


def applied(outer: FrameMotion, wrench: Array) -> LoopForce:
    """A wrench (6,) in the axes of an outer frame as a force in the world."""
    turn = outer.pose[:3, :3]
    return LoopForce(turn @ wrench[:3], turn @ wrench[3:], outer.pose[:3, 3])


def about(force: LoopForce, place: Array) -> tuple[Array, Array]:
    """Force and moment about another place (3,)."""
    return force.force, force.moment + cross(force.place - place, force.force)
