"""Forces along the free axis of joints: drives, springs, dampers, friction, rotors; and the joint angles themselves.

With the pose D of a joint's outer frame relative to its inner one, and the relative twist η in the outer frame's axes,
the rate of the joint coordinate is η's entry about or along z, a row over the twists of both nodes. Forces act along
that row. It does not change along the joint's own motion; with other motions it does, which the joint forbids.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.mechanism.joints import Joint


@dataclass(frozen=True)
class Actuator:
    """What acts in a joint.

    Attributes
    ----------
    joint : Joint
        Of the mechanism: type, drive, passive forces, rotor, initial coordinate.
    nodes : tuple of int
        The outer node alone, when the inner frame is fixed to the ground; inner and outer node otherwise.
    inner_frame, outer_frame : (4, 4) array
        Pose of the joint in the frame of each node, in the world for the ground.
    lead : callable
        Torque over time that the drive adds (feed-forward).
    """

    joint: Joint
    nodes: tuple[int, ...]
    inner_frame: Array
    outer_frame: Array
    lead: Callable[[float], float]


@dataclass(frozen=True)
class Turned:
    """Joint coordinates (e,), whole turns counted; rows (e, 6k) of their rates over the twists of the nodes."""

    angles: Array
    rows: Array


class Actuators:
    """Actuators with one number of nodes, as `erls.equations.nodal.elements.Elements`."""

    def __init__(self, actuators: Sequence[Actuator]) -> None:
        self.joints = tuple(a.joint for a in actuators)
        self.leads = tuple(a.lead for a in actuators)
        self.nodes: IntArray = np.array([a.nodes for a in actuators], dtype=np.int64)
        self.inner_frames = np.array([a.inner_frame for a in actuators])
        self.outer_frames = np.array([a.outer_frame for a in actuators])
        self._of_inner = motions.adjoint_inverse(self.inner_frames)
        self._of_outer = motions.adjoint_inverse(self.outer_frames)
        self.along: IntArray = np.array([5 if j.type.revolute else 2 for j in self.joints], dtype=np.int64)
        self.start = Turned(np.array([j.position for j in self.joints]), np.zeros(0))
        self.rotors = np.array([j.rotor_inertia for j in self.joints])
        self._pick = np.eye(6)[self.along][:, None, :]
        self.acting = [
            k for k, j in enumerate(self.joints) if j.forces.active or j.drive.kind not in ("free", "motion")
        ]

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Of all drives."""
        return tuple(sorted({t for j in self.joints for t in j.drive.breakpoints}))

    def remember(self, poses: Array, before: Turned | None) -> Turned:
        """Joint coordinates on the turn next to those ``before``, or to the initial ones."""
        relative = self._relative(poses)
        near = self.start.angles if before is None else before.angles
        angle = np.arctan2(relative[:, 1, 0] - relative[:, 0, 1], relative[:, 0, 0] + relative[:, 1, 1])
        angle = angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi))
        rows = (self._pick @ self._of_outer)[:, 0]
        if self.nodes.shape[1] == 2:
            inner = -(self._pick @ motions.adjoint_inverse(relative) @ self._of_inner)[:, 0]
            rows = np.concatenate([inner, rows], axis=1)
        return Turned(np.where(self.along == 5, angle, relative[:, 2, 3]), rows)

    def mass(self, poses: Array, memory: Turned) -> Array:
        """(e, 6k, 6k) of rotors."""
        return _outer(self.rotors, memory.rows)

    def forces(self, t: float, poses: Array, memory: Turned, v: Array, a: Array) -> Array:
        """(e, 6k) inertia of rotors less what drives, springs, dampers and friction give."""
        rates, accelerations = self.motion(poses, memory, v, a)
        balance = self.rotors * accelerations - self.efforts(t, memory.angles, rates)
        result: Array = balance[:, None] * memory.rows
        return result

    def efforts(self, t: float, angles: Array, rates: Array) -> Array:
        """(e,) forces on the joint coordinates; zero for what a prescribed motion takes."""
        result = np.zeros(len(self.joints))
        for k in self.acting:
            joint, angle, rate = self.joints[k], float(angles[k]), float(rates[k])
            torque = joint.drive.torque(t, angle, rate) + self.leads[k](t)
            result[k] = joint.drive.limited(torque) + joint.forces.force(angle, rate)
        return result

    def motion(self, poses: Array, memory: Turned, v: Array, a: Array) -> tuple[Array, Array]:
        """(e,) rates and accelerations of the joint coordinates."""
        rates, accelerations = ((memory.rows * x).sum(axis=1) for x in (v, a))
        if self.nodes.shape[1] == 2:
            inner = (self._of_inner @ v[:, :6, None])[:, :, 0]
            carried = motions.adjoint_inverse(self._relative(poses)) @ inner[:, :, None]
            twist = self._of_outer @ v[:, 6:, None] - carried
            swing = motions.bracket(twist[:, :, 0]) @ carried
            accelerations += (self._pick @ swing)[:, 0, 0]
        return rates, accelerations

    def derivatives(
        self, t: float, poses: Array, memory: Turned, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(e, 6k, 6k) twice: springs and proportional gains; dampers, friction and derivative gains."""
        stiffness, damping = np.zeros((2, len(self.joints)))
        for k in self.acting:
            joint = self.joints[k]
            passive, active = joint.forces.gains(float(memory.rows[k] @ v[k])), joint.drive.gains
            stiffness[k], damping[k] = passive[0] + active[0], passive[1] + active[1]
        return _outer(stiffness, memory.rows), _outer(damping, memory.rows)

    def energy(self, t: float, poses: Array, memory: Turned, v: Array) -> tuple[float, float]:
        """Of rotors and of springs."""
        rates = (memory.rows * v).sum(axis=1)
        springs = sum(
            j.forces.stiffness * (angle - j.forces.rest) ** 2
            for j, angle in zip(self.joints, memory.angles.tolist(), strict=True)
        )
        return 0.5 * float(self.rotors @ rates**2), 0.5 * springs

    def _relative(self, poses: Array) -> Array:
        inner = poses[:, 0] @ self.inner_frames if self.nodes.shape[1] == 2 else self.inner_frames
        result: Array = motions.inverse(inner) @ poses[:, -1] @ self.outer_frames
        return result


def _outer(factors: Array, rows: Array) -> Array:
    result: Array = factors[:, None, None] * rows[:, :, None] * rows[:, None, :]
    return result
