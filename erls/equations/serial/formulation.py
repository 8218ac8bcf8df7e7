"""What formulations of a tree of links in independent coordinates share: coordinates, and calls of what is compiled.

Independent coordinates y = (free joint coordinates, elastic coordinates of all links); prescribed joint coordinates
follow from time.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy.linalg as la

from erls.equations.compiled_system import CompiledSystem
from erls.equations.formulation import ContactSeries, FrameMotion, Reaction, TreeFormulation
from erls.equations.linearization import Linearization
from erls.equations.neighbours import small_motions
from erls.equations.serial.contacts import ENERGY, contact_states
from erls.equations.serial.equilibrium import Held, equilibrium, held_tree, size_of
from erls.equations.serial.loads import load_powers
from erls.equations.serial.neighbours import TreeNeighbours
from erls.equations.serial.records import JOINT_STATE, JointState, Serial
from erls.equations.serial.singular import singular_mass
from erls.equations.serial.state_series import ReactionSeries, inboard_place, state_series
from erls.equations.series import mass_series, places_within, residual_series, residuals_leaving
from erls.equations.stability import Bearing, Stability, stability_of, tumbling
from erls.equations.switches.gripped import grips_in, lent
from erls.equations.switches.grips import NO_GRIPS, Grips
from erls.equations.switches.law import DryFriction, Freely, dry_friction, settled
from erls.equations.system import metre_scales
from erls.maths.records import python_reader
from erls.maths.se3 import pose
from erls.maths.so3 import Array, cross_all
from erls.mechanism.chain import Mechanism
from erls.mechanism.loops import loop_ends
from erls.mechanism.thermal import elastic_rest

_see_serial, _see_joint = python_reader(Serial), python_reader(JointState)


class SerialFormulation(TreeFormulation):
    """A `TreeFormulation` whose equations are compiled.

    Parameters
    ----------
    mechanism : Mechanism

    Attributes
    ----------
    elastic : int
        Elastic coordinates of all links.
    stiffness, damping, rest : (elastic,) arrays
        Of the elastic coordinates; what they are without load.
    """

    along_coordinates: ClassVar[bool] = True

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.joints = len(mechanism.joints)
        self.elastic = sum(link.elastic_modes for link in mechanism.links)
        prescribed = np.array([joint.drive.prescribed for joint in mechanism.joints], dtype=bool)
        self.free_joints, self.prescribed_joints = np.flatnonzero(~prescribed), np.flatnonzero(prescribed)
        self.free = np.concatenate([self.free_joints, self.joints + np.arange(self.elastic)])
        self.stiffness = np.concatenate([link.stiffness for link in mechanism.links])
        self.damping = np.concatenate([link.damping for link in mechanism.links])
        self.rest = np.concatenate([elastic_rest(link) for link in mechanism.links])

    @property
    @abstractmethod
    def compiled(self) -> CompiledSystem:
        """The equations."""

    @cached_property
    def dry(self) -> DryFriction | None:
        """Friction that sticks, which the compiled equations leave out; None without any."""
        return dry_friction(self.mechanism, self.free_joints)

    @property
    def size(self) -> int:
        """Number of independent coordinates."""
        return len(self.free)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of all drives and loads."""
        return self.mechanism.breakpoints

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) forces out of balance on the independent coordinates; friction that sticks is left out."""
        return residual(self.compiled, t, y, v, a)

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) mass matrix over the independent coordinates."""
        system, out = self.compiled, np.empty((self.size, self.size))
        system.mass_matrix(system.reals, system.integers, system.scratch, t, contiguous(y), out)
        return out

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """Modal stiffness and damping, joint springs, dampers, friction and controller gains."""
        system, both = self.compiled, np.empty((2, self.size, self.size))
        system.stiffness_and_damping(
            system.reals, system.integers, system.scratch, t, contiguous(y), contiguous(v), both[0], both[1]
        )
        return both[0], both[1]

    def elastic_energy(self, q: Array) -> float:
        """Of elastic coordinates [J]."""
        return float(self.stiffness @ (q - self.rest) ** 2 / 2)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) accelerations from the equations of motion.

        Raises
        ------
        SimulationError
            The mass matrix is not positive definite; names the coordinate.
        """
        with self.gripped(t, y, v):
            if self.dry is not None:
                return settled(self, t, y, v).accelerations
            return self._solver(t, y)(-self.residual(t, y, v, np.zeros(0)))

    @cached_property
    def grips(self) -> Grips:
        """Modes of contacts whose points may stick, which are not known but meanwhile."""
        return grips_in(self.mechanism, self.compiled, self.compiled.residual) if self.mechanism.grips else NO_GRIPS

    def gripped(self, t: float, y: Array, v: Array) -> AbstractContextManager[None]:
        """Meanwhile contacts have the modes that follow from a state."""
        return self.grips.settled(t, y, v, self.acceleration)

    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """A state without friction that sticks; see `erls.equations.switches.law`.

        Raises
        ------
        SimulationError
            As `acceleration`.
        """
        assert self.dry is not None
        places = self.dry.places
        both = np.zeros((self.size, 1 + len(places)))
        both[:, 0] = -self.residual(t, y, v, np.zeros(0))
        both[places, 1 + np.arange(len(places))] = 1.0
        both = self._solver(t, y)(both)
        compliance = both[places, 1:]
        return Freely(both[:, 0], both[:, 1:], both[places, 0], compliance, compliance.diagonal())

    def _solver(self, t: float, y: Array) -> Callable[[Array], Array]:
        """M⁻¹ of forces."""
        mass = self.mass_matrix(t, y)
        try:
            factor = la.cho_factor(mass, check_finite=False)
        except la.LinAlgError:
            raise singular_mass(self, t, mass, self.elastic_name) from None
        return lambda forces: np.asarray(la.cho_solve(factor, forces, check_finite=False))

    def acceleration_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, n) accelerations at k times, solved for together.

        Raises
        ------
        SimulationError
            As `acceleration`.
        """
        switches = self.dry is not None or self.mechanism.grips
        forces = residual_series(self.compiled, t, y, v, np.zeros((len(t), 0)))
        masses = mass_series(self.compiled, t, y)
        try:
            lower = None if switches else np.linalg.cholesky(masses)
        except np.linalg.LinAlgError:  # one of them: the method for one names what is wrong with it
            lower = None
        if lower is None:
            return np.array([self.acceleration(*at) for at in zip(t.tolist(), y, v, strict=True)]).reshape(y.shape)
        half = np.linalg.solve(lower, -forces[..., None])
        return np.asarray(np.linalg.solve(lower.swapaxes(1, 2), half)[..., 0])

    def load_power(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) power of loads, and what contacts lose, at times (k,) [W]."""
        system, result = self.compiled, np.zeros(len(t))
        if not self.mechanism.acted_on:
            return result
        powers = load_powers(system, _see_serial(system.reals, system.integers, int(system.integers[0])))
        for k, at in enumerate(t.tolist()):
            residual(system, at, y[k], v[k], np.zeros(0))
            result[k] = sum(float(power[0]) for power in powers)
        return result

    def contact_series(self, t: Array, y: Array, v: Array) -> ContactSeries:
        """Contacts at times (k,)."""
        system, known = self.compiled, np.zeros((len(t), len(self.mechanism.contacts), 10))
        if known.size:
            states = contact_states(system)
            for k, at in enumerate(t.tolist()):
                with self.gripped(at, y[k], v[k]):
                    residual(system, at, y[k], v[k], np.zeros(0))
                known[k] = [[*x.known[:3], *x.force, *x.point[9:], x.known[ENERGY]] for x in states]
        return ContactSeries.of(known)

    def contact_energy(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) elastic energy of all contacts [J]."""
        return np.asarray(self.contact_series(t, y, v).energy.sum(axis=1))

    def elastic_name(self, place: int) -> str:
        """What messages call an elastic coordinate, by its place among them."""
        return f"elastic coordinate {place + 1}"

    def undeformed_start(self) -> tuple[Array, Array]:
        """(y, v) at time 0: the joints' initial angles and rates, links undeformed."""
        y, v = np.zeros((2, self.size))
        for place, k in enumerate(self.free_joints):
            y[place], v[place] = self.mechanism.joints[k].position, self.mechanism.joints[k].rate
        return y, v

    def initial_state(self) -> tuple[Array, Array]:
        """(y, v) at time 0: the joints' initial angles and rates, links undeformed or in static equilibrium."""
        y, v = self.undeformed_start()
        return (self._static[0].copy() if self.mechanism.static_start else y), v

    @cached_property
    def _static(self) -> tuple[Array, Bearing]:
        """Static equilibrium with the joints held, and what loads leave of the stiffness."""
        return equilibrium(self.held, self.undeformed_start()[0])

    @property
    def held(self) -> Held:
        """The mechanism at rest with its joints held."""
        return held_tree(self, self.undeformed_start()[0], self.free_joints)

    def neighbours(self, t: float, y: Array, v: Array) -> TreeNeighbours:
        """States beside one, with the accelerations of the equations of motion."""
        if self.dry is None:
            return TreeNeighbours(self, t, y, v, self.acceleration(t, y, v))
        found = settled(self, t, y, v)
        stuck = tuple(self.dry.places[found.modes == 0.0].tolist())
        return TreeNeighbours(self, t, y, v, found.accelerations, stuck)

    def linearized(self, t: float, y: Array, v: Array) -> Linearization:
        """Small motions about a state, with the accelerations of the equations of motion; joints that stick rest."""
        return small_motions(self.neighbours(t, y, v))

    @cached_property
    def stability(self) -> Stability:
        """Of the static start."""
        y, v = self.initial_state()
        a, size = self.acceleration(0.0, y, v), size_of(self.mechanism)
        motions = None if tumbling(self.mechanism, v) else self.linearized(0.0, y, v)
        return stability_of(self._static[1], motions, a, metre_scales(self), size)

    def frames(self, t: float, y: Array, v: Array) -> list[FrameMotion]:
        """Frames that the loops of the mechanism hold; see `TreeFormulation`."""
        system, ends = self.compiled, loop_ends(self.mechanism.loops)
        if not ends:
            return []
        assert system.frames is not None
        found = np.empty((len(ends), 24 + 6 * (self.joints + self.elastic)))
        system.frames(system.reals, system.integers, system.scratch, t, contiguous(y), contiguous(v), found)
        result: list[FrameMotion] = []
        for numbers in found:
            rows = np.empty((6, self.joints + self.elastic))
            rows[:, [*self.free, *self.prescribed_joints]] = numbers[24:].reshape(rows.shape)
            at = pose(numbers[:9].reshape(3, 3), numbers[9:12])
            result.append(FrameMotion(at, rows, numbers[12:18], numbers[18:24]))
        return result

    @property
    def complete(self) -> CompiledSystem:
        """The equations with wrenches that are complete in all components, for reactions."""
        return self.compiled

    @abstractmethod
    def borne(self) -> list[tuple[Array, Array, Array]]:
        """Views of what a residual of `complete` leaves of each link: the wrench (6,) on its frame of all that it
        bears, itself included; the force (1,) along its joint, and what of it (1,) drive, spring, damper and friction
        give.
        """

    def reaction_series(self, t: Array, y: Array, v: Array, a: Array | None = None) -> ReactionSeries:
        """Joint reactions at times (k,) that give accelerations (k, n), those of the equations of motion unless given.
        """
        a = self.acceleration_series(t, y, v) if a is None else a
        states, count = state_series(self, t, y, v), len(self.mechanism.joints)
        left = self.left_by_residuals([view for views in self.borne() for view in views], t, y, v, a)
        force, moment, effort = np.empty((len(t), count, 3)), np.empty((len(t), count, 3)), np.empty((len(t), count))
        for k, (link, joint) in enumerate(zip(self.mechanism.links, self.mechanism.joints, strict=True)):
            wrench, whole, given = left[3 * k : 3 * k + 3]
            place = inboard_place(link, states.modal[k])
            turn, push = states.poses[k][:, :3, :3], wrench[:, :3]
            force[:, k] = np.einsum("tij,tj->ti", turn, push)
            moment[:, k] = np.einsum("tij,tj->ti", turn, wrench[:, 3:] - cross_all(place, push))
            effort[:, k] = (whole if joint.drive.prescribed else given)[:, 0]
        if self.dry is not None:
            joints = self.free_joints[self.dry.places]
            effort[:, joints] += self.dry.given(v, np.column_stack([left[3 * k + 1] for k in joints.tolist()]))
        return ReactionSeries(force, moment, effort)

    def joint_accelerations(self) -> list[Array]:
        """Views (1,) of what a residual of `complete` leaves of each joint."""
        reals, integers, scratch = self.complete.reals, self.complete.integers, self.complete.scratch
        first = _see_serial(reals, integers, int(integers[0])).joint_states
        return [_see_joint(scratch, integers, first + k * JOINT_STATE).coordinate[2:] for k in range(self.joints)]

    def left_by_residuals(self, views: Sequence[Array], t: Array, y: Array, v: Array, a: Array) -> list[Array]:
        """(k, ...) what residuals of `complete` at times (k,) leave in each of some views of its working memory."""
        places = None if self.grips.names else places_within(self.complete.scratch, views)
        if places is not None:
            memory = self.complete.reals, self.complete.integers, self.complete.scratch
            left = residuals_leaving(self.complete.residual, *memory, t, y, v, places, a)
            parts = np.split(left, np.cumsum([view.size for view in views])[:-1], axis=1)
            return [part.reshape(len(t), *view.shape) for part, view in zip(parts, views, strict=True)]
        result = [np.empty((len(t), *view.shape)) for view in views]
        for i, at in enumerate(t.tolist()):
            with self.gripped(at, y[i], v[i]), lent(self.grips, self.mechanism, self.complete):
                residual(self.complete, at, y[i], v[i], a[i])
            for found, view in zip(result, views, strict=True):
                found[i] = view
        return result

    def reactions_at(self, t: float, y: Array, v: Array, a: Array) -> list[Reaction]:
        """Joint reactions that give these accelerations."""
        return self.reaction_series(np.array([t]), y[None], v[None], a[None]).reactions(0)

    @property
    @abstractmethod
    def kind(self) -> dict[str, Any]:
        """Name of the formulation and of its variant, for reports."""

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        return {
            **self.kind,
            "joints": self.joints,
            "elastic_coordinates": self.elastic,
            "highest_frequency_hz": float(np.sqrt(self.stiffness.max(initial=0.0)) / (2 * np.pi)),
        }

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions at a state."""
        return self.reactions_at(t, y, v, self.acceleration(t, y, v))


def contiguous(x: Array) -> Array:
    """As compiled functions take it."""
    return np.ascontiguousarray(x, dtype=float)


def residual(system: CompiledSystem, t: float, y: Array, v: Array, a: Array) -> Array:
    """(n,) forces out of balance; its records stay in the system's working memory."""
    out = np.empty(system.size)
    system.residual(system.reals, system.integers, system.scratch, t, contiguous(y), contiguous(v), contiguous(a), out)
    return out
