"""Joints as constraints on the pose of an outer frame relative to an inner one, D = (Q, p).

Every condition is linear in the entries of p and Q: c · p + ⟨C, Q⟩ = 0. With the relative twist η of the outer frame,
in its axes, ṗ = Q η_v and Q̇ = Q η̃_ω. Only relative motion enters, so that a rigid motion of both frames changes
nothing. Along a prescribed coordinate s(t) the inner frame runs ahead by exp(s ẑ) of the joint's z axis.

Conditions are written in the axes of the inner frame, in whose node their gradient does not change on the way. A joint
between the ground and a node is therefore taken from the node's side, with −s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.rotation_maps import skews
from erls.maths.so3 import Array
from erls.mechanism.joint_conditions import CONDITIONS, Condition

GROUND = -1
Motion = Callable[[float], tuple[float, float, float]]  # coordinate, rate, acceleration at a time

_DRIVEN = {"revolute": 5, "prismatic": 2}


@dataclass(frozen=True)
class Joint:
    """A joint between two nodes, or a node and the ground (`GROUND`).

    Attributes
    ----------
    name, type : str
        Type: a key of `CONDITIONS`.
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
        if self.type not in CONDITIONS:
            remedy = f"must be one of {', '.join(CONDITIONS)}"
            message = "there is no such joint"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: type", value=self.type, remedy=remedy)
        if self.motion is not None and self.type not in _DRIVEN:
            message, remedy = "its motion cannot be prescribed", "let the joint be revolute or prismatic"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: motion", value=self.type, remedy=remedy)
        if self.inner == self.outer:
            message, remedy = "both frames belong to one node", "name two nodes, or the ground as one of them"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{where}: outer", value=self.outer, remedy=remedy)

    @property
    def conditions(self) -> list[Condition]:
        """Conditions of the type; all of them when the last freedom is prescribed; those left out aside."""
        every = CONDITIONS["fixed" if self.motion else self.type]
        return [c for c in every if c[0] not in self.left_out]


@dataclass(frozen=True)
class Relative:
    """Relative motion of j joints, which all conditions start from.

    Attributes
    ----------
    pose : (j, 4, 4) array
        D.
    inner, back : (j, 6, 6) array
        Transform of the inner node's twist to the inner frame, and from there to the outer frame.
    drive, drive_rate : (j, 6) array
        Twist of the inner frame by a prescribed motion, and its rate.
    by_twist : (m, 6) array
        Derivative of each condition along the relative twist η.
    gradient : (m, 12) array
        Derivative by the twists of the inner and the outer node.
    """

    pose: Array
    inner: Array
    back: Array
    drive: Array
    drive_rate: Array
    by_twist: Array
    gradient: Array


class JointRows:
    """All joints of a system, condition by condition."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.joints = tuple(joints)
        sides = [((j.inner, j.inner_frame), (j.outer, j.outer_frame))[:: self.sign(j)] for j in joints]
        self.nodes: IntArray = np.array([[i, o] for (i, _), (o, _) in sides], dtype=np.int64).reshape(-1, 2)
        self._inner = np.array([frame for (_, frame), _ in sides]).reshape(-1, 4, 4)
        self._outer = np.array([frame for _, (_, frame) in sides]).reshape(-1, 4, 4)
        self._of_inner = motions.adjoint_inverse(self._inner)
        self._of_outer = motions.adjoint_inverse(self._outer)
        found = [(k, *condition) for k, joint in enumerate(joints) for condition in joint.conditions]
        self.joint_of_row: IntArray = np.array([k for k, *_ in found], dtype=np.int64)
        self.names = tuple(f"joint {joints[k].name!r}: {name}" for k, name, _, _ in found)
        self.c = np.array([c for _, _, c, _ in found]).reshape(-1, 3)
        self.entries = np.array([e for _, _, _, e in found]).reshape(-1, 3, 3)
        turned = [j.type == "universal" and self.sign(j) < 0 for j in joints]  # its two axes differ
        for row, k in enumerate(self.joint_of_row):
            if turned[k]:
                self.entries[row] = self.entries[row].T.copy()
        self._driven = [k for k, joint in enumerate(joints) if joint.motion is not None]

    @staticmethod
    def sign(joint: Joint) -> int:
        """-1 where the ground, as the inner frame, changes places with the outer one."""
        return -1 if joint.inner == GROUND else 1

    @staticmethod
    def driven_along(joint: Joint) -> int:
        """Row of the relative twist that is prescribed, or -1."""
        return -1 if joint.motion is None else _DRIVEN[joint.type]

    @property
    def frames(self) -> tuple[Array, Array]:
        """(j, 4, 4) twice: poses of the inner and outer frames in their nodes, or in the world for the ground."""
        return self._inner, self._outer

    def relative(self, t: float, inner: Array, outer: Array) -> Relative:
        """At node poses (j, 4, 4)."""
        transform, frame = self._of_inner, self._inner
        drive, rate = np.zeros((2, len(self.joints), 6))
        if self._driven:
            ahead = np.zeros((len(self.joints), 6))
            for k in self._driven:
                motion, at = self.joints[k].motion, _DRIVEN[self.joints[k].type]
                if motion is not None:
                    coordinate = self.sign(self.joints[k]) * np.array(motion(t))
                    ahead[k, at], drive[k, at], rate[k, at] = coordinate
            moved = motions.exp(ahead)
            transform, frame = motions.adjoint_inverse(moved) @ transform, frame @ moved
        pose = motions.inverse(inner @ frame) @ outer @ self._outer
        back, of_row = motions.adjoint_inverse(pose), self.joint_of_row
        turn = np.swapaxes(pose[of_row, :3, :3], 1, 2)
        by_twist = np.empty((len(self.names), 6))
        by_twist[:, :3] = (turn @ self.c[:, :, None])[:, :, 0]
        by_twist[:, 3:] = _axial(turn @ self.entries)
        gradient = np.empty((len(self.names), 12))
        gradient[:, :6] = -(by_twist[:, None, :] @ (back @ transform)[of_row])[:, 0]
        gradient[:, 6:] = (by_twist[:, None, :] @ self._of_outer[of_row])[:, 0]
        return Relative(pose, transform, back, drive, rate, by_twist, gradient)

    def violation(self, relative: Relative) -> Array:
        """(m,) Φ."""
        d = relative.pose[self.joint_of_row]
        shift = (self.c * d[:, :3, 3]).sum(axis=1)
        result: Array = shift + (self.entries * d[:, :3, :3]).sum(axis=(1, 2))
        return result

    def rate(self, relative: Relative) -> Array:
        """(m,) Φ_t."""
        drift = -(relative.back @ relative.drive[:, :, None])[:, :, 0]
        result: Array = (relative.by_twist * drift[self.joint_of_row]).sum(axis=1)
        return result

    def bias(self, relative: Relative, v: Array) -> Array:
        """(m,) Φ̈ − B a at twists (j, 12) of both nodes."""
        back = relative.back
        carried = (relative.inner @ v[:, :6, None])[:, :, 0]
        inner = carried + relative.drive
        outer = (self._of_outer @ v[:, 6:, None])[:, :, 0]
        twist = outer - (back @ inner[:, :, None])[:, :, 0]
        change = relative.drive_rate - (motions.bracket(relative.drive) @ carried[:, :, None])[:, :, 0]
        bend = motions.bracket(twist) @ back @ inner[:, :, None] - back @ change[:, :, None]
        k = self.joint_of_row
        turning = skews(twist[k, 3:])
        turn = relative.pose[k, :3, :3]
        swing = (turn @ turning @ twist[k, :3, None])[:, :, 0]
        curve = (self.c * swing).sum(axis=1) + (self.entries * (turn @ turning @ turning)).sum(axis=(1, 2))
        result: Array = curve + (relative.by_twist * bend[k, :, 0]).sum(axis=1)
        return result

    def stiffness(self, relative: Relative, multipliers: Array) -> Array:
        """(j, 12, 12) derivative of Bᵀλ by increments of the inner and the outer node."""
        j = len(self.joints)
        pull, entries = np.zeros((j, 3)), np.zeros((j, 3, 3))
        np.add.at(pull, self.joint_of_row, multipliers[:, None] * self.c)
        np.add.at(entries, self.joint_of_row, multipliers[:, None, None] * self.entries)
        turn = np.swapaxes(relative.pose[:, :3, :3], 1, 2)
        force = (turn @ pull[:, :, None])[:, :, 0]
        spread = turn @ entries
        wrench = np.concatenate([force, _axial(spread)], axis=1)
        of_twist = np.zeros((j, 6, 6))
        of_twist[:, :3, 3:] = skews(force)
        of_twist[:, 3:, 3:] = spread - np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        of_inner = -relative.back @ relative.inner
        twist = np.concatenate([of_inner, self._of_outer], axis=2)  # η from both nodes (j, 6, 12)
        result: Array = np.swapaxes(twist, 1, 2) @ of_twist @ twist
        # the inner node's share of the wrench turns with the relative pose
        result[:, :6] -= np.swapaxes(of_inner, 1, 2) @ motions.cobracket(wrench) @ twist
        return result


def _axial(matrices: Array) -> Array:
    """(..., 3) z with z · ω = ⟨N, ω̃⟩."""
    rows = [matrices[..., 2, 1] - matrices[..., 1, 2], matrices[..., 0, 2] - matrices[..., 2, 0]]
    return np.stack([*rows, matrices[..., 1, 0] - matrices[..., 0, 1]], axis=-1)
