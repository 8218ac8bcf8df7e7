"""FFR in absolute coordinates: floating frames and elastic coordinates, joints as constraints with multipliers.

    M(q) a = f(t, q, v) - B(t, q)ᵀ λ,   Φ(t, q) = 0

A configuration holds the frames as matrices; velocities are their twists, in their own axes, and η̇. The same standard
data as in `Ffr`, without its velocity transformation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from erls.equations.ffr.formulation import Ffr
from erls.equations.ffr.interface_motion import InterfaceMotion, node_motion
from erls.equations.ffr.joint_conditions import (
    FrameMotion,
    JointMotion,
    carried_frame,
    joint_conditions,
    joint_motion,
    less_motion,
)
from erls.equations.ffr.joint_effort import JointEfforts
from erls.equations.ffr.second_order import SecondOrderData
from erls.equations.ffr.standard_data import StandardData
from erls.equations.formulation import Energy, Reaction, State
from erls.equations.serial.modal_inertia import modal_inertia
from erls.maths import motion_maps
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array, cross, skew
from erls.mechanism.links import Link
from fe_import.model import InterfaceNode


@dataclass(frozen=True)
class Configuration:
    """Floating frames in the world, (links, 4, 4); η of all links; joint angles, which count whole turns."""

    poses: Array
    eta: Array
    angles: Array


class ConstrainedFfr:
    """Constrained equations of motion of a serial chain; a `ConstrainedSystem`.

    Parameters
    ----------
    reduced : Ffr
        The same mechanism in independent coordinates: its links, its floating frames, its start.
    """

    def __init__(self, reduced: Ffr) -> None:
        self.reduced, self.mechanism = reduced, reduced.mechanism
        self.modes, self.efforts = reduced.modes, JointEfforts(reduced.mechanism)
        bodies = zip(self.mechanism.links, reduced.bases, reduced.given.data, strict=True)
        self.data = [self._data(link, basis, linear) for link, basis, linear in bodies]
        links, joints = self.mechanism.links, self.mechanism.joints
        self.links = len(links)
        self.twists = [slice(6 * k, 6 * k + 6) for k in range(self.links)]  # within v
        self.elastic = slice(6 * self.links, 6 * self.links + reduced.elastic)
        self.conditions = [joint_conditions(joint) for joint in joints]
        ends = np.cumsum([len(c.names) for c in self.conditions])
        self.rows = [slice(int(e) - len(c.names), int(e)) for e, c in zip(ends, self.conditions, strict=True)]
        self.along = [5 if joint.freedom.turns else 2 for joint in joints]
        self._inner: list[tuple[InterfaceMotion, Array] | None] = []
        self._outer: list[tuple[InterfaceMotion, Array]] = []
        for k, (joint, link) in enumerate(zip(joints, links, strict=True)):
            parent = joint.seat
            self._inner.append(None if parent is None else self._node(joint.parent, parent, joint.before))
            self._outer.append(self._node(k, link.inboard, inverse(joint.after)))

    def _data(self, link: Link, basis: Array, linear: StandardData) -> StandardData:
        if not self.reduced.stiffened or not link.elastic_modes or link.second_order is None:
            return linear
        return SecondOrderData(linear, link.second_order, basis, modal_inertia(link, self.mechanism.effects, basis))

    def _node(self, k: int, interface: InterfaceNode, frame: Array) -> tuple[InterfaceMotion, Array]:
        """Interface node of link ``k``, and the offset from it of a joint frame given in the mesh frame."""
        motion = node_motion(self.mechanism.links[k], interface.node, self.reduced.bases[k], self.reduced.stiffened)
        return motion, pose(position=-interface.position) @ frame

    @property
    def compiled(self) -> None:
        """Plain Python."""

    @property
    def size(self) -> int:
        """Number of velocity coordinates."""
        return self.elastic.stop

    @property
    def constraints(self) -> int:
        """Number of constraints."""
        return self.rows[-1].stop

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Joint and direction of each constraint."""
        joints = zip(self.mechanism.joints, self.conditions, strict=True)
        return tuple(f"joint {joint.name!r}, {name}" for joint, found in joints for name in found.names)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of all drives."""
        return self.reduced.breakpoints

    @cached_property
    def length_scales(self) -> Array:
        """(n,) largest displacement of any node of the link that each coordinate moves, per unit."""
        result = np.ones(self.size)
        for k, link in enumerate(self.mechanism.links):
            reach = np.linalg.norm(link.model.nodes, axis=1).max(initial=1e-3)
            result[self.twists[k]][3:] = reach
            moved = np.linalg.norm(link.model.translation_shapes @ self.reduced.bases[k], axis=1)
            result[self.elastic][self.modes[k]] = moved.max(axis=0).clip(1e-12)
        return result

    def configuration(self, t: float, y: Array, v: Array) -> tuple[Configuration, Array]:
        """Configuration and velocity of a state of `Ffr`."""
        motion = self.reduced.motion(t, y, v)
        velocity = np.concatenate([*motion.twists, motion.eta_rates])
        return Configuration(np.stack(motion.poses), motion.eta.copy(), motion.theta), velocity

    def initial_state(self) -> tuple[Configuration, Array]:
        """Configuration and velocity at time 0."""
        return self.configuration(0.0, *self.reduced.initial_state())

    def compose(self, q: Configuration, increment: Array) -> Configuration:
        """q ∘ exp(increment)."""
        poses = q.poses @ motion_maps.exp(increment[: self.elastic.start].reshape(-1, 6))
        moved = Configuration(poses, q.eta + increment[self.elastic], q.angles)
        still = np.zeros(self.size)
        angles = [self._angle(k, self._joint(k, moved, still)[2].pose, q.angles[k]) for k in range(len(q.angles))]
        return Configuration(moved.poses, moved.eta, np.array(angles))

    def _angle(self, k: int, relative: Array, near: float) -> float:
        """Joint coordinate at a relative pose, on the turn next to ``near``."""
        if not self.mechanism.joints[k].freedom.turns:
            return float(relative[2, 3])
        angle = float(np.arctan2(relative[1, 0] - relative[0, 1], relative[0, 0] + relative[1, 1]))
        return angle + 2 * np.pi * round((near - angle) / (2 * np.pi))

    def tangent(self, increment: Array) -> Array:
        """(n, n) variation of q ∘ exp(increment) per variation of the increment."""
        result = np.eye(self.size)
        blocks = motion_maps.tangent(increment[: self.elastic.start].reshape(-1, 6))
        for at, block in zip(self.twists, blocks, strict=True):
            result[at, at] = block
        return result

    def _joint(self, k: int, q: Configuration, v: Array) -> tuple[FrameMotion, FrameMotion, JointMotion]:
        """Motion of joint ``k``: its inner and outer frame, and the latter relative to the former."""

        def frame(number: int, carrier: tuple[InterfaceMotion, Array]) -> FrameMotion:
            at = self.modes[number]
            rate = v[self.elastic][at]
            return carried_frame(q.poses[number], v[self.twists[number]], *carrier, q.eta[at], rate)

        carrier = self._inner[k]
        ground = FrameMotion(self.mechanism.joints[k].before, np.zeros((6, 0)), np.zeros(6), np.zeros(6))
        inner = ground if carrier is None else frame(self.mechanism.joints[k].parent, carrier)
        outer = frame(k, self._outer[k])
        return inner, outer, joint_motion(inner, outer)

    def _condition(self, k: int, t: float, found: JointMotion) -> tuple[JointMotion, Array]:
        """The motion that the rows keep at zero, and what of its twist time alone gives."""
        joint = self.mechanism.joints[k]
        if not joint.drive.prescribed:
            return found, np.zeros(6)
        return less_motion(joint.freedom, found, joint.drive.reference(t))  # type: ignore[arg-type]

    def _relative_rows(self, k: int, inner: FrameMotion, outer: FrameMotion, transform: Array) -> Array:
        """(6, n) relative twist of joint ``k`` over all velocities."""
        result = np.zeros((6, self.size))
        elastic = result[:, self.elastic]
        result[:, self.twists[k]] = outer.rows[:, :6]
        elastic[:, self.modes[k]] = outer.rows[:, 6:]
        parent = self.mechanism.joints[k].parent
        if parent >= 0:
            rows = transform @ inner.rows
            result[:, self.twists[parent]] = -rows[:, :6]
            elastic[:, self.modes[parent]] = -rows[:, 6:]
        return result

    def _efforts(self, t: float, q: Configuration, v: Array) -> list[tuple[float, float, Array, float]]:
        """Force and rotor of every joint that has any, its row over v, and the bias of its acceleration."""
        joints = [self._joint(k, q, v) for k in range(len(self.along))]
        rates = np.array([found[2].twist[at] for found, at in zip(joints, self.along, strict=True)])
        forces = self.efforts.at(t, q.angles, rates)
        return [
            (float(forces[k]), float(self.efforts.rotors[k]), rows[at], float(relative.bias[at]))
            for k, (at, (inner, outer, relative)) in enumerate(zip(self.along, joints, strict=True))
            for rows in [self._relative_rows(k, inner, outer, relative.transform)]
        ]

    def residual(self, t: float, q: Configuration, v: Array, a: Array) -> Array:
        """(n,) M a - f, without the forces of the constraints."""
        result = np.empty(self.size)
        elastic, rates, accelerations = result[self.elastic], v[self.elastic], a[self.elastic]
        elastic[:] = self.reduced.elastic_forces(q.eta) + self.reduced.damping * rates
        for world, move, at, data in zip(q.poses, self.twists, self.modes, self.data, strict=True):
            wrench, forces = data.forces(v[move], a[move], q.eta[at], rates[at], accelerations[at])
            weight, elastic_weight = data.weight(world[:3, :3].T @ self.mechanism.gravity, q.eta[at])
            result[move] = wrench - weight
            elastic[at] += forces - elastic_weight
        if self.efforts.any:
            for force, rotor, row, bias in self._efforts(t, q, v):
                result += row * (rotor * (row @ a + bias) - force)
        return result

    def mass_matrix(self, t: float, q: Configuration) -> Array:
        """(n, n) symmetric, positive semi-definite."""
        result = np.zeros((self.size, self.size))
        for move, at, data in zip(self.twists, self.modes, self.data, strict=True):
            place = np.r_[move, self.elastic.start + at.start : self.elastic.start + at.stop]
            result[np.ix_(place, place)] = data.mass_matrix(q.eta[at])
        if self.efforts.rotors.any():
            for _, rotor, row, _ in self._efforts(t, q, np.zeros(self.size)):
                result += rotor * np.outer(row, row)
        return result

    def stiffness_and_damping(
        self, t: float, q: Configuration, v: Array, a: Array, multipliers: Array
    ) -> tuple[Array, Array]:
        """Modal stiffness and damping, joint springs, dampers, friction and controller gains."""
        stiffness, damping = np.zeros((2, self.size, self.size))
        at = np.arange(self.elastic.start, self.elastic.stop)
        stiffness[at, at], damping[at, at] = self.reduced.stiffness, self.reduced.damping
        if self.efforts.any:
            rows = [row for _, _, row, _ in self._efforts(t, q, v)]
            gains = self.efforts.gains(t, q.angles, np.array([r @ v for r in rows]))
            for row, k, c in zip(rows, *gains, strict=True):
                stiffness += k * np.outer(row, row)
                damping += c * np.outer(row, row)
        return stiffness, damping

    def constraint(self, t: float, q: Configuration) -> Array:
        """(m,) Φ: misalignment of the joint frames [m, rad]."""
        still, result = np.zeros(self.size), np.empty(self.constraints)
        for k, (at, conditions) in enumerate(zip(self.rows, self.conditions, strict=True)):
            result[at] = conditions.violation(self._condition(k, t, self._joint(k, q, still)[2])[0].pose)
        return result

    def constraint_matrix(self, t: float, q: Configuration) -> Array:
        """(m, n) B."""
        still, result = np.zeros(self.size), np.empty((self.constraints, self.size))
        for k, (at, conditions) in enumerate(zip(self.rows, self.conditions, strict=True)):
            inner, outer, found = self._joint(k, q, still)
            gradient = conditions.gradient(self._condition(k, t, found)[0].pose)
            result[at] = gradient @ self._relative_rows(k, inner, outer, found.transform)
        return result

    def constraint_rate(self, t: float, q: Configuration) -> Array:
        """(m,) Φ_t."""
        still, result = np.zeros(self.size), np.zeros(self.constraints)
        for k in self.reduced.prescribed_joints.tolist():
            left, timed = self._condition(k, t, self._joint(k, q, still)[2])
            result[self.rows[k]] = self.conditions[k].gradient(left.pose) @ timed
        return result

    def constraint_bias(self, t: float, q: Configuration, v: Array) -> Array:
        """(m,) Φ̈ - B a."""
        result = np.empty(self.constraints)
        for k, (at, conditions) in enumerate(zip(self.rows, self.conditions, strict=True)):
            left, _ = self._condition(k, t, self._joint(k, q, v)[2])
            result[at] = conditions.gradient(left.pose) @ left.bias + conditions.curvature(left.pose, left.twist)
        return result

    def stored(self, t: float, q: Configuration, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Position and rotation matrix of every frame, η, joint angles; with first and second derivatives."""
        places: list[Array] = []
        rates: list[Array] = []
        accelerations: list[Array] = []
        for world, at in zip(q.poses, self.twists, strict=True):
            turn, turning = world[:3, :3], skew(v[at][3:])
            slide = a[at][:3] + cross(v[at][3:], v[at][:3])
            places += [world[:3, 3], turn.ravel()]
            rates += [turn @ v[at][:3], (turn @ turning).ravel()]
            accelerations += [turn @ slide, (turn @ (turning @ turning + skew(a[at][3:]))).ravel()]
        joints = self._efforts(t, q, v)
        places += [q.eta, q.angles]
        rates += [v[self.elastic], np.array([row @ v for _, _, row, _ in joints])]
        accelerations += [a[self.elastic], np.array([row @ a + bias for _, _, row, bias in joints])]
        return np.concatenate(places), np.concatenate(rates), np.concatenate(accelerations)

    def from_stored(self, stored: Array, rate: Array) -> tuple[Configuration, Array]:
        """Configuration and velocity from what `stored` gives, interpolated or not; rotations made orthogonal."""
        poses, velocity = [], np.empty(self.size)
        for k, at in enumerate(self.twists):
            x, entries = stored[12 * k : 12 * k + 3], stored[12 * k + 3 : 12 * k + 12].reshape(3, 3)
            left, _, right = np.linalg.svd(entries)
            turn = left @ right
            turning = turn.T @ rate[12 * k + 3 : 12 * k + 12].reshape(3, 3)
            velocity[at][:3] = turn.T @ rate[12 * k : 12 * k + 3]
            velocity[at][3:] = (turning - turning.T)[[2, 0, 1], [1, 2, 0]] / 2
            poses.append(pose(turn, x))
        ends = 12 * self.links, 12 * self.links + self.reduced.elastic
        velocity[self.elastic] = rate[ends[0] : ends[1]]
        return Configuration(np.stack(poses), stored[ends[0] : ends[1]], stored[ends[1] :]), velocity

    def state(self, t: float, q: Configuration, v: Array) -> State:
        """Floating frames, modal coordinates and joint angles, as in `Ffr`."""
        modal = [basis @ q.eta[at] for basis, at in zip(self.reduced.bases, self.modes, strict=True)]
        rates = np.array([row @ v for _, _, row, _ in self._efforts(t, q, v)])
        return State(t, list(q.poses), modal, q.angles, q.angles, rates)

    def energy(self, t: float, q: Configuration, v: Array) -> Energy:
        """Energies of a state."""
        kinetic = gravity = springs = 0.0
        for world, move, at, data in zip(q.poses, self.twists, self.modes, self.data, strict=True):
            kinetic += data.kinetic_energy(v[move], q.eta[at], v[self.elastic][at])
            gravity += data.gravity_energy(self.mechanism.gravity, world, q.eta[at])
        for joint, angle, (_, rotor, row, _) in zip(
            self.mechanism.joints, q.angles, self._efforts(t, q, v), strict=True
        ):
            kinetic += 0.5 * rotor * float(row @ v) ** 2
            springs += 0.5 * joint.forces.stiffness * float(angle - joint.forces.rest) ** 2
        return Energy(kinetic, self.reduced.elastic_energy(q.eta), gravity, springs)

    def reactions(self, t: float, q: Configuration, v: Array, a: Array, multipliers: Array) -> list[Reaction]:
        """Joint reactions from multipliers, forces and rotors, at the displaced inboard nodes."""
        result: list[Reaction] = []
        efforts = self._efforts(t, q, v)
        for k, (at, conditions) in enumerate(zip(self.rows, self.conditions, strict=True)):
            _, outer, found = self._joint(k, q, v)
            wrench = -conditions.gradient(self._condition(k, t, found)[0].pose).T @ multipliers[at]
            force, rotor, row, bias = efforts[k]
            prescribed = self.mechanism.joints[k].drive.prescribed
            effort = float(wrench[self.along[k]]) if prescribed else force
            wrench[self.along[k]] += force - rotor * float(row @ a + bias)
            arm = inverse(self._outer[k][1])[:3, 3]  # of the node, in the joint frame
            turn = outer.pose[:3, :3]
            result.append(Reaction(turn @ wrench[:3], turn @ (wrench[3:] - cross(arm, wrench[:3])), effort))
        return result
