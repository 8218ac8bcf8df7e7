"""The nodal formulation: geometrically exact beams, shells and rigid bodies on SE(3), tied by joints with multipliers.

V. Sonneville, A. Cardona, O. Brüls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451–474. It holds for any deflection
and knows nothing of modes. y holds position and rotation matrix of every node and the joint coordinates, then what the
integrator found with them: the rates of the nodes' twists and the multipliers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from typing import Any

import numpy as np

from erls.equations.consistency import consistent_acceleration, consistent_velocity
from erls.equations.formulation import ContactSeries, Energy, LoopForce, Reaction, State
from erls.equations.loops.closed_start import ClosedStart
from erls.equations.loops.failures import warnings_of
from erls.equations.neighbours import small_motions
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.chain import Chain, build_chain
from erls.equations.nodal.grips import nodal_grips
from erls.equations.nodal.link_motion import nodal_motion
from erls.equations.nodal.link_state import LinkView
from erls.equations.nodal.locks import LockedSystem, dry_joints
from erls.equations.nodal.neighbours import NodalNeighbours, names_of_nodes, nodal_neighbours
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.parts import BeamRules, LinkParts, link_parts
from erls.equations.nodal.redundant import smallest_multipliers
from erls.equations.nodal.resting import Resting, resting
from erls.equations.nodal.scatter import IntArray
from erls.equations.nodal.seat import Seat
from erls.equations.nodal.shell_stress import link_stress
from erls.equations.nodal.spinning import SpinningNeighbours, spinning_neighbours
from erls.equations.nodal.start import carried_along
from erls.equations.serial.equilibrium import size_of
from erls.equations.serial.motion_series import MotionSeries
from erls.equations.serial.state_series import StateSeries
from erls.equations.stability import LARGEST, Stability, stability_of
from erls.equations.switches.grips import Grips
from erls.equations.switches.law import DryFriction
from erls.maths import rotation_maps as rotations
from erls.maths.saddle import Matrix
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Mechanism


class Nodal:
    """Equations of motion of a tree of links, loops closed; a `LoopFormulation`.

    Parameters
    ----------
    mechanism : Mechanism
    elements_per_member : int, optional
        Instead of the numbers in the descriptions of the links.
    start : ClosedStart, optional
        Of a mechanism with loops.
    times : int
        So many elements in place of each.
    rules : BeamRules
        How beams become elements.
    known : sequence of LinkParts or None
        Of the links, as far as they are made already.

    Raises
    ------
    SceneError
        A link that is neither rigid nor made of beams or shells; it is named.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        elements_per_member: int | None = None,
        start: ClosedStart | None = None,
        times: int = 1,
        rules: BeamRules = BeamRules(),  # noqa: B008  (frozen)
        known: Sequence[LinkParts | None] = (),
    ) -> None:
        self.mechanism, self._elements, self._start, self._rules = mechanism, elements_per_member, start, rules
        parts = [
            made or link_parts(link, elements_per_member, times, rules)
            for made, link in zip_longest(known, mechanism.links)
        ]
        self._parts, self._times = parts, times
        self._built = [part.nodes for part in parts]  # in the mesh frames
        self._stressed = [link_stress(part, link.model) for part, link in zip(parts, mechanism.links, strict=True)]
        self.chain: Chain = build_chain(mechanism, parts, start)
        self.system = self.chain.system
        self.views = [
            LinkView(link, part, nodes, first)
            for link, part, nodes, first in zip(
                mechanism.links, parts, self.chain.nodes, self.chain.elements, strict=True
            )
        ]
        self.system.arms = tuple((self.chain.nodes[link].start, offset) for link, _, offset in self._arms)
        self._frames = 12 * self.system.count  # entries of y that hold them
        self._joints = slice(self._frames, self._frames + len(mechanism.joints))
        self._kept = self._frames + len(self.system.model.actuators)
        free = [k for k, loop in enumerate(mechanism.loops) if loop.freedom is not None]
        self._moving = {k: len(mechanism.joints) + n for n, k in enumerate(free)}  # numbers of actuators of loops

    def surface_stress(self, link: int, y: Array, v: Array) -> Array | None:
        """See `erls.equations.formulation.SurfaceStressed`."""
        where, own = self._stressed[link], self.chain.nodes[link]
        if where is None:
            return None
        return np.array([where.at(self.configuration(*state)[0].poses[own]) for state in zip(y, v, strict=True)])

    def refined(self, times: int) -> Nodal:
        """The same with so many elements in place of each."""
        return Nodal(self.mechanism, self._elements, self._start, times, self._rules)

    def with_sections(self, mechanism: Mechanism) -> Nodal:
        """The same of a mechanism whose links have other sections or materials, and nodes and interfaces where they are
        here: loops begin as they do here.
        """
        pairs = zip(mechanism.links, self.mechanism.links, self._parts, strict=True)
        known = [part if link is own and self._times == 1 else None for link, own, part in pairs]
        return Nodal(mechanism, self._elements, self._start, rules=self._rules, known=known)

    @cached_property
    def _arms(self) -> list[tuple[int, int, Array]]:
        """Link, node and place from its inboard interface of each point that errors are judged at on rigid links."""
        result = []
        for number, link in enumerate(self.mechanism.links):
            wanted = {i.node for i in link.model.interface_nodes}
            wanted |= {point.node for point in self.mechanism.points if point.link == number}
            for node in sorted(wanted - {link.inboard.node}) if not link.elastic_modes else ():
                result.append((number, node, link.model.nodes[node] - link.inboard.position))
        return result

    def place_of(self, link: int, node: int) -> int:
        """Number, among the places of ``system``, of a node of a link's model: the nearest one on that link."""
        model, own = self.mechanism.links[link].model, self.chain.nodes[link]
        arms = [(self.system.count + k, arm) for k, (number, arm, _) in enumerate(self._arms) if number == link]
        built = np.concatenate([self._built[link], model.nodes[[arm for _, arm in arms]].reshape(-1, 3)])
        numbers = [*range(own.start, own.stop), *(number for number, _ in arms)]
        nearest: int = numbers[int(np.linalg.norm(built - model.nodes[node], axis=1).argmin())]
        return nearest

    @property
    def size(self) -> int:
        """18 numbers for each node, one for each joint and each of its conditions, and one for dry friction."""
        return self._kept + self.system.size + self.system.constraints + len(self.dry.places)

    @cached_property
    def dry(self) -> DryFriction:
        """Friction of joints that may stick; places are those of their coordinates in y."""
        return dry_joints(self.system)

    @cached_property
    def locked(self) -> LockedSystem | None:
        """What is integrated, with modes of what acts in joints; None where nothing has any."""
        switches = len(self.dry.places) or self.mechanism.limited or self.mechanism.grips
        return LockedSystem(self.system) if switches else None

    def configuration(self, y: Array, v: Array) -> tuple[Nodes, Array]:
        """Configuration and twists of the nodes (n,)."""
        return self.system.from_stored(y[: self._kept], v[: self._kept])

    def _found(self, y: Array) -> tuple[Array, Array]:
        """Rates of twists and multipliers."""
        first = self._kept + self.system.size
        return y[self._kept : first], y[first : first + self.system.constraints]

    def multipliers(self, y: Array) -> Array:
        """(m,) of a state that an integrator found."""
        return self._found(y)[1]

    def _rubbing(self, y: Array) -> Array:
        """(m,) friction of joints that may stick."""
        if self.locked is None or not len(self.dry.places):
            return np.zeros(0)
        return self.locked.friction_of(y[-len(self.dry.places) :])

    def initial_state(self) -> tuple[Array, Array]:
        """Frames and joint coordinates at time 0; links turn with the joints as they are.

        Raises
        ------
        SimulationError
            NO_EQUILIBRIUM, UNSTABLE_START, when the start is to be static.
        """
        q = self.system.at(self._resting.q.poses) if self.mechanism.static_start else self.system.start
        velocity = self.carried_along(q)
        if self.chain.closing:  # links that bend at the start do not move as rigid ones do
            velocity = consistent_velocity(self.system, 0.0, q, velocity)
        a, multipliers = consistent_acceleration(self.system, 0.0, q, velocity)
        multipliers = np.append(multipliers, np.zeros(len(self.dry.places)))
        return _stored(self.system, 0.0, q, velocity, a, lambda: multipliers)[:2]

    def carried_along(self, q: Nodes) -> Array:
        """(n,) twists of the nodes where links move with the rates at which joints start, bent as they are."""
        rates = [joint.rate for joint in self.mechanism.joints] if self._start is None else self._start.rates
        return carried_along(self.mechanism, self.chain, q, rates)

    def neighbours(self, t: float, y: Array, v: Array) -> NodalNeighbours:
        """States beside one, with accelerations and multipliers that go with it."""
        q, velocity = self.configuration(y, v)
        if self.locked is None:
            return nodal_neighbours(self.system, t, q, velocity, _stored, self._names)
        settled, kept = self.locked.settled(t, y[: self._kept], v[: self._kept]), self.system.constraints

        locked = self.locked

        def stored(
            system: NodalSystem, t: float, q: Nodes, v: Array, a: Array, multipliers: Callable[[], Array]
        ) -> tuple[Array, Array, Array]:
            def every() -> Array:
                found, given = multipliers(), -settled.modes * self.dry.sliding
                result = np.concatenate([found[:kept], locked.friction_of(given)])
                result[kept + settled.held] = found[kept:]
                return result

            return _stored(system, t, q, v, a, every)

        def frozen(of: Nodal) -> NodalSystem:
            assert of.locked is not None
            return of.locked.frozen(settled, q)

        return nodal_neighbours(frozen(self), t, q, velocity, stored, self._names, frozen)

    def spinning(self, joint: str, speed: float) -> SpinningNeighbours:
        """States beside a steady motion about or along a joint [rad/s or m/s]: see `spinning_neighbours`."""

        def stored(
            system: NodalSystem, t: float, q: Nodes, v: Array, a: Array, multipliers: Callable[[], Array]
        ) -> tuple[Array, Array, Array]:
            return _stored(system, t, q, v, a, lambda: np.append(multipliers(), np.zeros(len(self.dry.places))))

        return spinning_neighbours(self.mechanism, self.chain, joint, speed, stored, self._names)

    @property
    def _names(self) -> tuple[str, ...]:
        """(n,) of the motions of the nodes."""
        owners = [
            f"link {link.name}, node {k + 1}"
            for link, own in zip(self.mechanism.links, self.chain.nodes, strict=True)
            for k in range(own.stop - own.start)
        ]
        return names_of_nodes(owners)

    @cached_property
    def held(self) -> NodalSystem:
        """The same with joints held, of which a static start is an equilibrium; those that follow loops are not."""
        positions, held = [joint.position for joint in self.mechanism.joints], range(len(self.mechanism.joints))
        if self._start is not None:
            positions = self._start.positions.tolist()
        chosen = held if self._start is None else self._start.held
        return self.chain.resting({k: positions[k] for k in chosen})

    @cached_property
    def _resting(self) -> Resting:
        """At rest under gravity, and what acts in joints."""
        return resting(self.held, self.chain, self.mechanism)

    @cached_property
    def stability(self) -> Stability:
        """Of the static start."""
        y, v = self.initial_state()
        near = self.neighbours(0.0, y, v)
        motions = small_motions(near) if self.system.size - self.system.constraints <= LARGEST else None
        return stability_of(self._resting.bearing, motions, near.acceleration, near.metres, size_of(self.mechanism))

    def state(self, t: float, y: Array, v: Array) -> State:
        """Positions of all nodes; link frames at the inboard nodes, modal coordinates as near as modes come."""
        return self.series(np.array([t]), y[None], v[None]).states()[0]

    def series(self, t: Array, y: Array, v: Array) -> StateSeries:
        """The same at times (k,), of all together."""
        at = [self.configuration(*stored) for stored in zip(y, v, strict=True)]
        start = self.system.start
        poses = np.array([q.poses for q, _ in at]).reshape(len(t), *start.poses.shape)
        bent = np.array([q.bent for q, _ in at]).reshape(len(t), *start.bent.shape)
        found = [view.at(poses, self.chain.beams, bent) for view in self.views]
        angles, rates = y[:, self._joints].copy(), np.zeros((len(t), len(self.mechanism.joints)))
        for n, (q, velocity) in enumerate(at):
            moving = self.system.joint_motion(q, velocity, np.zeros(self.system.size))[1]
            moving[self.dry.places - self._frames] = v[n, self.dry.places]  # exactly zero at rest
            rates[n] = moving[: rates.shape[1]]
            for k in self.mechanism.rotation_vectors:
                psi = self.chain.seats[k].vector(q)
                angles[n, k : k + 3] = psi
                rates[n, k : k + 3] = rotations.tangent_inverse(psi) @ self.chain.seats[k].spin(q, velocity)
        frames, modal = [x.frame for x in found], [x.modal for x in found]
        return StateSeries(t, frames, modal, angles, angles, rates, [x.nodes for x in found], [x.turns for x in found])

    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at times (k,)."""
        return nodal_motion(self, self.views, self.system.count, t, y, v, a)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state."""
        q, velocity = self.configuration(y, v)
        kinetic, elastic, gravity, _, springs = self.system.energies(q, velocity).tolist()
        return Energy(kinetic, elastic, gravity, springs)

    def load_power(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) power of loads, and what contacts lose, at times (k,) [W]."""
        loads, result = self.system.kinds.loads, np.zeros(len(t))
        for k, at in enumerate(t.tolist() if self.mechanism.acted_on else ()):
            q, velocity = self.configuration(y[k], v[k])
            result[k] = loads.power(at, q.poses, velocity.reshape(-1, 6))
            result[k] += self.system.in_contacts(q, velocity)[:, 10].sum()
        return result

    def contact_series(self, t: Array, y: Array, v: Array) -> ContactSeries:
        """Contacts at times (k,)."""
        known = np.zeros((len(t), len(self.mechanism.contacts), 15))
        for k, at in enumerate(t.tolist() if self.mechanism.contacts else ()):
            with self._grips.settled(at, y[k, : self._kept], v[k, : self._kept], self._grip_acceleration):
                known[k] = self.system.in_contacts(*self.configuration(y[k], v[k]))
        return ContactSeries.of(known)

    @cached_property
    def _grips(self) -> Grips:
        """Modes of contacts whose points may stick, which are not known but meanwhile."""
        return nodal_grips(self.system)

    def _grip_acceleration(self, t: float, y: Array, v: Array) -> Array:
        """ÿ of what is stored of knots, with the modes as they are."""
        q, velocity = self.system.from_stored(y, v)
        return self.system.stored(t, q, velocity, consistent_acceleration(self.system, t, q, velocity)[0])[2]

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) ÿ of frames and joint coordinates; 0 for the rest."""
        q, velocity = self.configuration(y, v)
        result = np.zeros(self.size)
        result[: self._kept] = self.system.stored(t, q, velocity, self._found(y)[0])[2]
        return result

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions from the multipliers and what acts along the joints."""
        acting, result = self._acting(t, y, v), []
        for k, (joint, seat) in enumerate(zip(self.mechanism.joints, self.chain.seats, strict=True)):
            wrench = acting.wrench(k, seat)
            effort, push = float(acting.along[k, 3]), acting.along[k, 4:]
            if joint.drive.prescribed:
                effort = float(seat.screw(joint.freedom) @ wrench)
            wrench = wrench + push
            turn = acting.q.poses[seat.outer, :3, :3]
            result.append(Reaction(turn @ wrench[:3], turn @ wrench[3:], effort))
        return result

    def loop_forces(self, t: float, y: Array, v: Array) -> list[LoopForce]:
        """What every closing joint does to its link."""
        acting, result = self._acting(t, y, v), []
        for k, seat in enumerate(self.chain.closing):
            wrench = acting.wrench(len(self.mechanism.joints) + k, seat)
            if k in self._moving:
                wrench = wrench + acting.along[self._moving[k], 4:]
            own, arm = acting.q.poses[seat.outer], seat.outer_frame[:3, 3]
            turn, moment = own[:3, :3], wrench[3:] - cross(arm, wrench[:3])
            result.append(LoopForce(turn @ wrench[:3], turn @ moment, own[:3, 3] + turn @ arm))
        return result

    def loop_motion(self, t: float, y: Array, v: Array, loop: int) -> tuple[float, float]:
        """Coordinate of a closing joint that has one, and its rate."""
        q, velocity = self.configuration(y, v)
        coordinates, rates, _ = self.system.joint_motion(q, velocity, np.zeros(self.system.size))
        rates[self.dry.places - self._frames] = v[self.dry.places]
        return float(coordinates[self._moving[loop]]), float(rates[self._moving[loop]])

    def loop_effort(self, t: float, y: Array, v: Array, loop: int) -> float:
        """Force of drive, spring, damper and friction along it; for a prescribed motion what its motor must give."""
        acting, free, seat = self._acting(t, y, v), self.mechanism.loops[loop].freedom, self.chain.closing[loop]
        if free is not None and free.drive.prescribed:
            return float(seat.screw(free.freedom) @ acting.wrench(len(self.mechanism.joints) + loop, seat))
        return float(acting.along[self._moving[loop], 3])

    def _acting(self, t: float, y: Array, v: Array) -> _Acting:
        q, velocity = self.configuration(y, v)
        a, multipliers = self._found(y)
        full = self.chain.full
        if self.chain.left_out:
            force = np.asarray(self.system.constraint_matrix(t, q).T @ multipliers).ravel()
            multipliers = smallest_multipliers(full, t, q, force, self._units)
        along = self.system.in_joints(t, q, velocity, a)
        if self.locked is not None and len(self.dry.places):
            numbers, friction = self.locked.numbers, self._rubbing(y)
            along[numbers, 3] += friction
            along[numbers, 4:] += friction[:, None] * self.locked.outward(t, q)
        return _Acting(q, full.rows.joint_of_row, full.constraint_matrix(t, q), multipliers, along)

    @cached_property
    def _units(self) -> Array:
        """(m,) multiplier per newton of all conditions of loops, with arms as long as a link; 0 of the others."""
        rows = self.chain.full.rows
        units = np.where(rows.c.any(axis=1), 1.0, self.mechanism.reach)
        return np.where(rows.joint_of_row < len(self.mechanism.joints), 0.0, units)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the loops."""
        return warnings_of(self.chain.left_out)

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        beams, shells = self.chain.beams, self.chain.shells
        own = {loop.name: f"joint {loop.name!r}: " for loop in self.mechanism.loops}
        loops = [
            {"name": name, "redundant": [x.removeprefix(start) for x in self.chain.left_out if x.startswith(start)]}
            for name, start in own.items()
        ]
        return {
            "formulation": "nodal",
            "joints": len(self.mechanism.joints),
            "elements": (0 if beams is None else len(beams.nodes)) + (0 if shells is None else len(shells.corners)),
            "nodes": self.system.count,
            "velocities": self.system.size,
            "conditions": self.system.constraints,
            **({"loops": loops} if loops else {}),
        }


def _stored(
    system: NodalSystem, t: float, q: Nodes, v: Array, a: Array, multipliers: Callable[[], Array]
) -> tuple[Array, Array, Array]:
    """y with its derivatives, those of what the integrator finds left out."""
    y, *rates = system.stored(t, q, v, a)
    found = np.concatenate([a, multipliers()])
    return np.concatenate([y, found]), *(np.concatenate([rate, 0 * found]) for rate in rates)  # type: ignore[return-value]


@dataclass(frozen=True)
class _Acting:
    """What acts in the joints of a state: conditions of all joints (m, n), their multipliers (m,), and what actuators
    do (a, 10).
    """

    q: Nodes
    joint_of_row: IntArray
    rows: Matrix
    multipliers: Array
    along: Array

    def wrench(self, number: int, seat: Seat) -> Array:
        """(6,) of a joint's conditions on its outer node, in the axes of that node."""
        own, place = np.flatnonzero(self.joint_of_row == number), slice(6 * seat.outer, 6 * seat.outer + 6)
        return -np.asarray(self.rows[own][:, place].T @ self.multipliers[own]).ravel()
