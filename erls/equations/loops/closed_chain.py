"""Closed loops over any formulation of a chain: its independent coordinates y, tied by the conditions of the loops.

    M(y) a + Φ_yᵀ λ = f(t, y, v),    Φ(t, y) = 0

The conditions hold between physical, displaced frames. Rows that follow from the others (three of a planar four-bar
in space) are found by rank at the start and left out; forces are then those of the smallest multipliers. The second
derivative of Φ keeps its errors decaying (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1-16), and whoever
asks for a state gets the nearest one that closes the loops.
"""

from __future__ import annotations

from contextlib import nullcontext
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la

from erls.equations.formulation import ContactSeries, Energy, LoopForce, Reaction, State
from erls.equations.linearization import Linearization
from erls.equations.loops.failures import assembled_warning, comes_apart, locks, warnings_of
from erls.equations.loops.friction import forced, freely
from erls.equations.loops.gripped import by_states, gripped, held_friction, loop_grips, resting, rubbed
from erls.equations.loops.neighbours import LoopNeighbours
from erls.equations.loops.rows import Closure, applied
from erls.equations.loops.start import ASSEMBLED, Start, find_start, start_velocity, stays_open
from erls.equations.loops.static import held_loops
from erls.equations.loops.tied import OPEN, Tied
from erls.equations.neighbours import small_motions
from erls.equations.serial.equilibrium import Held, equilibrium
from erls.equations.serial.motion_series import MotionSeries, motion_series
from erls.equations.serial.neighbours import TreeNeighbours
from erls.equations.serial.state_series import (
    ReactionSeries,
    StateSeries,
    energy_series,
    inboard_place,
    reaction_series,
    single_energy,
    state_series,
)
from erls.equations.stability import Bearing, Stability, stability_of, tumbling
from erls.equations.switches.grips import Grips
from erls.equations.switches.law import DryFriction, Freely, settled
from erls.errors import SimulationError
from erls.maths.so3 import Array, cross_all
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops

DECAY = 100.0  # 1/s, of what closing conditions are violated by
DEPENDENT = 1e-8  # metres per metre, of a row beside those before it: redundant below


class ClosedChain(Tied):
    """Equations of motion of a chain with loops; a `Formulation`.

    Parameters
    ----------
    bare : TreeFormulation
        Of the chain; its mechanism holds the loops.
    """

    @property
    def length_scales(self) -> Array:
        """(n,) those of the chain."""
        return self.bare.length_scales

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of all drives."""
        own = (loop.freedom.drive.breakpoints for loop in self.mechanism.loops if loop.freedom is not None)
        return tuple(sorted({*self.bare.breakpoints, *(t for times in own for t in times)}))

    @cached_property
    def start(self) -> Start:
        """The undeformed chain with its loops closed."""
        return find_start(self)

    @cached_property
    def kept(self) -> IntArray:
        """(r,) rows that do not follow from others, at the start."""
        if not self.rows.names:
            return np.zeros(0, dtype=np.int64)
        matrix = self.scaled_rows(self.closure(0.0, self.start.y, np.zeros(self.size)), np.arange(len(self.rows.names)))
        _, factor, order = la.qr(matrix.T, mode="economic", pivoting=True)
        sizes = np.abs(np.diag(factor))
        return np.sort(order[: np.count_nonzero(sizes > DEPENDENT)])

    @cached_property
    def loops(self) -> CompiledLoops:
        """The equations, with decay of what conditions are violated by."""
        return self.packed(self.kept, DECAY)

    @cached_property
    def exact(self) -> CompiledLoops:
        """The equations without decay: for closed states, and what runs report of them."""
        return self.packed(self.kept, 0.0)

    @cached_property
    def compiled(self) -> CompiledLoops | None:
        """The equations; None where no coordinate is independent: there is nothing to integrate."""
        return self.loops if self.size else None

    @property
    def redundant(self) -> tuple[str, ...]:
        """Rows that follow from the others, by loop and direction."""
        return tuple(name for k, name in enumerate(self.rows.names) if k not in self.kept)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the loops."""
        assembled = assembled_warning(self.start, ASSEMBLED * self.reach, self._force_at_start)
        return (*warnings_of(self.redundant), *assembled)

    def _force_at_start(self) -> float:
        """Largest force of a closing joint there [N]."""
        return max(float(np.linalg.norm(found.force)) for found in self.loop_forces(0.0, *self.initial_state()))

    def refuse_open(self, t: float, found: Closure) -> None:
        """Raise when a loop has come apart.

        Raises
        ------
        SimulationError
            LOOP_OPEN, naming loop and direction.
        """
        gaps = np.abs(self.openings(found))
        if not gaps.max(initial=0.0) > OPEN * self.reach:
            return
        worst = int(np.argmax(gaps))
        limit = OPEN * self.reach
        raise comes_apart(t, self.rows.names[worst], float(gaps[worst]), limit, worst not in self.kept)

    @property
    def dry(self) -> DryFriction | None:
        """Friction that sticks, in joints of the tree; what is compiled leaves it out."""
        return self.bare.dry

    @property
    def unheld(self) -> ClosedChain:
        """The chain with all its joints free, whatever friction holds."""
        return self

    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """A closed state without friction that sticks; see `erls.equations.switches.law`.

        Raises
        ------
        SimulationError
            As `accelerations`.
        """
        return freely(self, t, y, v)

    def accelerate(self, system: CompiledLoops, t: float, y: Array, v: Array) -> Array:
        """(n,) accelerations of one of the compiled forms, without friction that sticks; NaN where the loops lock.

        Raises
        ------
        SimulationError
            SINGULAR_MASS, naming the coordinate.
        """
        out = np.empty(self.size)
        places = np.array(y, dtype=float), np.array(v, dtype=float)
        with gripped(self, t, y, v) if system is self.exact else nullcontext():
            status = system.acceleration(system.reals, system.integers, system.scratch, t, *places, out)
        return self.bare.acceleration(t, y, v) if status > 0 else out  # the former names it

    @cached_property
    def exact_grips(self) -> Grips:
        """Modes of contacts whose points may stick, which are not known but meanwhile."""
        return loop_grips(self, self.exact)

    def accelerations(self, t: float, y: Array, v: Array) -> tuple[Array, Array, Closure]:
        """Accelerations (n,), multipliers of all rows (m,) and the conditions at a closed state.

        Raises
        ------
        SimulationError
            SINGULAR_MASS, or LOOP_OPEN where the conditions lock.
        """
        found = self.closure(t, y, v)
        a, own, gradient = forced(self, t, y, v)
        if not np.isfinite(a).all():
            raise self.locked(t, self.stiffest(found))
        every = np.zeros(len(self.rows.names))
        every[self.kept] = own
        if len(self.kept) < len(every):
            along = self.row_metres[:, None] * found.rows[:, self.bare.free]
            force = gradient.T @ own
            every = self.row_metres * np.linalg.lstsq(along.T, force, rcond=DEPENDENT)[0]
        return a, every, found

    def stiffest(self, found: Closure) -> tuple[float, int]:
        """Smallest singular value of the conditions in use, and the loop that it belongs to."""
        left, values, _ = la.svd(self.scaled_rows(found, self.kept), full_matrices=False)
        if not len(values):
            return 1.0, 0
        return float(values[-1]), int(self.rows.owner[self.kept[np.abs(left[:, -1]).argmax()]])

    @cached_property
    def stiffest_at_start(self) -> float:
        """Smallest singular value there."""
        return self.stiffest(self.closure(0.0, self.start.y, np.zeros(self.size)))[0]

    def locked(self, t: float, stiffest: tuple[float, int]) -> SimulationError:
        """The loop cannot move on."""
        return locks(t, self.mechanism.loops[stiffest[1]].name, stiffest[0], self.stiffest_at_start)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) accelerations, with decay of what loops are open by; NaN where they lock: integrators step around it."""
        return self.accelerate(self.loops, t, y, v)

    def acceleration_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, n) of the nearest closed states at times (k,), without such decay: what runs report."""
        at = zip(t.tolist(), *self._closed_at(t, y, v), strict=True)
        return np.array([self.accelerations(*state)[0] for state in at]).reshape(y.shape)

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) of the chain, with rotors in closing joints."""
        return self.loops.masses(t, y)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f, the forces of the loops within f."""
        system, out = self.loops, np.empty(self.size)
        values = [np.array(x, dtype=float) for x in (y, v, a)]
        system.residual(system.reals, system.integers, system.scratch, t, *values, out)
        return out

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """Those of the chain with what the loops' forces take of them, and the decay; not symmetric."""
        system, both = self.loops, np.empty((2, self.size, self.size))
        values = [np.array(x, dtype=float) for x in (y, v)]
        system.stiffness_and_damping(system.reals, system.integers, system.scratch, t, *values, both[0], both[1])
        return both[0], both[1]

    def initial_state(self) -> tuple[Array, Array]:
        """(y, v) at time 0: loops closed on the undeformed chain, or in static equilibrium; rates that keep to them."""
        y = self._static[0].copy() if self.mechanism.static_start else self._closed_start
        return y, self.start_velocity(y)

    @property
    def _closed_start(self) -> Array:
        """(n,) loops closed, links undeformed unless loops need it."""
        if not self.start.where:
            return self.start.y
        # the gap is all in conditions that others leave to it, or links bend by as much
        return self.closed(0.0, self.start.y, np.zeros(self.size))[0]

    @cached_property
    def _static(self) -> tuple[Array, Bearing]:
        """Static equilibrium with the joints held that the loops leave free, and what loads leave of the stiffness.

        Raises
        ------
        SimulationError
            LOOP_OPEN where no link gives way in a direction that undeformed links leave open, beside what
            `erls.equations.serial.equilibrium.equilibrium` raises.
        """
        y, bearing = equilibrium(self.held, self._closed_start)
        if self._gap:
            gaps = np.abs(self.openings(self.closure(0.0, y, np.zeros(self.size))))
            worst = int(np.argmax(gaps))
            if gaps[worst] > ASSEMBLED * self.reach:
                raise stays_open(self, f"no link gives way: {self.rows.names[worst]} stays open", float(gaps[worst]))
        return y, bearing

    @property
    def held(self) -> Held:
        """The closed chain at rest with the joints held that the loops leave free."""
        return held_loops(self, self.exact, self._closed_start, self.start.held, self._gap)

    @property
    def _gap(self) -> float:
        """What undeformed links leave open [m]; 0 where that is nothing to speak of."""
        return self.start.gap if self.start.gap > ASSEMBLED * self.reach else 0.0

    def neighbours(self, t: float, y: Array, v: Array) -> LoopNeighbours:
        """States beside a closed one, with the forces of the loops as they are there."""
        a, multipliers, rows = forced(self, t, y, v)
        stuck = () if self.dry is None else self.dry.places[settled(self, t, y, v).held].tolist()
        tree, reactions = TreeNeighbours(self.bare, t, y, v, a, tuple(stuck)), multipliers.copy()
        if not self.mechanism.gripped:
            return LoopNeighbours(self, tree, reactions, self.kept)
        conditions = rows.copy()
        found = rubbed(self, t, y, v)
        held = resting(self, found, conditions)
        return LoopNeighbours(self, tree, reactions, self.kept, found, tuple(held))

    def linearized(self, t: float, y: Array, v: Array) -> Linearization:
        """Small motions about a closed state on the ways that the loops leave."""
        return small_motions(self.neighbours(t, y, v))

    @cached_property
    def stability(self) -> Stability:
        """Of the static start."""
        y, v = self.initial_state()
        a = forced(self, 0.0, y, v)[0]
        motions = None if tumbling(self.mechanism, v) else self.linearized(0.0, y, v)
        return stability_of(self._static[1], motions, a, self.metres, self.reach)

    def start_velocity(self, y: Array) -> Array:
        """(n,) rates at a closed start that keep it closed."""
        return self.closed(0.0, y, start_velocity(self, y, self.start.following))[1]

    def closed(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """The nearest state, in metres, that closes the loops; the same one where there is none nearby. Joints with dry
        friction that are at rest stay so.
        """
        place, rate = self.loops.closed(t, y, v)
        if self.dry is not None and (at_rest := self.dry.places[v[self.dry.places] == 0.0]).size:
            rate = np.array(rate)
            rate[at_rest] = 0.0
        return place, rate

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles."""
        return self.bare.state(t, *self.closed(t, y, v))

    def _closed_at(self, t: Array, y: Array, v: Array) -> tuple[Array, Array]:
        """`closed` at times (k,)."""
        found = np.array([self.closed(*at) for at in zip(t.tolist(), y, v, strict=True)])
        found = found.reshape(len(t), 2, y.shape[1])
        return found[:, 0], found[:, 1]

    def series(self, t: Array, y: Array, v: Array) -> StateSeries:
        """The same at times (k,)."""
        return state_series(self.bare, t, *self._closed_at(t, y, v))

    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at times (k,) with accelerations (k, n)."""
        return motion_series(self.bare, t, *self._closed_at(t, y, v), a)

    def energy_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, 4) energies at times (k,), with those of springs and rotors in closing joints."""
        y, v = self._closed_at(t, y, v)
        result = energy_series(self.bare, t, y, v)
        free = {k: loop.freedom for k, loop in enumerate(self.mechanism.loops) if loop.freedom is not None}
        if not any(found.rotor_inertia or found.forces.stiffness or found.forces.stops for found in free.values()):
            return result
        for i, at in enumerate(t.tolist()):
            efforts = self.closure(at, y[i], v[i]).efforts
            for k, found in free.items():
                result[i, 0] += 0.5 * found.rotor_inertia * efforts[k].rate ** 2
                result[i, 3] += found.forces.energy(efforts[k].coordinate)
        return result

    def contact_series(self, t: Array, y: Array, v: Array) -> ContactSeries:
        """That of the tree."""
        return by_states(self, self.bare.contact_series, t, y, v)

    def load_power(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) that of the tree."""
        return self.bare.load_power(t, y, v)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """The same at one time."""
        return single_energy(self.energy_series(np.array([t]), np.array([y]), np.array([v])))

    def loop_forces(self, t: float, y: Array, v: Array) -> list[LoopForce]:
        """What every closing joint does to its link."""
        y, v = self.closed(t, y, v)
        a, multipliers, found = self.accelerations(t, y, v)
        wrenches = self._wrenches(a, multipliers, found, held_friction(self, t, y, v)[1])
        return [applied(outer, wrench) for outer, wrench in zip(found.outer, wrenches, strict=True)]

    def _wrenches(self, a: Array, multipliers: Array, found: Closure, friction: Array) -> list[Array]:
        """(6,) what every closing joint does to its link, in the axes of the outer frame: reactions, drives, rotors."""
        result = self.rows.wrenches(found, multipliers)
        for k, (loop, effort) in enumerate(zip(self.mechanism.loops, found.efforts, strict=True)):
            if (free := loop.freedom) is not None:
                along = free.freedom.row
                turning = float(found.moves[k][along, self.bare.free] @ a) + effort.turning
                result[k][along] += effort.force + friction[k] - free.rotor_inertia * turning
        return result

    def loop_motion(self, t: float, y: Array, v: Array, loop: int) -> tuple[float, float]:
        """Coordinate of a closing joint that has one, and its rate."""
        effort = self.closure(t, *self.closed(t, y, v)).efforts[loop]
        return effort.coordinate, effort.rate

    def loop_effort(self, t: float, y: Array, v: Array, loop: int) -> float:
        """Force of drive, spring, damper and friction along it; for a prescribed motion what its motor must give."""
        y, v = self.closed(t, y, v)
        free = self.mechanism.loops[loop].freedom
        if free is None or not self.mechanism.loops[loop].prescribed:
            return self.closure(t, y, v).efforts[loop].force + float(held_friction(self, t, y, v)[1][loop])
        _, multipliers, found = self.accelerations(t, y, v)
        return float(free.freedom.screw @ self.rows.wrenches(found, multipliers)[loop])

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Reactions in the joints of the chain: what the links from there outward need beside what loops give."""
        return self.reaction_series(np.array([t]), y[None], v[None]).reactions(0)

    def reaction_series(self, t: Array, y: Array, v: Array, a: Array | None = None) -> ReactionSeries:
        """The same at times (k,); accelerations, which go with the loops' forces, are found here."""
        y, v = self._closed_at(t, y, v)
        loops, links = self.mechanism.loops, self.mechanism.links
        found, loads = np.empty((len(t), self.size)), np.empty((len(t), len(links)))
        friction_within = np.empty((len(t), len(links)))
        given: list[list[LoopForce]] = []
        for i, at in enumerate(t.tolist()):
            found[i], multipliers, closure = self.accelerations(at, y[i], v[i])
            friction_within[i], friction = held_friction(self, at, y[i], v[i])
            wrenches = self._wrenches(found[i], multipliers, closure, friction)
            given.append([applied(outer, wrench) for outer, wrench in zip(closure.outer, wrenches, strict=True)])
            loads[i] = -(np.concatenate(closure.moves).T @ np.concatenate(wrenches))[: len(links)]
        result = by_states(self, partial(reaction_series, self.bare), t, y, v, found)
        states = state_series(self.bare, t, y, v)
        for number, loop in enumerate(loops):
            force, moment, place = (
                np.array([getattr(every[number], what) for every in given]).reshape(-1, 3)
                for what in ("force", "moment", "place")
            )
            for end, sign in ((loop.outer, 1.0), (loop.inner, -1.0)):
                for k in range(0 if end.link is None else end.link + 1):
                    local, pose = inboard_place(links[k], states.modal[k]), states.poses[k]
                    node = np.einsum("tij,tj->ti", pose[:, :3, :3], local) + pose[:, :3, 3]
                    result.force[:, k] -= sign * force
                    result.moment[:, k] -= sign * (moment + cross_all(place - node, force))
        for k, joint in enumerate(self.mechanism.joints):
            if joint.drive.prescribed:
                result.effort[:, k] += loads[:, k]
        result.effort[:] += friction_within
        if self.dry is not None:  # those that stick bear loads, too
            joints = self.bare.free_joints[self.dry.places]
            result.effort[:, joints] += np.where(v[:, self.dry.places] == 0.0, loads[:, joints], 0.0)
        return result

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        names = {loop.name: f"{loop.kind} {loop.name!r}, " for loop in self.mechanism.loops}
        loops = [
            {"name": name, "redundant": [r.removeprefix(start) for r in self.redundant if r.startswith(start)]}
            for name, start in names.items()
        ]
        return {**self.bare.describe(), "loops": loops, "degrees_of_freedom": self.size - len(self.kept)}
