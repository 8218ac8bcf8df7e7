"""Nodal systems some of whose joints stick, or whose motors come to their limits (`erls.equations.switches.base`).

A joint that may stick has one condition more: its coordinate stays where it is. Such conditions come last, and are out
of use while the joint slides. Modes are looked for in what is stored of knots, of which joint coordinates are part;
there joints that stick have exactly no rate.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.equations.consistency import consistent_position, consistent_velocity
from erls.equations.nodal.actuators import Actuators
from erls.equations.nodal.chain import ChainSystem
from erls.equations.nodal.grips import contacts_of, nodal_grips
from erls.equations.nodal.joints import Joint, Motion
from erls.equations.nodal.nodes import Nodes
from erls.equations.switches.base import Switches
from erls.equations.switches.law import DryFriction, Freely, Settled, settle
from erls.equations.switches.motors import Acting, motors_among
from erls.equations.switches.shares import Shares, shared
from erls.equations.system import metre_scales
from erls.maths.saddle import Saddle, Scales
from erls.maths.so3 import Array
from erls.mechanism.joint_types import JOINT_TYPES
from fe_import.model import IntArray

_LEAST, _MOST, _RUBBING = 8, 9, 10  # columns of `Model.actuators`


def switching_joints(system: ChainSystem) -> IntArray:
    """Numbers of the actuators whose joints may stick."""
    joints = [joint for group in system.actuators for joint in group.joints]
    return np.array([k for k, joint in enumerate(joints) if joint.forces.sticks and not joint.drive.prescribed], int)


def dry_joints(system: ChainSystem) -> DryFriction:
    """Their friction; places are those of their coordinates in what is stored of a knot."""
    joints = [joint for group in system.actuators for joint in group.joints]
    numbers = switching_joints(system)
    forces = [joints[k].forces for k in numbers.tolist()]
    return DryFriction(
        places=12 * system.count + numbers,
        sliding=np.array([own.friction for own in forces]),
        static=np.array([own.static for own in forces]),
        names=tuple(joints[k].name for k in numbers.tolist()),
    )


class LockedSystem(ChainSystem):
    """A nodal system with the conditions of joints that may stick; what is asked of it in Python goes by its flags.

    Parameters
    ----------
    unlocked : ChainSystem
        Without them.

    Attributes
    ----------
    numbers : (m,) int array
        Actuators of these joints.
    held_at : (m,) array
        Coordinates at which they are held.
    """

    def __init__(self, unlocked: ChainSystem) -> None:
        self.unlocked, self.numbers = unlocked, switching_joints(unlocked)
        self.held_at = np.zeros(len(self.numbers))
        self._passive = unlocked.elements[: len(unlocked.elements) - len(unlocked.actuators)]
        joints = [*unlocked.rows.joints, *self._locks()]
        super().__init__(unlocked.start.poses, self._passive, unlocked.actuators, joints)
        self.arms = unlocked.arms
        self._first = unlocked.constraints
        self.held_at[:] = self.start.turned[self.numbers]
        self._signs = self._measured()
        self.switches = NodalSwitches(self)

    def _locks(self) -> list[Joint]:
        """Of each joint the condition that would fix it."""
        found: list[Joint] = []
        for (group, k), name in zip(_actuators(self.unlocked, self.numbers), self._names(), strict=True):
            kind = "revolute" if group.along[k] == 5 else "prismatic"
            kept = {condition.name for condition in JOINT_TYPES[kind].conditions}
            inner, outer = (int(node) for node in group.nodes[k])
            frames, motion = (group.inner_frames[k], group.outer_frames[k]), _held(self.held_at, len(found))
            found.append(Joint(name, kind, inner, outer, *frames, motion, left_out=frozenset(kept)))
        return found

    def _names(self) -> list[str]:
        return [group.joints[k].name for group, k in _actuators(self.unlocked, self.numbers)]

    def settled(self, t: float, y: Array, v: Array) -> Settled:
        """What the law says of a knot by what is stored of it, all vibrations taken into account."""
        self.switches.seen_by = 0.0
        return self.switches.settled(t, y, v, np.zeros(len(self.numbers)))

    def frozen(self, found: Settled, q: Nodes) -> ChainSystem:
        """Without locks: joints that stick are held where they are, others rub as they do."""
        places, rows, held = q.turned[self.numbers[found.held]], self.unlocked.rows, found.held.tolist()
        locks = [replace(self.rows.joints[len(rows.joints) + k], motion=_held(places, i)) for i, k in enumerate(held)]
        system = ChainSystem(self.unlocked.start.poses, self._passive, self.actuators, [*rows.joints, *locks])
        system.model.actuators[self.numbers, _RUBBING] = -found.modes * self.switches.rubbing.sliding
        return system

    def _measured(self) -> Array:
        """(m,) 1 or -1: by which the conditions change as the coordinates grow."""
        v = np.random.default_rng(0).normal(size=self.size)
        rates = self.joint_motion(self.start, v, np.zeros(self.size))[1][self.numbers]
        return np.sign(np.asarray(self.constraint_matrix(0.0, self.start)[self._first :] @ v) * rates)

    def along(self, t: float, q: Nodes) -> Array:
        """(m, n) rates of the joint coordinates over the velocities."""
        flags, places = self.model.released.copy(), self.held_at.copy()
        self.model.released[:] = 0.0
        self.hold(q.turned[self.numbers])
        rows = self.constraint_matrix(t, q)[self._first :]
        self.model.released[:] = flags
        self.hold(places)
        return np.asarray(self._signs[:, None] * (rows if isinstance(rows, np.ndarray) else rows.toarray()))

    def outward(self, t: float, q: Nodes) -> Array:
        """(m, 6) wrench on the outer node, in its axes, of a unit of friction in each joint."""
        rows = self.along(t, q).reshape(len(self.numbers), self.count, 6)
        outer = [int(group.nodes[k, 1]) for group, k in _actuators(self.unlocked, self.numbers)]
        return rows[np.arange(len(rows)), outer]

    def hold(self, places: Array) -> None:
        """Where joints are held."""
        self.held_at[:] = places
        self._sampled, self._tied = np.nan, (np.nan, None, ())

    def friction_of(self, multipliers: Array) -> Array:
        """(m,) friction, of the multipliers of their conditions; the other way by the same signs."""
        return np.asarray(-self._signs * multipliers)

    def driven(self, t: float, q: Nodes, v: Array) -> tuple[Array, Array]:
        """Accelerations and multipliers with the present modes."""
        return self.switches.driven(t, q, v)


def _held(places: Array, k: int) -> Motion:
    return lambda t: (float(places[k]), 0.0, 0.0)


def _actuators(system: ChainSystem, numbers: IntArray) -> list[tuple[Actuators, int]]:
    firsts = np.cumsum([0, *(len(group.joints) for group in system.actuators)])
    groups = np.searchsorted(firsts, numbers, side="right") - 1
    return [(system.actuators[g], int(k - firsts[g])) for g, k in zip(groups.tolist(), numbers.tolist(), strict=True)]


class NodalSwitches(Switches):
    """Modes of a nodal system, at what is stored of its knots.

    Parameters
    ----------
    system : LockedSystem
    """

    sees = True

    def __init__(self, system: LockedSystem) -> None:
        self._system, self._free = system, system.unlocked
        joints = [joint for group in system.actuators for joint in group.joints]
        own = np.arange(len(joints))
        motors = motors_among([j.drive for j in joints], [j.name for j in joints], Acting(own, own))
        stored = 12 * system.count + len(joints)
        super().__init__(dry_joints(system), motors, stored)
        self.grips = nodal_grips(system)
        self._first = 3 * len(system.rows.joints) + len(system.kinds.loads.loads)  # of the samples of actuators

    def asked(self, t: Array, y: Array, v: Array) -> Array:
        """See `Switches`: the controllers' law, at coordinates as they are stored."""
        if not len(self.motors.limits):
            return np.zeros((len(t), 0))
        numbers = self.motors.acting.joints
        at, first = 12 * self._system.count + numbers, self._first + 3 * numbers
        samples, law = self._system.samples(t), self._system.model.actuators[numbers]
        goal, rate, lead = (samples[:, first + k] for k in range(3))
        return np.asarray(lead + law[:, 6] * (goal - y[:, at]) + law[:, 7] * (rate - v[:, at]))

    def put(self, y: Array) -> None:
        """Into the constants of the system."""
        system, rubs = self._system, len(self.rubbing.places)
        laws, released = system.model.actuators, system.model.released
        laws[system.numbers, _RUBBING] = -self.modes[:rubs] * self.rubbing.sliding
        for mode, limit, k in zip(self.modes[rubs:], self.motors.limits, self.motors.acting.joints, strict=True):
            laws[k, _LEAST], laws[k, _MOST] = (-np.inf, np.inf) if mode == 0.0 else (mode * limit, mode * limit)
        system.hold(y[self.rubbing.places])
        released[len(released) - rubs :] = 1.0
        released[len(released) - rubs :][np.isin(self.rubbing.places, self.fixed)] = 0.0

    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """See `Switches`: accelerations are those of the nodes' twists (n,), then multipliers."""
        with contacts_of(self._free, self._system):
            return self._freely(t, *self._free.from_stored(y, v))

    def _freely(self, t: float, q: Nodes, v: Array) -> Freely:
        """Of (M + β h² K) a + Bᵀ λ = f: as steps see it. What vibrates faster is left as it is."""
        free, along, n = self._free, self._system.along(t, q), self._free.size
        still, none = np.zeros(n), np.zeros(free.constraints)
        rows, mass = free.constraint_matrix(t, q), free.mass_matrix(t, q)
        metres = metre_scales(free)
        stiffness, _ = free.stiffness_and_damping(t, q, v, still, none)
        saddle = Saddle(mass + self.seen_by * stiffness, rows.T, rows, Scales(metres, mass, rows), 1.0)

        def solved(forces: Array, bias: Array) -> Array:
            return np.concatenate(saddle.unscaled(saddle.solve(saddle.scaled(forces, bias))))

        whole = solved(-free.residual(t, q, v, still), -free.constraint_bias(t, q, v))
        answers = np.array([solved(row, none) for row in along]).reshape(len(along), len(whole)).T
        moves = free.joint_motion(q, v, whole[:n])[2][self._system.numbers]
        compliance = along @ answers[:n]
        compliance = (compliance + compliance.T) / 2
        return Freely(whole, answers, moves, compliance, compliance.diagonal())

    def settled(self, t: float, y: Array, v: Array, released: Array) -> Settled:
        """See `Switches`."""
        return settle(self.freely(t, y, v), v[self.rubbing.places], self.rubbing, released)

    def seen(self, knots: Array, beside: Array) -> Array:
        """See `Switches`."""
        result, rubs = knots.copy(), len(self.rubbing.places)
        if rubs:
            result[:, 2, self.rubbing.places] = self._system.friction_of(beside[:, beside.shape[1] - rubs :])
        return result

    def seen_at_start(self, knot: Array) -> Array:
        """See `Switches`."""
        knot[2, self.rubbing.places] = np.nan
        return knot

    def holding_at(self, t: float, y: Array, v: Array, a: Array) -> Shares:
        """See `Switches`."""
        given, modes = a[self.rubbing.places], self.modes[: len(self.rubbing.places)]
        rest, fixed = np.flatnonzero(modes == 0.0), np.isin(self.rubbing.places, self.fixed)
        if len(rest) == np.count_nonzero(fixed):
            shares = np.abs(given[rest]) / self.rubbing.static[rest]
            return Shares(given[rest], -np.sign(np.where(shares >= shares.max(initial=0.0), given[rest], 0.0)))
        free = self.freely(t, y, v)
        own, pushed = free.compliance[np.ix_(rest, rest)], free.compliance[np.ix_(rest, fixed)] @ given[fixed]
        return shared(own, -pushed, self.rubbing.static[rest], free.alone[rest])

    def _present(self, free: Freely) -> tuple[Array, Array]:
        """Accelerations and multipliers (n + m,) with the present modes, and friction (m,)."""
        modes = self.modes[: len(self.rubbing.places)]
        given = -modes * self.rubbing.sliding
        held = np.flatnonzero(np.isin(self.rubbing.places, self.fixed))
        rest = (free.along + free.compliance @ given)[held]
        given[held] = -np.linalg.solve(free.compliance[np.ix_(held, held)], rest)
        return free.accelerations + free.answers @ given, given

    def driven(self, t: float, q: Nodes, v: Array) -> tuple[Array, Array]:
        """Accelerations (n,) and all multipliers; those out of use tell the friction of joints that slide, too."""
        with contacts_of(self._free, self._system):
            found, given = self._present(self._freely(t, q, v))
        n = self._free.size
        return found[:n], np.concatenate([found[n:], self._system.friction_of(given)])

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """See `Switches`."""
        return np.asarray(self.knot(t, y, v)[0][2])

    def knot(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """See `Switches`: accelerations and multipliers are kept beside."""
        q, twists = self._free.from_stored(y, v)
        a, multipliers = self.driven(t, q, twists)
        knot = np.array([y, v, self._free.stored(t, q, twists, a)[2]])
        self.quiet(knot[None])
        return knot, np.concatenate([a, multipliers])

    def quiet(self, knots: Array) -> None:
        """Joints at rest have no rate and no acceleration."""
        knots[:, 1:, self.still] = 0.0

    def holding(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """See `Switches`."""
        result, rest = np.zeros((len(t), len(self.rubbing.places))), self.modes[: len(self.rubbing.places)] == 0.0
        for k, at in enumerate(t.tolist()):
            result[k, rest] = self.holding_at(at, y[k], v[k], a[k]).forces
        return result

    def closed(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """See `Switches`: joints closed, which interpolation leaves open."""
        q, twists = self._free.from_stored(y, v)
        q, _ = consistent_position(self._free, t, q)
        twists = consistent_velocity(self._free, t, q, twists)
        place, rate, _ = self._free.stored(t, q, twists, np.zeros(self._free.size))
        place[self.still], rate[self.still] = y[self.still], 0.0
        return place, rate

    def pushed(self, t: float, y: Array, v: Array, change: Array) -> Array:
        """See `Switches`."""
        q, twists = self._free.from_stored(y, v)
        return self._free.stored(t, q, twists + change[: self._free.size], np.zeros(self._free.size))[1]
