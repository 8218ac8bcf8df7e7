"""Joints between nodes, or a node and the ground, and their conditions as arrays.

Conditions are written in the axes of the inner frame, in whose node their gradient does not change on the way. A joint
between the ground and a node is therefore taken from the node's side, with −s of a prescribed coordinate. Their
violations, forces and derivatives are in `erls.equations.nodal.joint_forces`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.joint_types import JOINT_TYPES, Condition

GROUND = -1
Motion = Callable[[float], tuple[float, float, float]]  # coordinate, rate, acceleration at a time


@dataclass(frozen=True)
class Joint:
    """A joint between two nodes, or a node and the ground (`GROUND`).

    Attributes
    ----------
    name, type : str
        Type: a key of `JOINT_TYPES`.
    inner, outer : int
        Nodes.
    inner_frame, outer_frame : (4, 4) array
        Pose of the joint in the frame of each node, in the world for the ground.
    motion : callable or None
        Prescribed coordinate of a revolute or prismatic joint.
    breakpoints : tuple
        Times at which its acceleration jumps.
    left_out : frozenset of str
        Names of conditions that other joints see to (`erls.equations.nodal.redundant`).

    Raises
    ------
    SceneError
        With cause BAD_FIELD.
    """

    name: str
    type: str
    inner: int
    outer: int
    inner_frame: Array = field(default_factory=lambda: np.eye(4))
    outer_frame: Array = field(default_factory=lambda: np.eye(4))
    motion: Motion | None = None
    breakpoints: tuple[float, ...] = ()
    left_out: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        where = f"joint {self.name!r}"
        if self.type not in JOINT_TYPES:
            remedy = f"must be one of {', '.join(JOINT_TYPES)}"
            message = "there is no such joint"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: type", value=self.type, remedy=remedy)
        if self.motion is not None and JOINT_TYPES[self.type].one is None:
            message, remedy = "its motion cannot be prescribed", "let the joint be revolute or prismatic"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: motion", value=self.type, remedy=remedy)
        if self.inner == self.outer:
            message, remedy = "both frames belong to one node", "name two nodes, or the ground as one of them"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: outer", value=self.outer, remedy=remedy)

    @property
    def conditions(self) -> list[Condition]:
        """Conditions of the type; all of them when the last freedom is prescribed; those left out aside."""
        every = JOINT_TYPES["fixed" if self.motion else self.type].conditions
        return [c for c in every if c.name not in self.left_out]


class JointRows:
    """All joints of a system as arrays, condition by condition, for `erls.equations.nodal.joint_forces`.

    Attributes
    ----------
    joints : tuple of Joint
    nodes : (j, 2) array
        Inner and outer nodes, −1 for the ground.
    inner, outer : (j, 4, 4) arrays
        Frames in their nodes, or in the world for the ground.
    joint_of_row, names : arrays (m,)
    c, entries : (m, 3), (m, 3, 3) arrays
        Conditions.
    """

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.joints = tuple(joints)
        sides = [((j.inner, j.inner_frame), (j.outer, j.outer_frame))[:: self.sign(j)] for j in joints]
        self.nodes: IntArray = np.array([[i, o] for (i, _), (o, _) in sides], dtype=np.int64).reshape(-1, 2)
        self.inner = np.array([frame for (_, frame), _ in sides]).reshape(-1, 4, 4)
        self.outer = np.array([frame for _, (_, frame) in sides]).reshape(-1, 4, 4)
        found = [(k, *condition) for k, joint in enumerate(joints) for condition in joint.conditions]
        self.joint_of_row: IntArray = np.array([k for k, *_ in found], dtype=np.int64)
        self.names = tuple(f"joint {joints[k].name!r}: {name}" for k, name, _, _ in found)
        self.c = np.array([c for _, _, c, _ in found]).reshape(-1, 3)
        self.entries = np.array([e for _, _, _, e in found]).reshape(-1, 3, 3)
        turned = [j.type == "universal" and self.sign(j) < 0 for j in joints]  # its two axes differ
        for row, k in enumerate(self.joint_of_row):
            if turned[k]:
                self.entries[row] = self.entries[row].T.copy()

    @staticmethod
    def sign(joint: Joint) -> int:
        """-1 where the ground, as the inner frame, changes places with the outer one."""
        return -1 if joint.inner == GROUND and JOINT_TYPES[joint.type].mutual else 1

    @staticmethod
    def driven_along(joint: Joint) -> int:
        """Row of the relative twist that is prescribed, or -1."""
        freedom = JOINT_TYPES[joint.type].one
        return -1 if joint.motion is None or freedom is None else freedom.row
