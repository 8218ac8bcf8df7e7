"""A tree with closed loops in compiled form: records of loops behind those of the tree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import CompiledSystem
from erls.equations.loops import actuated, nearest, system
from erls.equations.loops import records as own
from erls.equations.loops.closure import closure
from erls.equations.serial.joint_frames import Conditions
from erls.equations.serial.pack import force_record, pose_numbers, put_all
from erls.equations.serial.time_curves import put_curve
from erls.maths.calls import address_of
from erls.maths.records import Memory
from erls.maths.so3 import Array
from erls.mechanism.loops import Loop, loop_ends

if TYPE_CHECKING:
    from erls.equations.loops.closed_chain import ClosedChain


@dataclass(frozen=True)
class CompiledLoops(CompiledSystem):
    """A closed chain in compiled form.

    Attributes
    ----------
    conditions, kept : int
        Of its loops, and how many of them are in use.
    """

    conditions: int
    kept: int

    def closed(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """The nearest state, in metres, that closes the loops; the same one where there is none nearby."""
        place, rate = np.array(y, dtype=float), np.array(v, dtype=float)
        if nearest.close(self.reals, self.integers, self.scratch, t, place, rate):
            return y, v
        return place, rate

    def watched(self, times: Array, places: Array) -> tuple[Array, Array]:
        """At each of ``places`` (k, n) the largest opening [m] and the smallest singular value of the conditions."""
        gaps, squares = np.empty(len(times)), np.empty((len(times), self.kept, self.kept))
        states = times, np.ascontiguousarray(places)
        nearest.watch(self.reals, self.integers, self.scratch, *states, gaps, squares)
        if not self.kept:
            return gaps, np.ones(len(times))
        return gaps, np.sqrt(np.maximum(np.linalg.eigvalsh(squares)[:, 0], 0.0))


def compile_loops(closed: ClosedChain, tree: CompiledSystem, numbers: tuple[float, float]) -> CompiledLoops:
    """The compiled form of a closed chain.

    Parameters
    ----------
    closed : ClosedChain
    tree : CompiledSystem
        Its tree, without what acts in closing joints.
    numbers : tuple of float
        Decay of violations [1/s]; what a loop that has come apart is open by [m].
    """
    mechanism, free = closed.mechanism, closed.bare.free_joints.tolist()
    loops, joints = mechanism.loops, mechanism.joints
    n, m, r = tree.size, len(closed.rows.names), len(closed.kept)
    columns, ends = n + len(joints) - len(free), loop_ends(loops)
    integers = [int(i) for i in tree.integers]
    constants, scratch = Memory(integers, tree.reals), Memory(integers, tree.scratch)
    used = np.full(m, -1)
    used[closed.kept] = np.arange(r)
    whole = own.Loops(
        loops=len(loops),
        conditions=m,
        kept=r,
        active=int(closed.efforts.any),
        rotors=int(any(loop.freedom is not None and loop.freedom.rotor_inertia for loop in loops)),
        first=put_all(constants, [_joint(constants, closed, k, loop) for k, loop in enumerate(loops)]),
        states=put_all(
            scratch, [own.loop_state(columns, int(np.count_nonzero(closed.rows.owner == k))) for k in range(len(loops))]
        ),
        room=scratch.put(own.room(len(ends), columns, n, m, r)),
        frames=address_of(tree.frames, contract.FRAMES),
        residual=address_of(tree.residual, contract.RESIDUAL),
        mass_matrix=address_of(tree.mass_matrix, contract.MASS_MATRIX),
        stiffness_and_damping=address_of(tree.stiffness_and_damping, contract.STIFFNESS_AND_DAMPING),
        closure=address_of(closure, own.CLOSURE),
        forces=address_of(actuated.forces, contract.RESIDUAL),
        masses=address_of(actuated.masses, contract.MASS_MATRIX),
        matrices=address_of(actuated.matrices, contract.STIFFNESS_AND_DAMPING),
        reach=closed.reach,
        decay=numbers[0],
        open=numbers[1],
        metres=closed.metres,
        scales=closed.row_metres,
        used=used,
        joints=np.array([free.index(k) if k in free else -1 for k in range(len(joints))]),
        motions=np.array(
            [-1 if k in free else put_curve(constants, joint.drive.motion) for k, joint in enumerate(joints)]
        ),
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
        conditions=m,
        kept=r,
    )


def _joint(memory: Memory, closed: ClosedChain, number: int, loop: Loop) -> own.ClosingJoint:
    """Record of a loop, whose curves and forces are put into memory."""
    ends = loop.outer, loop.inner
    before = len(loop_ends(closed.mechanism.loops[:number]))
    second = before + int(loop.outer.link is not None)
    places = [-1 if end.link is None else place for end, place in zip(ends, (before, second), strict=True)]
    signs, free = closed.efforts.signs[number], loop.freedom
    found = Conditions(closed.rows.kinds[number])
    joint = -1
    if free is not None and free.active:
        motion = None if loop.prescribed else free.drive.motion
        joint = memory.put(force_record(memory, free.forces, free.drive, free.rotor_inertia, motion))
    return own.ClosingJoint(
        outer=places[0],
        inner=places[1],
        first=int(np.flatnonzero(closed.rows.owner == number)[0]),
        motion=-1 if free is None or not loop.prescribed else put_curve(memory, free.drive.motion),
        along=-1 if free is None else free.freedom.row,
        joint=joint,
        zero=0.0 if free is None else free.zero,
        turned=float(signs @ closed.efforts.start),
        signs=signs,
        ground=np.stack([pose_numbers(end.frame) for end in ends]),
        lines=found.lines,
        entries=found.entries,
    )
