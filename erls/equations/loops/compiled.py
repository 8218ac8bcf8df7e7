"""A tree with closed loops in compiled form: records of loops behind those of the tree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import CompiledSystem
from erls.equations.loops import actuated, held, nearest, system
from erls.equations.loops import records as own
from erls.equations.loops.closure import closure
from erls.equations.loops.rows import Closure, Effort, LoopRows
from erls.equations.serial.pack import force_record, pose_numbers
from erls.equations.serial.time_curves import put_curve
from erls.equations.switches.motors import Acting
from erls.maths.calls import address_of
from erls.maths.records import Memory, place_of, python_reader
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.couplings import Term
from erls.mechanism.curves import Curve
from erls.mechanism.loops import Loop, loop_ends
from fe_import.model import IntArray

_see_room, _see_state = python_reader(own.LoopRoom), python_reader(own.LoopState)
_see_closing, _see_gripped = python_reader(own.ClosingJoint), python_reader(own.GrippedJoint)


class Carrier(Protocol):
    """What carries the frames that loops hold: a tree of links, or links that float freely.

    Attributes
    ----------
    size, joints : int
        Numbers of velocities, and of joints, among which ``free_joints`` are not prescribed.
    free : int array
        Places of the velocities among the rates of (θ, elastic).
    """

    joints: int
    free: IntArray
    free_joints: IntArray

    @property
    def size(self) -> int: ...

    @property
    def compiled(self) -> CompiledSystem | None: ...


class Turns(NamedTuple):
    """How often closing joints have turned: c coordinates of which the turns of l joints are sums.

    Attributes
    ----------
    signs : (l, c) array
        By which they add.
    start : (l,) array
        Sums where closing joints have not turned.
    places : (c,) int array
        Of the coordinates in y, -1 where ``motions`` prescribe them.
    motions : list of Curve or None
    """

    signs: Array
    start: Array
    places: IntArray
    motions: list[Curve | None]


@dataclass(frozen=True)
class Given:
    """What is packed.

    Attributes
    ----------
    tree : Carrier
    rows : LoopRows
    kept : (r,) int array
        Rows in use.
    metres : (n,) array
        Per unit of each coordinate.
    row_metres : (m,) array
        Per unit of each condition.
    reach : float
        Size of the mechanism [m].
    decay : float
        Of what conditions are violated by [1/s].
    open : float
        What a loop that has come apart is open by [m].
    turns : Turns
    joints : tuple of str
        Names of those of the tree.
    feeding : tuple of int
        Places of the `erls.equations.serial.records.JointState` whose feed-forward acts in each closing joint, where
        any does.
    grips : tuple of (int, (9,) array)
        Place of the coordinate, and friction, of each joint of the tree that may stick as closing joints do.
    """

    tree: Carrier
    rows: LoopRows
    kept: IntArray
    metres: Array
    row_metres: Array
    reach: float
    decay: float
    open: float
    turns: Turns
    joints: tuple[str, ...] = ()
    feeding: tuple[int, ...] = ()
    grips: tuple[tuple[int, Array], ...] = ()

    @property
    def active(self) -> bool:
        """Whether any force that is no reaction, or rotor, acts along a closing joint."""
        acting = (loop.freedom is not None and loop.freedom.active for loop in self.rows.loops)
        return any(acting) or any(loop.circuit or loop.bushing for loop in self.rows.loops)


def _numbers(y: Array) -> Array:
    return np.ascontiguousarray(y, dtype=float)


@dataclass(frozen=True)
class CompiledLoops(CompiledSystem):
    """A closed chain in compiled form.

    Attributes
    ----------
    given : Given
    """

    given: Given

    @property
    def called(self) -> dict[Any, Any]:
        """What is called by address, by what calls it: for `erls.maths.jit.any_scalar`."""
        tree = self.given.tree.compiled
        assert tree is not None
        return {
            own.call_frames: tree.frames,
            own.call_residual: tree.residual,
            own.call_mass_matrix: tree.mass_matrix,
            own.call_stiffness_and_damping: tree.stiffness_and_damping,
            own.call_closure: closure,
            own.call_forces: actuated.forces,
            own.call_masses: actuated.masses,
            own.call_matrices: actuated.matrices,
        }

    @property
    def conditions(self) -> int:
        """How many conditions there are."""
        return len(self.given.rows.names)

    @property
    def kept(self) -> int:
        """How many of them are in use."""
        return len(self.given.kept)

    @cached_property
    def _places(self) -> own.Loops:
        return own.see_loops(self.reals, self.integers, int(self.integers[-1]))

    @property
    def _arrays(self) -> tuple[Array, IntArray, Array]:
        return self.reals, self.integers, self.scratch

    @property
    def room(self) -> own.LoopRoom:
        """What the last evaluation left."""
        return _see_room(self.scratch, self.integers, self._places.room)

    @property
    def acting(self) -> Acting:
        """Along closing joints."""
        joints: list[int] = []
        efforts: list[int] = []
        for k in range(len(self.given.rows.loops)):
            joint = self._closing(k).joint
            if joint >= 0:
                joints.append(int(joint))
                state = self._places.states + k * own.LOOP_STATE
                efforts.append(place_of(own.LoopState, "effort", self.integers, state) + own.PUSH)
        return Acting(np.array(joints, dtype=np.int64), np.array(efforts, dtype=np.int64))

    def _closing(self, number: int) -> own.ClosingJoint:
        return _see_closing(self.reals, self.integers, self._places.first + number * own.CLOSING_JOINT)

    @property
    def sticking(self) -> list[int]:
        """Loops whose closing joints may stick, by their numbers."""
        return [k for k, loop in enumerate(self.given.rows.loops) if loop.sticks]

    def gripped_laws(self, reals: Array) -> list[Array]:
        """See `CompiledSystem`: of joints of the tree, then of those that close it."""
        whole, closing = self._places, self.sticking
        tree = [whole.grips + k * own.GRIPPED_JOINT for k in range(whole.gripped)]
        found = [_see_gripped(reals, self.integers, place).grip for place in tree]
        places = [whole.first + k * own.CLOSING_JOINT for k in closing]
        return [*found, *(_see_closing(reals, self.integers, place).grip for place in places)]

    @property
    def gripped_places(self) -> IntArray:
        """See `CompiledSystem`."""
        room = place_of(own.LoopRoom, "gripped", self.integers, self._places.room)
        tree = room + np.arange(2 * self._places.gripped).reshape(-1, 2)
        states = (self._places.states + k * own.LOOP_STATE for k in self.sticking)
        efforts = [place_of(own.LoopState, "effort", self.integers, state) for state in states]
        closing = np.array([[at + own.RATE, at + own.COORDINATE] for at in efforts], dtype=np.int64)
        return np.concatenate([tree, closing.reshape(-1, 2)])

    def closure(self, t: float, y: Array, v: Array) -> Closure:
        """Conditions of the loops, and what acts along them, at a state."""
        closure(*self._arrays, t, _numbers(y), _numbers(v))
        tree, room = self.given.tree, self.room
        prescribed = np.setdiff1d(np.arange(tree.joints), tree.free_joints)
        order = np.argsort([*tree.free, *prescribed])  # columns of (θ, elastic)
        placed = iter(room.frames)
        states = [
            _see_state(self.scratch, self.integers, self._places.states + k * own.LOOP_STATE)
            for k in range(len(self.given.rows.loops))
        ]
        outer: list[Array] = []
        for loop in self.given.rows.loops:
            found = loop.outer.frame
            if loop.outer.link is not None:
                numbers = next(placed)
                found = pose(numbers[:9].reshape(3, 3), numbers[9:12])
            if loop.inner.link is not None:
                next(placed)
            outer.append(found)
        moves = [state.moves[:, order] for state in states]
        gradients = [state.gradients.copy() for state in states]
        return Closure(
            room.violation.copy(),
            room.rate.copy(),
            room.bias.copy(),
            np.concatenate([gradient @ move for gradient, move in zip(gradients, moves, strict=True)]),
            gradients,
            outer,
            moves,
            [state.left[:9].reshape(3, 3).copy() for state in states],
            [_effort(loop, state) for loop, state in zip(self.given.rows.loops, states, strict=True)],
        )

    def closed(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """The nearest state, in metres, that closes the loops; the same one where there is none nearby."""
        place, rate = np.array(y, dtype=float), np.array(v, dtype=float)
        if nearest.close(*self._arrays, t, place, rate):
            return y, v
        return place, rate

    def forces(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f of the tree, with what acts along closing joints."""
        out = np.empty(self.size)
        actuated.forces(*self._arrays, t, _numbers(y), _numbers(v), _numbers(a), out)
        return out

    def gradients(self, t: Array, y: Array) -> Array:
        """(k, r, n) Φ_y of the conditions in use, at many places."""
        out = np.empty((len(t), self.kept, self.size))
        held.gradients(*self._arrays, _numbers(t), _numbers(y), out)
        return out

    def motions(self, t: Array, y: Array, v: Array) -> Array:
        """(k, r, 3 + n) Φ, Φ̇, Φ̈ at zero accelerations, and Φ_y of the conditions in use, at many states."""
        out = np.empty((len(t), self.kept, 3 + self.size))
        held.motions(*self._arrays, _numbers(t), _numbers(y), _numbers(v), out)
        return out

    def held(self, t: Array, y: Array, v: Array, a: Array, multipliers: Array) -> Array:
        """(k, n) the same at many states, with forces Φ_yᵀ λ of multipliers (k, r) of the conditions in use."""
        out = np.empty((len(t), self.size))
        t, y, v, a = (_numbers(x) for x in (t, y, v, a))
        held.held(*self._arrays, t, y, v, a, _numbers(multipliers), out)
        return out

    def masses(self, t: float, y: Array) -> Array:
        """(n, n) mass matrix of the tree, with rotors in closing joints."""
        out = np.empty((self.size, self.size))
        self.mass_matrix(*self._arrays, t, _numbers(y), out)
        return out

    def matrices(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """(n, n) stiffness and damping of the tree, with what acts along closing joints."""
        both = np.empty((2, self.size, self.size))
        closure(*self._arrays, t, _numbers(y), _numbers(v))
        actuated.matrices(*self._arrays, t, _numbers(y), _numbers(v), both[0], both[1])
        return both[0], both[1]

    def watched(self, times: Array, places: Array) -> tuple[Array, Array]:
        """At each of ``places`` (k, n) the largest opening [m] and the smallest singular value of the conditions."""
        gaps, squares = np.empty(len(times)), np.empty((len(times), self.kept, self.kept))
        states = times, np.ascontiguousarray(places)
        nearest.watch(*self._arrays, *states, gaps, squares)
        if not self.kept:
            return gaps, np.ones(len(times))
        return gaps, np.sqrt(np.maximum(np.linalg.eigvalsh(squares)[:, 0], 0.0))


def compile_loops(given: Given) -> CompiledLoops:
    """The compiled form of a closed chain."""
    carrier, rows, loops, tree = given.tree, given.rows, given.rows.loops, given.tree.compiled
    assert tree is not None
    n, m, r = tree.size, len(rows.names), len(given.kept)
    columns, ends = n + carrier.joints - len(carrier.free_joints), loop_ends(loops)
    integers = [int(i) for i in tree.integers]
    constants, scratch = Memory(integers, tree.reals), Memory(integers, tree.scratch)
    used = np.full(m, -1)
    used[given.kept] = np.arange(r)
    whole = own.Loops(
        loops=len(loops),
        conditions=m,
        kept=r,
        gripped=len(given.grips),
        grips=constants.put_all([own.GrippedJoint(*grip) for grip in given.grips]) if given.grips else -1,
        active=int(given.active),
        rotors=int(any(loop.freedom is not None and loop.freedom.rotor_inertia for loop in loops)),
        first=constants.put_all([_joint(constants, given, k, loop) for k, loop in enumerate(loops)]),
        states=scratch.put_all([own.loop_state(columns, len(found)) for found in rows.conditions]),
        room=scratch.put(own.room(len(ends), columns, n, m, r, len(given.grips))),
        frames=address_of(tree.frames, contract.FRAMES),
        residual=address_of(tree.residual, contract.RESIDUAL),
        mass_matrix=address_of(tree.mass_matrix, contract.MASS_MATRIX),
        stiffness_and_damping=address_of(tree.stiffness_and_damping, contract.STIFFNESS_AND_DAMPING),
        closure=address_of(closure, own.CLOSURE),
        forces=address_of(actuated.forces, contract.RESIDUAL),
        masses=address_of(actuated.masses, contract.MASS_MATRIX),
        matrices=address_of(actuated.matrices, contract.STIFFNESS_AND_DAMPING),
        reach=given.reach,
        decay=given.decay,
        open=given.open,
        metres=given.metres,
        scales=given.row_metres,
        used=used,
        joints=given.turns.places,
        motions=np.array([put_curve(constants, motion) for motion in given.turns.motions], dtype=np.int64),
    )
    integers.append(constants.put(whole))
    return CompiledLoops(
        size=n,
        reals=constants.numbers,
        integers=np.array(integers, dtype=np.int64),
        scratch=scratch.numbers,
        residual=system.residual,
        mass_matrix=system.mass_matrix,
        stiffness_and_damping=system.stiffness_and_damping,
        load_acceleration=lambda: system.acceleration,
        given=given,
    )


def _joint(memory: Memory, given: Given, number: int, loop: Loop) -> own.ClosingJoint:
    """Record of a loop, whose curves and forces are put into memory."""
    ends = loop.outer, loop.inner
    before = len(loop_ends(given.rows.loops[:number]))
    second = before + int(loop.outer.link is not None)
    places = [-1 if end.link is None else place for end, place in zip(ends, (before, second), strict=True)]
    free, found, joint = loop.freedom, given.rows.conditions[number], -1
    feeding = given.feeding[number] if given.feeding else -1
    if free is not None and free.active:
        motion = None if loop.prescribed else free.drive.motion
        record = force_record(memory, free.forces, free.drive, free.rotor_inertia, motion)
        joint = memory.put(record._replace(feeds=int(feeding >= 0)))
    return own.ClosingJoint(
        outer=places[0],
        inner=places[1],
        first=int(np.count_nonzero(given.rows.owner < number)),
        motion=-1 if free is None or not loop.prescribed else put_curve(memory, free.drive.motion),
        along=-1 if free is None else free.freedom.row,
        joint=joint,
        zero=0.0 if free is None else free.zero,
        pitch=0.0 if free is None else free.freedom.pitch,
        feeding=feeding,
        turned=float(given.turns.start[number]),
        signs=given.turns.signs[number],
        ground=np.stack([pose_numbers(end.frame) for end in ends]),
        lines=np.array([row.line for row in found]).reshape(-1, 3),
        entries=np.array([row.entries for row in found]).reshape(-1, 3, 3),
        pitches=np.array([row.pitch for row in found]),
        grip=np.zeros(0) if free is None else free.grip(given.reach),
        spring=np.zeros((0, 0)) if loop.bushing is None else loop.bushing.stiffness,
        damper=np.zeros((0, 0)) if loop.bushing is None else loop.bushing.damping,
        gyration=0.0 if loop.circuit is None else loop.circuit.gyration,
        offset=0.0 if loop.coupling is None else loop.coupling.offset,
        factors=np.array([term.factor for term in _terms(loop)]),
        origins=np.array([0.0 if term.cam is None else term.cam.origin for term in _terms(loop)]),
        periods=np.array([0.0 if term.cam is None else term.cam.period for term in _terms(loop)]),
        **_coordinates(memory, given, loop),
    )


def _effort(loop: Loop, state: own.LoopState) -> Effort:
    """Of a circuit charge, current and voltage."""
    place, rate, turning, push = state.effort.tolist()
    if loop.circuit is not None:
        place, rate = float(state.pose[9]), float(state.twist[5])
    return Effort(place, rate, turning, push, state.wrench.copy())


def _terms(loop: Loop) -> tuple[Term, ...]:
    if loop.circuit is not None:
        return Term(loop.circuit.joint, 1.0), Term(loop.circuit.charge, 1.0)
    return () if loop.coupling is None else loop.coupling.terms


def _coordinates(memory: Memory, given: Given, loop: Loop) -> dict[str, IntArray]:
    """Where a coupling finds the coordinates that it ties; curves of those that are prescribed are put into memory."""
    columns, curves, others, cams = list[int](), list[int](), list[int](), list[int]()
    closing, turns = [other.name for other in given.rows.loops], given.turns
    prescribed = [k for k, motion in enumerate(turns.motions) if motion is not None]
    for term in _terms(loop):
        tree = given.joints.index(term.joint) if term.joint in given.joints else -1
        others.append(closing.index(term.joint) if tree < 0 else -1)
        curves.append(put_curve(memory, turns.motions[tree]) if tree in prescribed else -1)
        cams.append(put_curve(memory, None if term.cam is None else term.cam.curve))
        own = int(turns.places[tree]) if tree >= 0 else -1
        columns.append(given.tree.size + prescribed.index(tree) if tree in prescribed else own)
    return {
        name: np.array(found, dtype=np.int64)
        for name, found in (("columns", columns), ("curves", curves), ("others", others), ("cams", cams))
    }
