"""The conditions of all closing joints at a state of the chain: Φ(t, y) = 0, its derivatives, the forces it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.formulations.base import TreeFormulation
from erls.formulations.joint_frames import AXIS_TURNS, TURNS, Conditions, FrameMotion, Turn, joint_motion
from erls.lie.so3 import Array, cross
from erls.mechanism.loops import FREE, HELD, PARALLEL, Loop, LoopEnd, LoopType


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
    outer, inner : list of FrameMotion
        Frames of every loop.
    """

    violation: Array
    rate: Array
    bias: Array
    rows: Array
    gradients: list[Array]
    outer: list[FrameMotion]
    inner: list[FrameMotion]


@dataclass(frozen=True)
class LoopForce:
    """What a closing joint does to its outer link: force [N] and moment [N m] about the outer frame, and the place of
    that frame's origin [m]; world axes.
    """

    force: Array
    moment: Array
    place: Array


def conditions(kind: LoopType) -> Conditions:
    """Rows of a kind of closing joint."""
    rows: dict[tuple[str, int], Turn | None] = {("translation along", k): None for k in kind.sliding}
    if kind.turning == PARALLEL:
        rows.update({("rotation about", k): AXIS_TURNS[k] for k in range(2)})
    if kind.turning == HELD:
        rows.update({("rotation about", k): TURNS[k] for k in range(3)})
    return Conditions(rows)


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
        self._conditions = [conditions(loop.type) for loop in loops]
        pairs = [(k, name) for k, found in enumerate(self._conditions) for name in found.names]
        self.names = tuple(f"loop {loops[k].name!r}, {name}" for k, name in pairs)
        self.turns = np.array([name.startswith("rotation") for _, name in pairs])
        self.owner = np.array([k for k, _ in pairs])
        self.ends = np.cumsum([len(found.names) for found in self._conditions])
        self._ends = [end for loop in loops for end in (loop.outer, loop.inner) if end.link is not None]

    def closure(self, t: float, y: Array, v: Array) -> Closure:
        """Φ and its derivatives at a state of the chain."""
        moving = iter(self.tree.frames(t, y, v, self._ends))
        size = self.tree.joints + len(self.tree.free) - len(self.tree.free_joints)

        def frame(end: LoopEnd) -> FrameMotion:
            if end.link is not None:
                return next(moving)
            return FrameMotion(end.frame, np.zeros((6, size)), np.zeros(6), np.zeros(6))

        parts: list[tuple[Array, ...]] = []
        gradients: list[Array] = []
        outers: list[FrameMotion] = []
        inners: list[FrameMotion] = []
        for loop, rows in zip(self.loops, self._conditions, strict=True):
            outer, inner = frame(loop.outer), frame(loop.inner)
            found = joint_motion(inner, outer)
            gradient = rows.gradient(found.pose)
            relative = outer.rows - found.transform @ inner.rows
            bias = gradient @ found.bias + rows.curvature(found.pose, found.twist)
            parts.append((rows.violation(found.pose), gradient @ found.twist, bias, gradient @ relative))
            gradients.append(gradient)
            outers.append(outer)
            inners.append(inner)
        violation, rate, bias, every = (np.concatenate(part) for part in zip(*parts, strict=True))
        return Closure(violation, rate, bias, every, gradients, outers, inners)

    def forces(self, found: Closure, multipliers: Array) -> list[LoopForce]:
        """What multipliers λ (m,) do to the outer links: the equations of motion hold -Φ_yᵀ λ."""
        result: list[LoopForce] = []
        for gradient, outer, part in zip(
            found.gradients, found.outer, np.split(multipliers, self.ends[:-1]), strict=True
        ):
            wrench, turn = -gradient.T @ part, outer.pose[:3, :3]
            result.append(LoopForce(turn @ wrench[:3], turn @ wrench[3:], outer.pose[:3, 3]))
        return result

    def upside_down(self, found: Closure) -> list[str]:
        """Loops whose frames meet back to front, which their rows cannot tell from right."""
        result: list[str] = []
        for loop, outer, inner in zip(self.loops, found.outer, found.inner, strict=True):
            along = np.diag(inner.pose[:3, :3].T @ outer.pose[:3, :3])
            wrong = along[2] < 0 or (loop.type.turning == HELD and along[0] < 0)
            if loop.type.turning != FREE and wrong:
                result.append(loop.name)
        return result


def about(force: LoopForce, place: Array) -> tuple[Array, Array]:
    """Force and moment about another place (3,)."""
    return force.force, force.moment + cross(force.place - place, force.force)
