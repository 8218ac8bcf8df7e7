"""FFR in independent coordinates: joint coordinates and elastic coordinates of all links.

Every link obeys M z̈ = Q in its own absolute coordinates z = (floating frame, η). The joints are eliminated by the
velocity transformation ż = J(y) ẏ of `Recursion`, which leaves Jᵀ (M (J ÿ + J̇ ẏ) - Q) = 0. The projection runs from
the tip inward on wrenches, so J itself is needed for the mass matrix only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la

from erls.equations.compiled_system import CompiledSystem
from erls.equations.ffr.body_frame import elastic_basis
from erls.equations.ffr.interface_motion import InterfaceMotion
from erls.equations.ffr.joint_effort import JointEfforts
from erls.equations.ffr.pack import Given, pack_frames
from erls.equations.ffr.recursion import Recursion, Step, bracket, node_motion
from erls.equations.ffr.second_order import SecondOrderData
from erls.equations.ffr.standard_data import StandardData
from erls.equations.formulation import Energy, Reaction, State
from erls.equations.serial.equilibrium import held_equilibrium
from erls.equations.serial.joint_frames import FrameMotion, attached, carried
from erls.equations.serial.modal_inertia import modal_inertia
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.mechanism.loops import LoopEnd


@dataclass(frozen=True)
class Motion:
    """Positions and velocities of all links: joint coordinates and rates, η and η̇, poses and twists of the frames."""

    theta: Array
    rates: Array
    eta: Array
    eta_rates: Array
    steps: list[Step]
    poses: list[Array]
    twists: list[Array]


@dataclass(frozen=True)
class Evaluation:
    """Forces out of balance on (θ, η), and the wrench that each joint carries, about its link's floating frame."""

    residual: Array
    wrenches: list[Array]
    efforts: Array


class Ffr:
    """Equations of motion of a serial chain; a `Formulation`.

    Parameters
    ----------
    mechanism : Mechanism
    body_frame : str
        ``"tangent"`` or ``"mean-axis"``, see `elastic_basis`.
    """

    def __init__(self, mechanism: Mechanism, body_frame: str = "tangent") -> None:
        self.mechanism, self.body_frame = mechanism, body_frame
        self.bases = [elastic_basis(link, body_frame) for link in mechanism.links]
        self.stiffened = "geometric_stiffening" in mechanism.effects
        self.data = [self._data(link, basis) for link, basis in zip(mechanism.links, self.bases, strict=True)]
        self.recursion = Recursion(mechanism, self.bases, body_frame, self.stiffened)
        self.efforts = JointEfforts(mechanism)
        self.joints = len(mechanism.joints)
        ends = np.cumsum([data.size for data in self.data])
        self.elastic = int(ends[-1])
        self.modes = [slice(int(e) - d.size, int(e)) for e, d in zip(ends, self.data, strict=True)]  # within η
        prescribed = np.array([j.drive.prescribed for j in mechanism.joints], dtype=bool)
        self.free_joints = np.flatnonzero(~prescribed)
        self.prescribed_joints = [int(k) for k in np.flatnonzero(prescribed)]
        self.free = np.concatenate([self.free_joints, self.joints + np.arange(self.elastic)])
        self.stiffness = np.concatenate([link.stiffness for link in mechanism.links])
        self.damping = np.concatenate([link.damping for link in mechanism.links])
        self._nodes: dict[tuple[int, int], InterfaceMotion] = {}

    def _data(self, link: Link, basis: Array) -> StandardData:
        linear = StandardData(link.invariants, basis, self.mechanism.effects)
        if not self.stiffened or not link.elastic_modes or link.second_order is None:
            return linear
        modal = modal_inertia(link, self.mechanism.effects, basis)
        return SecondOrderData(linear, link.second_order, basis, modal)

    @property
    def size(self) -> int:
        """Number of independent coordinates."""
        return len(self.free)

    @cached_property
    def given(self) -> Given:
        """What is packed."""
        return Given(self.mechanism, self.bases, self.data, self.body_frame != "tangent", self.stiffened)

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The same equations in compiled form."""
        return pack_frames(self.given)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of all drives."""
        return tuple(sorted({b for joint in self.mechanism.joints for b in joint.drive.breakpoints}))

    @cached_property
    def length_scales(self) -> Array:
        """(n,) largest displacement of any node per unit of each coordinate, from the initial configuration."""
        theta = np.array([j.position for j in self.mechanism.joints])
        eta = np.zeros(self.elastic)
        scales = np.zeros(self.joints + self.elastic)
        for k, jacobian in enumerate(self.jacobians(self._steps(theta, 0 * theta, eta, eta))):
            model, at = self.mechanism.links[k].model, self.modes[k]
            moved = jacobian[:3] - np.cross(model.nodes[:, None, :], jacobian[3:].T).transpose(0, 2, 1)
            moved[:, :, self.joints + at.start : self.joints + at.stop] += model.translation_shapes @ self.bases[k]
            scales = np.maximum(scales, np.linalg.norm(moved, axis=1).max(axis=0))
        smallest = np.full(len(scales), 1e-12)
        smallest[: self.joints] = 1e-3
        return np.asarray(np.maximum(scales, smallest)[self.free])

    def _steps(self, theta: Array, rates: Array, eta: Array, eta_rates: Array) -> list[Step]:
        links = [(eta[at], eta_rates[at]) for at in self.modes]
        return [
            self.recursion.step(k, theta[k], rates[k], links[k - 1], links[k]) for k in range(self.joints)
        ]

    def _prescribed(self, k: int, t: float) -> tuple[float, float, float]:
        return self.mechanism.joints[k].drive.reference(t)  # type: ignore[return-value]

    def motion(self, t: float, y: Array, v: Array) -> Motion:
        """All frames at a state; prescribed joints follow from time."""
        f = len(self.free_joints)
        theta, rates = np.empty(self.joints), np.empty(self.joints)
        theta[self.free_joints], rates[self.free_joints] = y[:f], v[:f]
        for k in self.prescribed_joints:
            theta[k], rates[k], _ = self._prescribed(k, t)
        steps = self._steps(theta, rates, y[f:], v[f:])
        world, twist = np.eye(4), np.zeros(6)
        poses: list[Array] = []
        twists: list[Array] = []
        for step in steps:
            world = world @ step.pose
            twist = step.transform @ twist + step.twist
            poses.append(world)
            twists.append(twist)
        return Motion(theta, rates, y[f:], v[f:], steps, poses, twists)

    def jacobians(self, steps: list[Step]) -> list[Array]:
        """(6, joints + elastic) Jacobian of every link's twist with respect to (θ̇, η̇)."""
        current = np.zeros((6, self.joints + self.elastic))
        result: list[Array] = []
        for k, step in enumerate(steps):
            current = step.transform @ current
            current[:, k] = step.joint
            for number, columns in ((k - 1, step.parent), (k, step.own)):
                if columns is not None:
                    at = self.modes[number]
                    current[:, self.joints + at.start : self.joints + at.stop] += columns
            result.append(current)
        return result

    def evaluate(self, t: float, motion: Motion, a: Array) -> Evaluation:
        """Forces over (θ, η) that are out of balance at accelerations ``a``; frames outward, wrenches inward."""
        f = len(self.free_joints)
        accelerations, eta_accelerations = np.empty(self.joints), a[f:]
        accelerations[self.free_joints] = a[:f]
        for k in self.prescribed_joints:
            accelerations[k] = self._prescribed(k, t)[2]
        residual = np.empty(self.joints + self.elastic)
        elastic = residual[self.joints :]
        elastic[:] = self.stiffness * motion.eta + self.damping * motion.eta_rates
        wrenches: list[Array] = []
        rate = np.zeros(6)
        for k, (step, data) in enumerate(zip(motion.steps, self.data, strict=True)):
            at = self.modes[k]
            carried = motion.twists[k] - step.twist
            rate = step.transform @ rate + step.joint * accelerations[k] + step.bias + bracket(carried, step.twist)
            if step.parent is not None:
                rate += step.parent @ eta_accelerations[self.modes[k - 1]]
            if step.own is not None:
                rate += step.own @ eta_accelerations[at]
            wrench, forces = data.forces(
                motion.twists[k], rate, motion.eta[at], motion.eta_rates[at], eta_accelerations[at]
            )
            g = motion.poses[k][:3, :3].T @ self.mechanism.gravity
            weight, elastic_weight = data.weight(g, motion.eta[at])
            wrenches.append(wrench - weight)
            elastic[at] += forces - elastic_weight
        for k in reversed(range(self.joints)):
            step = motion.steps[k]
            residual[k] = step.joint @ wrenches[k]
            if step.own is not None:
                elastic[self.modes[k]] += step.own.T @ wrenches[k]
            if step.parent is not None:
                elastic[self.modes[k - 1]] += step.parent.T @ wrenches[k]
            if k:
                wrenches[k - 1] = wrenches[k - 1] + step.transform.T @ wrenches[k]
        efforts = self.efforts.at(t, motion.theta, motion.rates)
        residual[: self.joints] += self.efforts.rotors * accelerations - efforts
        return Evaluation(residual, wrenches, efforts)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) forces out of balance on the independent coordinates."""
        return np.asarray(self.evaluate(t, self.motion(t, y, v), a).residual[self.free])

    def _mass_matrix(self, motion: Motion) -> Array:
        """(n, n) Σ Jᵀ M J and rotors, over the independent coordinates."""
        result = np.zeros((self.joints + self.elastic,) * 2)
        result.flat[: self.joints * (len(result) + 1) : len(result) + 1] = self.efforts.rotors
        for at, data, jacobian in zip(self.modes, self.data, self.jacobians(motion.steps), strict=True):
            mass = data.mass_matrix(motion.eta[at])
            columns = slice(self.joints + at.start, self.joints + at.stop)
            result += jacobian.T @ (mass[:6, :6] @ jacobian)
            cross_terms = jacobian.T @ mass[:6, 6:]
            result[:, columns] += cross_terms
            result[columns] += cross_terms.T
            result[columns, columns] += mass[6:, 6:]
        return np.asarray(result[np.ix_(self.free, self.free)])

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) mass matrix over the independent coordinates."""
        return self._mass_matrix(self.motion(t, y, np.zeros(self.size)))

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) accelerations from the equations of motion.

        Raises
        ------
        SimulationError
            The mass matrix is not positive definite; names the coordinate.
        """
        motion = self.motion(t, y, v)
        force = self.evaluate(t, motion, np.zeros(self.size)).residual[self.free]
        mass = self._mass_matrix(motion)
        try:
            return np.asarray(la.cho_solve(la.cho_factor(mass, check_finite=False), -force, check_finite=False))
        except la.LinAlgError:
            raise self._singular(t, mass) from None

    def _singular(self, t: float, mass: Array) -> SimulationError:
        values, vectors = np.linalg.eigh(mass)
        worst = int(self.free[np.abs(vectors[:, 0]).argmax()])
        if worst < self.joints:
            name = f"joint {self.mechanism.joints[worst].name!r}"
        else:
            number = next(k for k, at in enumerate(self.modes) if worst - self.joints < at.stop)
            name = f"the elastic coordinates of link {self.mechanism.links[number].name!r}"
        return SimulationError(
            Cause.SINGULAR_MASS,
            f"nothing resists the motion of {name}",
            where=f"t = {t:.6g} s",
            value=float(values[0]),
            limit="above 0",
            remedy="give the link mass and inertia, or the joint rotor inertia",
        )

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """Modal stiffness and damping, joint springs, dampers, friction and controller gains."""
        f = len(self.free_joints)
        angles, rates = np.zeros((2, self.joints))  # those of prescribed joints count for nothing
        angles[self.free_joints], rates[self.free_joints] = y[:f], v[:f]
        gains = self.efforts.gains(t, angles, rates)
        stiffness = np.concatenate([gains[0], self.stiffness])[self.free]
        damping = np.concatenate([gains[1], self.damping])[self.free]
        return np.diag(stiffness), np.diag(damping)

    def initial_state(self) -> tuple[Array, Array]:
        """(y, v) at time 0: the joints' initial angles and rates, links undeformed or in static equilibrium."""
        y, v = np.zeros(self.size), np.zeros(self.size)
        f = len(self.free_joints)
        y[:f] = [self.mechanism.joints[k].position for k in self.free_joints]
        v[:f] = [self.mechanism.joints[k].rate for k in self.free_joints]
        if self.mechanism.static_start:
            y = held_equilibrium(self, y, self.free_joints)
        return y, v

    def state(self, t: float, y: Array, v: Array) -> State:
        """Floating frames, modal coordinates of the fields that deform them, and joint angles.

        The joint coordinate is the angle between the displaced interface frames, so that angle and coordinate agree.
        """
        motion = self.motion(t, y, v)
        modal = [basis @ motion.eta[at] for basis, at in zip(self.bases, self.modes, strict=True)]
        return State(t, motion.poses, modal, motion.theta, motion.theta, motion.rates)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state."""
        motion = self.motion(t, y, v)
        kinetic = gravity = 0.0
        for at, data, twist, world in zip(self.modes, self.data, motion.twists, motion.poses, strict=True):
            kinetic += data.kinetic_energy(twist, motion.eta[at], motion.eta_rates[at])
            gravity += data.gravity_energy(self.mechanism.gravity, world, motion.eta[at])
        kinetic += float(0.5 * self.efforts.rotors @ motion.rates**2)
        springs = sum(
            0.5 * j.forces.stiffness * (float(angle) - j.forces.rest) ** 2
            for j, angle in zip(self.mechanism.joints, motion.theta, strict=True)
        )
        return Energy(kinetic, float(0.5 * self.stiffness @ motion.eta**2), gravity, springs)

    def frames(self, t: float, y: Array, v: Array, ends: Sequence[LoopEnd]) -> list[FrameMotion]:
        """Frames on displaced nodes of links, with rows over (θ, η); see `TreeFormulation`."""
        motion = self.motion(t, y, v)
        biases, rate = [], np.zeros(6)
        for k, (step, twist) in enumerate(zip(motion.steps, motion.twists, strict=True)):
            rate = step.transform @ rate + step.bias + bracket(twist - step.twist, step.twist)
            if k in self.prescribed_joints:
                rate = rate + step.joint * self._prescribed(k, t)[2]
            biases.append(rate)
        jacobians = self.jacobians(motion.steps)
        result: list[FrameMotion] = []
        for k, node, offset in ((int(end.link or 0), end.node, end.frame) for end in ends):
            at = self.modes[k]
            moved = self._node(k, node).at(motion.eta[at], motion.eta_rates[at])
            rows = np.zeros((6, self.joints + self.elastic))
            rows[:, self.joints + at.start : self.joints + at.stop] = moved.jacobian
            local = FrameMotion(moved.pose, rows, moved.jacobian @ motion.eta_rates[at], moved.bias)
            link = FrameMotion(motion.poses[k], jacobians[k], motion.twists[k], biases[k])
            result.append(attached(carried(link, local), offset))
        return result

    def _node(self, k: int, node: int) -> InterfaceMotion:
        """Motion of a node of link ``k``; those of loops are asked for again and again."""
        if (k, node) not in self._nodes:
            self._nodes[k, node] = node_motion(self.mechanism.links[k], node, self.bases[k], self.stiffened)
        return self._nodes[k, node]

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions at a state: what the links from there outward need."""
        return self.reactions_at(t, y, v, self.acceleration(t, y, v))

    def reactions_at(self, t: float, y: Array, v: Array, a: Array) -> list[Reaction]:
        """Joint reactions that give these accelerations."""
        motion = self.motion(t, y, v)
        found = self.evaluate(t, motion, a)
        result: list[Reaction] = []
        for k, (link, wrench) in enumerate(zip(self.mechanism.links, found.wrenches, strict=True)):
            shape, _ = link.model.node_shape(link.inboard.node)
            node = link.inboard.position + shape @ (self.bases[k] @ motion.eta[self.modes[k]])
            turn = motion.poses[k][:3, :3]
            prescribed = self.mechanism.joints[k].drive.prescribed
            effort = found.residual[k] if prescribed else found.efforts[k]
            moment = wrench[3:] - cross(node, wrench[:3])
            result.append(Reaction(turn @ wrench[:3], turn @ moment, float(effort)))
        return result

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        return {
            "formulation": "ffr",
            "body_frame": self.body_frame,
            "joints": self.joints,
            "elastic_coordinates": self.elastic,
            "highest_frequency_hz": float(np.sqrt(self.stiffness.max(initial=0.0)) / (2 * np.pi)),
        }
