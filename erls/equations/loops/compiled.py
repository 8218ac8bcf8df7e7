"""The constants of loops over a compiled chain, packed for `erls.equations.loops`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.erls import layout as joint_layout
from erls.equations.erls.compiled import combined_modes
from erls.equations.loops import layout, nearest, system
from erls.equations.loops.closure import closure
from erls.equations.loops.rows import conditions
from erls.equations.serial.packing import Packer, joint_numbers
from erls.maths.so3 import Array
from erls.mechanism.links import node_shape6
from erls.mechanism.loops import Loop, LoopEnd

if TYPE_CHECKING:
    from erls.equations.erls.chain import Erls
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
        if nearest.close(closure, self.reals, self.integers, self.scratch, t, place, rate):
            return y, v
        return place, rate

    def watched(self, times: Array, places: Array) -> tuple[Array, Array]:
        """At each of ``places`` (k, n) the largest opening [m] and the smallest singular value of the conditions."""
        gaps, squares = np.empty(len(times)), np.empty((len(times), self.kept, self.kept))
        states = times, np.ascontiguousarray(places)
        nearest.watch(closure, self.reals, self.integers, self.scratch, *states, gaps, squares)
        if not self.kept:
            return gaps, np.ones(len(times))
        return gaps, np.sqrt(np.maximum(np.linalg.eigvalsh(squares)[:, 0], 0.0))


def compile_loops(
    closed: ClosedChain, tree: Erls, chain: CompiledSystem, numbers: tuple[float, float]
) -> CompiledLoops:
    """The compiled form of a closed chain.

    Parameters
    ----------
    closed : ClosedChain
    tree : Erls
        Its chain, without what acts in closing joints.
    chain : CompiledSystem
        Compiled form of that.
    numbers : tuple of float
        Decay of violations [1/s]; what a loop that has come apart is open by [m].
    """
    pack = Packer(chain.integers, chain.reals)
    n, m, r, links = tree.size, len(closed.rows.names), len(closed.kept), len(tree.mechanism.links)
    loops = tree.mechanism.loops
    records = [_loop(pack, closed, tree, k, loop) for k, loop in enumerate(loops)]
    rows, factors = _conditions(closed)
    header = np.zeros(layout.HEADER, dtype=np.int64)
    header[[layout.LOOPS, layout.CONDITIONS, layout.KEPT]] = len(loops), m, r
    header[layout.ACTIVE] = int(closed.efforts.any)
    header[layout.ROTORS] = int(any(loop.freedom is not None and loop.freedom.rotor_inertia for loop in loops))
    header[layout.FACTORS], header[layout.METRES] = pack.put(factors), pack.put(closed.metres)
    header[layout.NUMBERS] = pack.put(np.array([closed.reach, *numbers]))
    header[layout.RECORDS] = len(pack.integers)
    pack.integers += [i for record in records for i in record]
    header[layout.ROWS] = len(pack.integers)
    pack.integers += [i for row in rows for i in row]
    sizes = {
        layout.WORLD: 12 * links,
        layout.MOTIONS: layout.MOTION * len(loops),
        layout.VIOLATION: 3 * m,
        layout.GRADIENT: r * n,
        layout.EFFORTS: len(loops) * (n + layout.EFFORT),
        layout.MASS: n * n,
        layout.FACTOR: n * n,
        layout.DAMPING: n * n,
        layout.SPREAD: r * n,
        layout.FLEXIBLE: r * r,
        layout.REDUCED: max(n, r),
        layout.MULTIPLIERS: max(n, r),
    }
    memory = len(chain.scratch)
    for place, size in sizes.items():
        header[place] = memory
        memory += size
    start = len(pack.integers)
    pack.integers += [*map(int, header), start]
    return CompiledLoops(
        size=n,
        reals=pack.reals,
        integers=np.array(pack.integers, dtype=np.int64),
        scratch=np.zeros(memory),
        residual=system.residual,
        mass_matrix=system.mass_matrix,
        stiffness_and_damping=system.stiffness_and_damping,
        load_acceleration=lambda: system.acceleration,
        conditions=m,
        kept=r,
    )


def _loop(pack: Packer, closed: ClosedChain, tree: Erls, number: int, loop: Loop) -> list[int]:
    """Record of a loop."""
    record = [0] * layout.RECORD
    for end, at in ((loop.outer, layout.OUTER), (loop.inner, layout.INNER)):
        record[at : at + 2] = (-1 if end.link is None else end.link), pack.put(_end(tree, end))
    last = int(closed.rows.ends[number])
    count = int(np.count_nonzero(closed.rows.owner == number))
    record[layout.FIRST], record[layout.COUNT] = last - count, count
    record[layout.PRESCRIBED] = record[layout.ALONG] = record[layout.FREEDOM] = record[layout.ACTS] = -1
    free = loop.freedom
    if free is None:
        return record
    record[layout.PRESCRIBED] = pack.put_curve(free.drive.motion if loop.prescribed else None)
    record[layout.ALONG] = free.type.free_row
    signs = closed.efforts.signs[number]
    record[layout.FREEDOM] = pack.put(np.array([free.zero, signs @ closed.efforts.start, *signs]))
    if free.active:
        forces = pack.put(joint_numbers(free.forces, free.drive, free.rotor_inertia, 0.0))
        acting = [0] * joint_layout.RECORD
        acting[joint_layout.MOTION] = pack.put_curve(None if loop.prescribed else free.drive.motion)
        acting[joint_layout.LOAD], acting[joint_layout.FORCES] = pack.put_curve(free.drive.load), forces
        record[layout.ACTS] = len(pack.integers)
        pack.integers += acting
    return record


def _end(tree: Erls, end: LoopEnd) -> Array:
    """Constants of a joint's frame on a link, or on the ground."""
    frame = np.concatenate([end.frame[:3, :3].ravel(), end.frame[:3, 3]])
    if end.link is None:
        return frame
    link = tree.mechanism.links[end.link]
    shapes = np.vstack(node_shape6(link.model, end.node)) @ combined_modes(link, tree.compatibility.rows[end.link].own)
    return np.concatenate([link.model.nodes[end.node], frame, shapes.T.ravel()])


def _conditions(closed: ClosedChain) -> tuple[list[list[int]], Array]:
    """Records of all conditions, and their factors."""
    rows: list[list[int]] = []
    factors = np.zeros((len(closed.rows.names), 3))
    factors[:, layout.SCALE] = closed.row_metres
    used = {int(row): place for place, row in enumerate(closed.kept)}
    for kind in closed.rows.kinds:
        for line, turns in conditions(kind).entries:
            number = len(rows)
            entries = [0, 0, 0, 0]
            for term, (factor, i, j) in enumerate(turns or ()):
                factors[number, term] = factor
                entries[2 * term : 2 * term + 2] = i, j
            rows.append([line if turns is None else -1, *entries, used.get(number, -1)])
    return rows, factors
