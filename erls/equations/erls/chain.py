"""ERLS-CMS: the Equivalent Rigid Link System with component mode synthesis.

Independent coordinates y = (free joint coordinates θ_f, elastic coordinates q_d of all links). The rigid-body modal
coordinates follow from compatibility, q_r = D(θ) q_d; prescribed joint coordinates follow from time. The equations
are the projection of every link's inertia forces, weights and elastic forces on the virtual displacements

    δν_k = J_k δθ,   δq = (D δq_d + G δθ, δq_d)

(ERLS-CMS paper, eq. 69-75, with the inertia forces from the kinetic energy).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la

from erls.equations.erls.paper.compatibility import Compatibility
from erls.equations.erls.paper.joint_turn import JointTurn, Motion, joint_turn
from erls.equations.erls.paper.link_inertia import LinkInertia, moment_about
from erls.equations.erls.paper.second_order_compatibility import second_order_compatibility
from erls.equations.erls.paper.second_order_inertia import SecondOrderInertia
from erls.equations.erls.series import chain_series
from erls.equations.formulation import Energy, Reaction, State
from erls.equations.serial.displaced_frame import displaced_frame
from erls.equations.serial.equilibrium import held_equilibrium
from erls.equations.serial.joint_frames import FrameMotion, attached, carried
from erls.equations.serial.modal_inertia import modal_inertia
from erls.equations.serial.node_reach import node_reach
from erls.equations.serial.state_series import StateSeries
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, jacobians, kinematics, poses
from erls.mechanism.links import Link, node_shape6
from erls.mechanism.loops import LoopEnd
from erls.mechanism.rigid_dynamics import inverse_dynamics

if TYPE_CHECKING:
    from erls.equations.compiled_system import CompiledSystem


@dataclass(frozen=True)
class Evaluation:
    """One evaluation of the equations: forces over all of (θ, q_d), and what reactions need."""

    residual: Array
    wrenches: list[Array]
    efforts: Array


class Erls:
    """Equations of motion of a serial chain; a `Formulation`.

    Parameters
    ----------
    mechanism : Mechanism
    gauge : str
        ``"joint-angle"`` or ``"minimum-norm"``, see `compatibility`.
    """

    def __init__(self, mechanism: Mechanism, gauge: str = "joint-angle") -> None:
        self.mechanism = mechanism
        self.gauge = gauge
        self.stiffened = "geometric_stiffening" in mechanism.effects and any(
            link.second_order is not None and link.elastic_modes for link in mechanism.links
        )
        kinematics_of = second_order_compatibility if self.stiffened else Compatibility
        self.compatibility = kinematics_of(mechanism, gauge)
        self.inertia = [self._inertia(link) for link in mechanism.links]
        self.screws = [joint.screw for joint in mechanism.joints]
        self.joints = len(mechanism.joints)
        self.elastic = sum(link.elastic_modes for link in mechanism.links)
        prescribed = np.array([j.drive.prescribed for j in mechanism.joints], dtype=bool)
        self.free_joints = np.flatnonzero(~prescribed)
        self.prescribed_joints = np.flatnonzero(prescribed)
        self.free = np.concatenate([self.free_joints, self.joints + np.arange(self.elastic)])
        self.stiffness = np.concatenate([link.stiffness for link in mechanism.links])
        self.damping = np.concatenate([link.damping for link in mechanism.links])
        self._feed_forward_cache: tuple[float, Array] = (np.nan, np.zeros(0))
        self.needs_feed_forward = any(j.drive.feed_forward for j in mechanism.joints)
        self.active_joints = [
            k
            for k, j in enumerate(mechanism.joints)
            if j.forces.active or j.rotor_inertia or j.drive.kind not in ("free", "motion")
        ]

    def _inertia(self, link: Link) -> LinkInertia | SecondOrderInertia:
        linear = LinkInertia(link.invariants, self.mechanism.effects)
        if not self.stiffened or link.second_order is None:
            return linear
        return SecondOrderInertia(
            linear, link.invariants.rigid_mass_matrix, link.second_order, modal_inertia(link, self.mechanism.effects)
        )

    @property
    def size(self) -> int:
        """Number of independent coordinates."""
        return len(self.free)

    @cached_property
    def compiled(self) -> CompiledSystem | None:
        """The same equations in compiled form; None in the minimum-norm gauge and with ``modal_inertia``."""
        if self.gauge != "joint-angle" or (self.stiffened and "modal_inertia" in self.mechanism.effects):
            return None
        if self.stiffened:
            from erls.equations.erls.stiffened.compiled import compile_stiffened

            return compile_stiffened(self)
        from erls.equations.erls.compiled import compile_chain  # here: it imports the compiler

        return compile_chain(self)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of all drives."""
        return tuple(sorted({b for joint in self.mechanism.joints for b in joint.drive.breakpoints}))

    @property
    def length_scales(self) -> Array:
        """(n,) largest displacement of any node per unit of each coordinate, from the initial configuration."""
        return np.asarray(node_reach(self.mechanism, self.compatibility)[self.free])

    def _expand(self, t: float, y: Array, v: Array, a: Array | None) -> tuple[Array, ...]:
        """θ, θ̇, θ̈ of all joints and q_d, q̇_d, q̈_d."""
        f = len(self.free_joints)
        theta, rates, accelerations = np.empty(self.joints), np.empty(self.joints), np.empty(self.joints)
        theta[self.free_joints], rates[self.free_joints] = y[:f], v[:f]
        accelerations[self.free_joints] = 0.0 if a is None else a[:f]
        for k in self.prescribed_joints:
            reference = self.mechanism.joints[k].drive.reference(t)
            theta[k], rates[k], accelerations[k] = reference  # type: ignore[misc]
        qdd = np.zeros(self.elastic) if a is None else a[f:]
        return theta, rates, accelerations, y[f:], v[f:], qdd

    def _motion(self, theta: Array, rates: Array, q_d: Array, qd_d: Array) -> Motion:
        return Motion(*self.compatibility.acceleration(theta, rates, q_d, qd_d))

    def _turn(self, k: int, theta: Array, rates: Array, motion: Motion) -> JointTurn:
        return joint_turn(self.compatibility, k, theta, rates, motion)

    def feed_forward(self, t: float) -> Array:
        """(joints,) rigid inverse dynamics of the reference motion of all joints."""
        if self._feed_forward_cache[0] != t:
            references = [
                j.drive.reference(t) or (j.position, 0.0, 0.0)  # joints without reference are held in mind
                for j in self.mechanism.joints
            ]
            theta, rates, accelerations = np.array(references).T
            self._feed_forward_cache = (t, inverse_dynamics(self.mechanism, theta, rates, accelerations))
        return self._feed_forward_cache[1]

    def _wanted(self, k: int, t: float, angle: float, rate: float) -> float:
        """Force that the drive of joint k asks of its motor."""
        drive = self.mechanism.joints[k].drive
        return drive.torque(t, angle, rate) + (float(self.feed_forward(t)[k]) if drive.feed_forward else 0.0)

    def _effort(self, k: int, t: float, angle: float, rate: float) -> float:
        """Force of drive, spring, damper and friction on joint k."""
        joint = self.mechanism.joints[k]
        return joint.drive.limited(self._wanted(k, t, angle, rate)) + joint.forces.force(angle, rate)

    def evaluate(self, t: float, y: Array, v: Array, a: Array) -> Evaluation:
        """Forces over (θ, q_d) that are out of balance, link wrenches from the tip inward, joint efforts."""
        theta, rates, accelerations, q_d, qd_d, qdd_d = self._expand(t, y, v, a)
        motion = self._motion(theta, rates, q_d, qd_d)
        q, qd, d, g, n = motion.q, motion.qd, motion.d, motion.g, motion.n
        qdd = self.compatibility.stack(d @ qdd_d + g @ accelerations + n, qdd_d)
        chain = kinematics(self.mechanism, self.screws, theta, rates)
        places = self.compatibility.layout
        modal = np.empty(places.size)
        wrenches: list[Array] = []
        twist_rate = np.zeros(6)
        for k, inertia in enumerate(self.inertia):
            # the joint acceleration part of ν̇ runs beside the bias, which holds the velocity part
            twist_rate = chain.transforms[k] @ twist_rate + self.screws[k] * accelerations[k]
            modes = places.modes[k]
            wrench, forces = inertia.forces(
                chain.twists[k], twist_rate + chain.biases[k], q[modes], qd[modes], qdd[modes]
            )
            weight, modal_weight = inertia.gravity(chain.poses[k][:3, :3].T @ self.mechanism.gravity, q[modes])
            wrenches.append(wrench - weight)
            modal[modes] = forces - modal_weight
        for k in range(self.joints - 1, 0, -1):
            wrenches[k - 1] = wrenches[k - 1] + chain.transforms[k].T @ wrenches[k]
        rigid_forces = modal[places.rigid]
        residual = np.empty(self.joints + self.elastic)
        residual[: self.joints] = [s @ w for s, w in zip(self.screws, wrenches, strict=True)]
        residual[: self.joints] += g.T @ rigid_forces
        residual[self.joints :] = (
            d.T @ rigid_forces + modal[places.elastic] + self.stiffness * q_d + self.damping * qd_d
        )
        efforts = np.zeros(self.joints)
        for k in self.active_joints:
            turn = self._turn(k, theta, rates, motion)
            efforts[k] = self._effort(k, t, turn.angle, turn.rate)
            rotor = self.mechanism.joints[k].rotor_inertia
            if turn.gradient is None:
                residual[k] += rotor * accelerations[k] - efforts[k]
            else:
                turning = turn.bias + turn.gradient @ np.concatenate([accelerations, qdd_d])
                residual += turn.gradient * (rotor * turning - efforts[k])
        return Evaluation(residual, wrenches, efforts)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) forces out of balance on the independent coordinates."""
        return np.asarray(self.evaluate(t, y, v, a).residual[self.free])

    def full_mass_matrix(self, t: float, y: Array) -> Array:
        """(joints + elastic)² mass matrix over (θ, q_d), prescribed joints included."""
        theta, _, _, q_d, _, _ = self._expand(t, y, np.zeros(self.size), None)
        q, d, g = self.compatibility.velocity(theta, q_d)
        chain = kinematics(self.mechanism, self.screws, theta, np.zeros(self.joints))
        places = self.compatibility.layout
        size = self.joints + self.elastic
        result = np.zeros((size, size))
        for k, (inertia, jacobian) in enumerate(
            zip(self.inertia, jacobians(chain.transforms, self.screws), strict=True)
        ):
            modes = places.modes[k]
            move = np.zeros((6 + inertia.size, size))
            move[:6, : self.joints] = jacobian
            move[6:12, : self.joints] = g[6 * k : 6 * k + 6]
            move[6:12, self.joints :] = d[6 * k : 6 * k + 6]
            at = places.elastic_of[k]
            move[12:, self.joints + at.start : self.joints + at.stop] = np.eye(at.stop - at.start)
            result += move.T @ inertia.mass_matrix(q[modes]) @ move
        for k in self.active_joints:
            rotor = self.mechanism.joints[k].rotor_inertia
            if rotor:
                at_rest = Motion(q, np.zeros_like(q), d, g, np.zeros(len(d)))
                gradient = self._turn(k, theta, np.zeros(self.joints), at_rest).gradient
                if gradient is None:
                    result[k, k] += rotor
                else:
                    result += rotor * np.outer(gradient, gradient)
        return result

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) mass matrix over the independent coordinates."""
        return np.asarray(self.full_mass_matrix(t, y)[np.ix_(self.free, self.free)])

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) accelerations from the equations of motion.

        Raises
        ------
        SimulationError
            The mass matrix is not positive definite; names the coordinate.
        """
        force = self.residual(t, y, v, np.zeros(self.size))
        mass = self.mass_matrix(t, y)
        try:
            return np.asarray(la.cho_solve(la.cho_factor(mass, check_finite=False), -force, check_finite=False))
        except la.LinAlgError:
            raise self._singular(t, mass) from None

    def _singular(self, t: float, mass: Array) -> SimulationError:
        values, vectors = np.linalg.eigh(mass)
        worst = self.free[int(np.abs(vectors[:, 0]).argmax())]
        name = (
            f"joint {self.mechanism.joints[worst].name!r}"
            if worst < self.joints
            else f"elastic coordinate {worst - self.joints + 1}"
        )
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
        stiffness = np.diag(np.concatenate([np.zeros(self.joints), self.stiffness]))
        damping = np.diag(np.concatenate([np.zeros(self.joints), self.damping]))
        if self.active_joints:
            theta, rates, _, q_d, qd_d, _ = self._expand(t, y, v, None)
            motion = self._motion(theta, rates, q_d, qd_d)
            for k in self.active_joints:
                joint = self.mechanism.joints[k]
                turn = self._turn(k, theta, rates, motion)
                passive = joint.forces.gains(turn.rate)
                active = joint.drive.gains_at(self._wanted(k, t, turn.angle, turn.rate))
                along = np.eye(len(stiffness))[k] if turn.gradient is None else turn.gradient
                stiffness += (passive[0] + active[0]) * np.outer(along, along)
                damping += (passive[1] + active[1]) * np.outer(along, along)
        pick = np.ix_(self.free, self.free)
        return stiffness[pick], damping[pick]

    def initial_state(self) -> tuple[Array, Array]:
        """(y, v) at time 0: the joints' initial angles and rates, links undeformed or in static equilibrium."""
        joints = self.mechanism.joints
        y, v = np.zeros(self.size), np.zeros(self.size)
        f = len(self.free_joints)
        y[:f] = [joints[k].position for k in self.free_joints]
        v[:f] = [joints[k].rate for k in self.free_joints]
        if self.mechanism.static_start:
            y = held_equilibrium(self, y, self.free_joints)
        return y, v

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles at a state."""
        theta, rates, _, q_d, qd_d, _ = self._expand(t, y, v, None)
        motion = self._motion(theta, rates, q_d, qd_d)
        turns = [self._turn(k, theta, rates, motion) for k in range(self.joints)]
        return State(
            time=t,
            poses=poses(self.mechanism, theta),
            modal=[motion.q[m] for m in self.compatibility.layout.modes],
            coordinates=theta,
            angles=np.array([turn.angle for turn in turns]),
            rates=np.array([turn.rate for turn in turns]),
        )

    def series(self, t: Array, y: Array, v: Array) -> StateSeries | None:
        """States at (k,) times; None where they are found one by one."""
        return chain_series(self, t, y, v)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state."""
        theta, rates, _, q_d, qd_d, _ = self._expand(t, y, v, None)
        motion = self._motion(theta, rates, q_d, qd_d)
        q, qd = motion.q, motion.qd
        chain = kinematics(self.mechanism, self.screws, theta, rates)
        kinetic = gravity = springs = 0.0
        for k, inertia in enumerate(self.inertia):
            modes = self.compatibility.layout.modes[k]
            kinetic += inertia.kinetic_energy(chain.twists[k], q[modes], qd[modes])
            gravity += inertia.gravity_energy(self.mechanism.gravity, chain.poses[k], q[modes])
        for k, joint in enumerate(self.mechanism.joints):
            turn = self._turn(k, theta, rates, motion)
            kinetic += 0.5 * joint.rotor_inertia * turn.rate**2
            springs += 0.5 * joint.forces.stiffness * (turn.angle - joint.forces.rest) ** 2
        return Energy(kinetic, float(0.5 * self.stiffness @ q_d**2), gravity, springs)

    def frames(self, t: float, y: Array, v: Array, ends: Sequence[LoopEnd]) -> list[FrameMotion]:
        """Frames on displaced nodes of links, with rows over (θ, q_d); see `TreeFormulation`."""
        theta, rates, driven, q_d, qd_d, _ = self._expand(t, y, v, None)
        motion = self._motion(theta, rates, q_d, qd_d)
        chain = kinematics(self.mechanism, self.screws, theta, rates)
        turning = jacobians(chain.transforms, self.screws)
        bias = self.compatibility.stack(motion.g @ driven + motion.n, np.zeros(self.elastic))
        result: list[FrameMotion] = []
        for k, node, offset in ((int(end.link or 0), end.node, end.frame) for end in ends):
            modes, at = self.compatibility.layout.modes[k], self.compatibility.layout.elastic_of[k]
            move = np.zeros((modes.stop - modes.start, self.joints + self.elastic))
            move[:6, : self.joints] = motion.g[6 * k : 6 * k + 6]
            move[:6, self.joints :] = motion.d[6 * k : 6 * k + 6]
            move[6:, self.joints + at.start : self.joints + at.stop] = np.eye(at.stop - at.start)
            model = self.mechanism.links[k].model
            shapes = node_shape6(model, node)
            second = self.mechanism.links[k].second_order if self.stiffened else None
            local = displaced_frame(
                model.nodes[node],
                *shapes,
                motion.q[modes],
                motion.qd[modes],
                bias[modes],
                move,
                None if second is None else second.node(node),
            )
            rows = np.hstack([turning[k], np.zeros((6, self.elastic))])
            link = FrameMotion(chain.poses[k], rows, chain.twists[k], chain.biases[k] + turning[k] @ driven)
            result.append(attached(carried(link, local), offset))
        return result

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions at a state."""
        return self.reactions_at(t, y, v, self.acceleration(t, y, v))

    def reactions_at(self, t: float, y: Array, v: Array, a: Array) -> list[Reaction]:
        """Joint reactions that give these accelerations."""
        found = self.evaluate(t, y, v, a)
        state = self.state(t, y, v)
        result: list[Reaction] = []
        for k, link in enumerate(self.mechanism.links):
            shape, _ = link.model.node_shape(link.inboard.node)
            wrench = moment_about(found.wrenches[k], link.inboard.position + shape @ state.modal[k])
            turn = state.poses[k][:3, :3]
            prescribed = self.mechanism.joints[k].drive.prescribed
            effort = found.residual[k] if prescribed else found.efforts[k]
            result.append(Reaction(turn @ wrench[:3], turn @ wrench[3:], float(effort)))
        return result

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        return {
            "formulation": "erls",
            "gauge": self.gauge,
            "joints": self.joints,
            "elastic_coordinates": self.elastic,
            "highest_frequency_hz": float(np.sqrt(self.stiffness.max(initial=0.0)) / (2 * np.pi)),
        }
