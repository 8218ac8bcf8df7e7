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
from erls.mechanism.joint_types import DRIVEN_TYPES, JOINT_TYPES, Condition, JointType, Z

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
        Prescribed coordinate of a joint that has one, turn of a planar one.
    breakpoints : tuple
        Times at which its acceleration jumps.
    left_out : frozenset of str
        Names of conditions that other joints see to (`erls.equations.nodal.redundant`).
    pitch : float
        Of a screw [m/rad].

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
    pitch: float = 0.0

    def __post_init__(self) -> None:
        where = f"joint {self.name!r}"
        if self.type not in JOINT_TYPES:
            remedy = f"must be one of {', '.join(JOINT_TYPES)}"
            message = "there is no such joint"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: type", value=self.type, remedy=remedy)
        if self.motion is not None and JOINT_TYPES[self.type].driven is None:
            message, remedy = "its motion cannot be prescribed", f"let the joint be one of {', '.join(DRIVEN_TYPES)}"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: motion", value=self.type, remedy=remedy)
        if self.inner == self.outer:
            message, remedy = "both frames belong to one node", "name two nodes, or the ground as one of them"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: outer", value=self.outer, remedy=remedy)

    @property
    def kind(self) -> JointType:
        """Its type with its own fields."""
        return JOINT_TYPES[self.type].given(self)

    @property
    def conditions(self) -> list[Condition]:
        """Conditions of the type; of the driven one where a motion is prescribed; those left out aside."""
        every = self.kind.driven_conditions if self.motion else self.kind.conditions
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
    c, entries, pitches : (m, 3), (m, 3, 3), (m,) arrays
        Conditions.
    drives : (j, 2) array
        Slide along z and turn about it of the inner frame per unit of a prescribed coordinate; 0 unless prescribed.
    """

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.joints = tuple(joints)
        sides = [((j.inner, j.inner_frame), (j.outer, j.outer_frame))[:: self.sign(j)] for j in joints]
        self.nodes: IntArray = np.array([[i, o] for (i, _), (o, _) in sides], dtype=np.int64).reshape(-1, 2)
        self.inner = np.array([frame for (_, frame), _ in sides]).reshape(-1, 4, 4)
        self.outer = np.array([frame for _, (_, frame) in sides]).reshape(-1, 4, 4)
        self.drives = np.array([self._drive(j) for j in joints]).reshape(-1, 2)
        found = [(k, condition) for k, joint in enumerate(joints) for condition in joint.conditions]
        self.joint_of_row: IntArray = np.array([k for k, _ in found], dtype=np.int64)
        self.names = tuple(f"joint {joints[k].name!r}: {row.name}" for k, row in found)
        self.c = np.array([row.line for _, row in found]).reshape(-1, 3)
        self.entries = np.array([row.entries for _, row in found]).reshape(-1, 3, 3)
        self.pitches = np.array([row.pitch for _, row in found])
        turned = [j.type == "universal" and self.sign(j) < 0 for j in joints]  # its two axes differ
        for row, k in enumerate(self.joint_of_row):
            if turned[k]:
                self.entries[row] = self.entries[row].T.copy()

    @staticmethod
    def sign(joint: Joint) -> int:
        """-1 where the ground, as the inner frame, changes places with the outer one."""
        return -1 if joint.inner == GROUND and joint.kind.mutual else 1

    def _drive(self, joint: Joint) -> Array:
        freedom = joint.kind.driven
        if joint.motion is None or freedom is None:
            return np.zeros(2)
        return np.asarray(self.sign(joint) * freedom.screw[[Z, 3 + Z]])
