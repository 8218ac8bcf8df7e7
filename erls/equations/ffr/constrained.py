"""FFR in absolute coordinates: floating frames and elastic coordinates, joints as constraints with multipliers.

    M(q) a = f(t, q, v) - B(t, q)ᵀ λ,   Φ(t, q) = 0

A configuration holds the frames as matrices; velocities are their twists, in their own axes, and η̇. The same standard
data as in `Ffr`, without its velocity transformation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.ffr.formulation import Ffr, body_moments
from erls.equations.formulation import Energy, Reaction, State
from erls.equations.serial.contacts import ENERGY, contact_states
from erls.equations.system import metre_scales
from erls.maths import motion_maps
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array, cross

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops
    from erls.equations.loops.rows import Closure
    from erls.equations.stepped import Stepped


@dataclass(frozen=True)
class Configuration:
    """Floating frames in the world, (links, 4, 4); η of all links; joint angles, which count whole turns."""

    poses: Array
    eta: Array
    angles: Array


class ConstrainedFfr:
    """Constrained equations of motion of a tree of links; a `ConstrainedSystem`.

    Parameters
    ----------
    reduced : Ffr
        The same mechanism in independent coordinates: its links, its floating frames, its start.
    """

    def __init__(self, reduced: Ffr) -> None:
        self.reduced, self.mechanism, self.modes = reduced, reduced.mechanism, reduced.modes
        self.links = len(self.mechanism.links)
        self.twists = [slice(6 * k, 6 * k + 6) for k in range(self.links)]  # within v
        self.elastic = slice(6 * self.links, 6 * self.links + reduced.elastic)

    @cached_property
    def tied(self) -> CompiledLoops:
        """The equations."""
        from erls.equations.ffr.absolute import pack_absolute  # here: it imports the compiler

        return pack_absolute(self.reduced.given, metre_scales(self))

    @property
    def compiled(self) -> Stepped:
        """The same as steps take it."""
        from erls.equations.ffr.absolute import stepped

        return stepped(self.tied, self._packed, self._unpacked)

    def _packed(self, q: Configuration) -> Array:
        """Numbers of a configuration, see `erls.equations.ffr.floating`."""
        poses = np.concatenate([q.poses[:, :3, :3].reshape(self.links, 9), q.poses[:, :3, 3]], axis=1)
        return np.concatenate([poses.ravel(), q.eta, q.angles])

    def _unpacked(self, numbers: Array) -> Configuration:
        poses, ends = numbers[: 12 * self.links].reshape(self.links, 12), 12 * self.links + self.reduced.elastic
        world = [pose(found[:9].reshape(3, 3), found[9:]) for found in poses]
        return Configuration(np.stack(world), numbers[12 * self.links : ends].copy(), numbers[ends:].copy())

    def _closure(self, t: float, q: Configuration, v: Array) -> Closure:
        return self.tied.closure(t, self._packed(q), v)

    @property
    def size(self) -> int:
        """Number of velocity coordinates."""
        return self.elastic.stop

    @property
    def constraints(self) -> int:
        """Number of constraints."""
        return self.tied.conditions

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Joint and direction of each constraint."""
        return tuple(f"joint{name.removeprefix('loop')}" for name in self.tied.given.rows.names)

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
        from erls.equations.ffr import absolute

        system, out = self.tied, np.empty(len(self._packed(q)))
        absolute.compose(
            system.reals, system.integers, system.scratch, self.length_scales, self._packed(q), increment, out
        )
        efforts = self.tied.closure(0.0, out, np.zeros(self.size)).efforts
        return replace(self._unpacked(out), angles=np.array([effort.coordinate for effort in efforts]))

    def tangent(self, increment: Array) -> Array:
        """(n, n) variation of q ∘ exp(increment) per variation of the increment."""
        result = np.eye(self.size)
        blocks = motion_maps.tangent(increment[: self.elastic.start].reshape(-1, 6))
        for at, block in zip(self.twists, blocks, strict=True):
            result[at, at] = block
        return result

    def residual(self, t: float, q: Configuration, v: Array, a: Array) -> Array:
        """(n,) M a - f, without the forces of the constraints."""
        return self.tied.forces(t, self._packed(q), v, a)

    def mass_matrix(self, t: float, q: Configuration) -> Array:
        """(n, n) symmetric, positive semi-definite."""
        return self.tied.masses(t, self._packed(q))

    def stiffness_and_damping(
        self, t: float, q: Configuration, v: Array, a: Array, multipliers: Array
    ) -> tuple[Array, Array]:
        """Modal stiffness and damping, joint springs, dampers, friction and controller gains."""
        return self.tied.matrices(t, self._packed(q), v)

    def constraint(self, t: float, q: Configuration) -> Array:
        """(m,) Φ: misalignment of the joint frames [m, rad]."""
        return self._closure(t, q, np.zeros(self.size)).violation

    def constraint_matrix(self, t: float, q: Configuration) -> Array:
        """(m, n) B."""
        return self._closure(t, q, np.zeros(self.size)).rows

    def constraint_rate(self, t: float, q: Configuration) -> Array:
        """(m,) Φ_t."""
        return self._closure(t, q, np.zeros(self.size)).rate

    def constraint_bias(self, t: float, q: Configuration, v: Array) -> Array:
        """(m,) Φ̈ - B a."""
        return self._closure(t, q, v).bias

    def stored(self, t: float, q: Configuration, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Rotation matrix and position of every frame, η, joint angles; with first and second derivatives."""
        from erls.equations.ffr import absolute

        system, numbers = self.tied, self._packed(q)
        knot = np.empty((3, len(numbers)))
        absolute.settle(system.reals, system.integers, system.scratch, t, numbers, v, a, knot)
        return knot[0], knot[1], knot[2]

    def places(self, stored: Array) -> Array:
        """(k, 4 links + elastic, 3) of the frames, of the ends of their axes at the distance of the farthest node, and
        how far each elastic coordinate moves a node.
        """
        k, ends = len(stored), 12 * self.links
        frames = stored[:, :ends].reshape(k, self.links, 4, 3)
        reach = np.array([self.length_scales[at][3] for at in self.twists])[:, None, None]
        axes = frames[:, :, :3].swapaxes(2, 3) * reach + frames[:, :, 3:]
        moved = np.zeros((k, self.reduced.elastic, 3))
        moved[..., 0] = stored[:, ends : ends + self.reduced.elastic] * self.length_scales[self.elastic]
        return np.concatenate([frames[:, :, 3], axes.reshape(k, -1, 3), moved], axis=1)

    def from_stored(self, stored: Array, rate: Array) -> tuple[Configuration, Array]:
        """Configuration and velocity from what `stored` gives, interpolated or not; rotations made orthogonal."""
        poses, velocity = [], np.empty(self.size)
        for k, at in enumerate(self.twists):
            entries, x = stored[12 * k : 12 * k + 9].reshape(3, 3), stored[12 * k + 9 : 12 * k + 12]
            left, _, right = np.linalg.svd(entries)
            turn = left @ right
            turning = turn.T @ rate[12 * k : 12 * k + 9].reshape(3, 3)
            velocity[at][:3] = turn.T @ rate[12 * k + 9 : 12 * k + 12]
            velocity[at][3:] = (turning - turning.T)[[2, 0, 1], [1, 2, 0]] / 2
            poses.append(pose(turn, x))
        ends = 12 * self.links, 12 * self.links + self.reduced.elastic
        velocity[self.elastic] = rate[ends[0] : ends[1]]
        return Configuration(np.stack(poses), stored[ends[0] : ends[1]], stored[ends[1] :]), velocity

    def state(self, t: float, q: Configuration, v: Array) -> State:
        """Floating frames, modal coordinates and joint angles, as in `Ffr`."""
        modal = [basis @ q.eta[at] for basis, at in zip(self.reduced.bases, self.modes, strict=True)]
        rates = np.array([effort.rate for effort in self._closure(t, q, v).efforts])
        return State(t, list(q.poses), modal, q.angles, q.angles, rates)

    def energy(self, t: float, q: Configuration, v: Array) -> Energy:
        """Energies of a state."""
        kinetic = float(v @ self.mass_matrix(t, q) @ v) / 2
        self.residual(t, q, v, np.zeros(0))
        gravity = 0.0
        for world, (mass, moment) in zip(q.poses, body_moments(self.tied, self.links), strict=True):
            gravity -= float(self.mechanism.gravity @ (mass * world[:3, 3] + world[:3, :3] @ moment))
        springs = sum(
            joint.forces.energy(float(angle))
            for joint, angle in zip(self.mechanism.joints, q.angles, strict=True)
        )
        springs += sum(float(contact.known[ENERGY]) for contact in contact_states(self.tied))
        return Energy(kinetic, self.reduced.elastic_energy(q.eta), gravity, float(springs))

    def reactions(self, t: float, q: Configuration, v: Array, a: Array, multipliers: Array) -> list[Reaction]:
        """Joint reactions from multipliers, forces and rotors, at the displaced inboard nodes."""
        found, loops = self._closure(t, q, v), self.tied.given.rows.loops
        result: list[Reaction] = []
        wrenches = self.tied.given.rows.wrenches(found, multipliers)
        for k, (loop, wrench, outer, acts) in enumerate(zip(loops, wrenches, found.outer, found.efforts, strict=True)):
            assert loop.freedom is not None
            along = loop.freedom.freedom.row
            effort = float(loop.freedom.freedom.screw @ wrench) if loop.prescribed else acts.force
            turning = float(found.moves[k][along] @ a) + acts.turning
            wrench[along] += acts.force - loop.freedom.rotor_inertia * turning
            arm, turn = inverse(loop.outer.frame)[:3, 3], outer[:3, :3]  # of the node, in the joint frame
            result.append(Reaction(turn @ wrench[:3], turn @ (wrench[3:] - cross(arm, wrench[:3])), effort))
        return result
