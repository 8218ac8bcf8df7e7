"""Derivatives of a tape (`erls.maths.tracing`) as programs of sums of products, which eight states run side by side.

What depends on what is a graph whose edges are partial derivatives, of single operations. A number in between is
eliminated by giving each of what it was made of, u, to each of what is made of it, w, the edge u → w of d_uw + d_uv
d_vw: what is left are edges from inputs to outputs, the Jacobian matrix. The order is free; the cheapest one at each
time (Markowitz) finds by itself that coordinates of a link act on other links by the motion of its interface alone.
All of it is done with numbers of places, once for all states; the program that it leaves does it with values.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from erls.maths.tracing import LEAF, PRODUCT, SUM, Tape
from fe_import.model import IntArray

Plan = NDArray[np.uint32]
ZERO, ONE, MINUS = range(3)
"""Places of constants in the memory of a program."""


@dataclass(frozen=True)
class Program:
    """What is to be done with the numbers of a memory of ``size`` rows, a row for each number of eight states.

    Attributes
    ----------
    size : int
    leaves : (l,) array
        Numbers of the tape whose values come from outside, constants, inputs and literals, in the rows from 3 on.
    sums : (m, 4) array of uint32
        Rows t, s, a, b of t = s + a b, one after the other.
    functions : (f, 4) array of uint32
        After how many sums, number in `erls.maths.tracing.FUNCTIONS`, rows of value and number.
    guards : (g, 4) array of uint32
        Number in `erls.maths.tracing.COMPARISONS`, rows compared, and whether it must hold.
    guarded : (2,) array of int
        Sums and functions before guards are looked at.
    outputs : (o,) array
        Rows of results.
    """

    size: int
    leaves: IntArray
    sums: Plan
    functions: Plan
    guards: Plan
    guarded: IntArray
    outputs: IntArray


class _Writer:
    """A program in the making, whose numbers have places of their own; rows are given at the end."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.sums: list[tuple[int, int, int, int]] = []
        self.functions: list[tuple[int, int, int, int]] = []
        self.guarded = (0, 0)
        self.next = 3  # after the constants
        self.of: dict[int, int] = {}  # places of numbers of the tape
        self.leaves: list[int] = []

    def add(self, s: int, a: int, b: int) -> int:
        """The place of s + a b."""
        self.sums.append((self.next, s, a, b))
        self.next += 1
        return self.next - 1

    def times(self, a: int, b: int) -> int:
        """Of a b."""
        if ONE in (a, b):
            return b if a == ONE else a
        return ONE if a == b == MINUS else self.add(ZERO, a, b)

    def values(self, wanted: Sequence[int]) -> None:
        """Write what makes numbers of the tape."""
        tape, kinds = self.tape, self.tape.kinds
        needed, uses = _ancestors(tape, wanted), [0] * len(tape)
        for k in needed:
            if kinds[k] != LEAF:
                uses[tape.firsts[k]] += 1
                if tape.seconds[k] >= 0:
                    uses[tape.seconds[k]] += 1
        for k in wanted:
            uses[k] += 1
        within = {}  # products that go into one sum alone
        for k in needed:
            if kinds[k] == SUM:
                pair = [(tape.seconds[k], tape.firsts[k]), (tape.firsts[k], tape.seconds[k])]
                found = next(
                    (p for p in pair if kinds[p[0]] == PRODUCT and uses[p[0]] == 1 and p[0] not in self.of), None
                )
                if found is not None:
                    within[k] = found
        skipped = {product for product, _ in within.values()}
        for k in needed:
            if k in skipped or k in self.of:
                continue
            first, second = tape.firsts[k], tape.seconds[k]
            if kinds[k] == LEAF:
                self.of[k] = self.next
                self.next += 1
                self.leaves.append(k)
            elif k in within:
                product, other = within[k]
                factors = tape.firsts[product], tape.seconds[product]
                self.of[k] = self.add(self.of[other], *(self.of[x] for x in factors))
            elif kinds[k] == SUM:
                self.of[k] = self.add(self.of[first], self.of[second], ONE)
            elif kinds[k] == PRODUCT:
                self.of[k] = self.add(ZERO, self.of[first], self.of[second])
            else:
                self.of[k] = self.next
                self.next += 1
                self.functions.append((len(self.sums), kinds[k] - PRODUCT - 1, self.of[k], self.of[first]))

    def program(self, outputs: Sequence[int]) -> Program:
        """With places of results."""
        guards = [(which, self.of[x], self.of[y], int(holds)) for which, x, y, holds in self.tape.guards]
        kept = {ZERO, ONE, MINUS, *(self.of[k] for k in self.leaves), *outputs}
        kept |= {place for _, x, y, _ in guards for place in (x, y)}
        row, size = _rows(self, kept)
        return Program(
            size,
            np.array(self.leaves, dtype=np.int64),
            row[np.array(self.sums, dtype=np.int64).reshape(-1, 4)].astype(np.uint32),
            np.array([(n, f, row[t], row[s]) for n, f, t, s in self.functions], dtype=np.uint32).reshape(-1, 4),
            np.array([(w, row[x], row[y], h) for w, x, y, h in guards], dtype=np.uint32).reshape(-1, 4),
            np.array(self.guarded, dtype=np.int64),
            row[np.array(outputs, dtype=np.int64)],
        )


def _ancestors(tape: Tape, wanted: Sequence[int]) -> list[int]:
    """Numbers that numbers are made of, and themselves, in the order of the tape."""
    needed = np.zeros(len(tape), dtype=bool)
    needed[list(wanted)] = True
    for k in range(len(tape) - 1, -1, -1):
        if needed[k] and tape.kinds[k] != LEAF:
            needed[tape.firsts[k]] = True
            if tape.seconds[k] >= 0:
                needed[tape.seconds[k]] = True
    return np.flatnonzero(needed).tolist()


def _rows(writer: _Writer, kept: set[int]) -> tuple[IntArray, int]:
    """Rows of all places, used again after their last use, and how many there are."""
    last = np.zeros(writer.next, dtype=np.int64)
    steps: list[tuple[int, tuple[int, ...]]] = []
    functions = iter([*writer.functions, (len(writer.sums) + 1, 0, 0, 0)])
    due = next(functions)
    for k in range(len(writer.sums) + 1):
        while due[0] == k:
            steps.append((due[2], (due[3],)))
            due = next(functions)
        if k < len(writer.sums):
            steps.append((writer.sums[k][0], writer.sums[k][1:]))
    for k, (_, read) in enumerate(steps):
        for place in read:
            last[place] = k
    row = np.full(writer.next, -1, dtype=np.int64)
    row[:3] = range(3)
    free: list[int] = []
    size = 3
    for place in writer.leaves:
        row[writer.of[place]] = size
        size += 1
    for k, (made, read) in enumerate(steps):
        for place in set(read):
            if last[place] == k and place not in kept:
                free.append(int(row[place]))
        if free:
            row[made] = free.pop()
        else:
            row[made] = size
            size += 1
        if last[made] == 0 and made not in kept:
            free.append(int(row[made]))
    return row, size


def _edges(tape: Tape, k: int, nothing: list[bool]) -> list[tuple[int, int]]:
    """Numbers that a number was made of, with the number that is the slope; -1 of one."""
    kind, first, second = tape.kinds[k], tape.firsts[k], tape.seconds[k]
    if kind == SUM:
        return [(first, -1), (second, -1)]
    if kind == PRODUCT:
        return [(x, y) for x, y in ((first, second), (second, first)) if not nothing[y]]
    return [(first, tape.slope(k))]


def _nothing(tape: Tape, leaves: Sequence[int]) -> list[bool]:
    """Which numbers are zero whatever the others are, of leaves that are."""
    found = [False] * len(tape)
    for k in leaves:
        found[k] = True
    for k in tape.literals.values():
        found[k] = tape.values[k] == 0.0
    for k in range(len(tape)):
        first, second = tape.firsts[k], tape.seconds[k]
        if tape.kinds[k] == SUM:
            found[k] = found[first] and found[second]
        elif tape.kinds[k] == PRODUCT:
            found[k] = found[first] or found[second]
    return found


def _between(tape: Tape, inputs: Sequence[int], outputs: Sequence[int]) -> list[bool]:
    """Which numbers depend on some, and lead to others."""
    moved = [False] * len(tape)
    for k in inputs:
        moved[k] = True
    for k in range(len(tape)):
        if tape.kinds[k] != LEAF:
            second = tape.seconds[k]
            moved[k] = moved[tape.firsts[k]] or (second >= 0 and moved[second])
    needed = _ancestors(tape, outputs)
    found = [False] * len(tape)
    for k in needed:
        found[k] = moved[k]
    return found


def jacobian(
    tape: Tape, inputs: Sequence[int], outputs: Sequence[int], zeros: Sequence[int]
) -> tuple[Program, IntArray]:
    """Derivatives of numbers by others: a program, and (o, 2) which output by which input each result is.

    Parameters
    ----------
    tape : Tape
    inputs, outputs : sequences of int
        Places on the tape; inputs are leaves.
    zeros : sequence of int
        Leaves that are always zero.
    """
    nothing, size = _nothing(tape, zeros), len(tape)
    active = _between(tape, inputs, outputs)
    edges: dict[int, list[tuple[int, int]]] = {}
    for k in range(size):
        if active[k] and tape.kinds[k] != LEAF and not nothing[k]:
            edges[k] = [(x, slope) for x, slope in _edges(tape, k, nothing) if active[x] and not nothing[x]]
    slopes = {slope for some in edges.values() for _, slope in some if slope >= 0}
    guards = [x for guard in tape.guards for x in guard[1:3]]
    writer = _Writer(tape)
    writer.values(guards)
    writer.guarded = len(writer.sums), len(writer.functions)
    writer.values(sorted(slopes))
    into: dict[int, dict[int, int]] = {k: {} for k in inputs}
    out: dict[int, dict[int, int]] = {k: {} for k in inputs}
    for k, some in edges.items():
        into[k], out[k] = {}, {}
        for x, slope in some:
            _join(writer, into, out, x, k, ONE if slope < 0 else writer.of[slope])
    ends = dict.fromkeys(outputs)
    for k in ends:  # a result that is an input, or goes on, keeps a number of its own
        into.setdefault(k, {})
        out.setdefault(k, {})
    results: dict[int, int] = {}
    for number, k in enumerate(ends):
        results[size + number] = k
        into[size + number], out[size + number] = {}, {}
        _join(writer, into, out, k, size + number, ONE)
    _eliminate(writer, into, out, set(inputs))
    column = {k: j for j, k in enumerate(inputs)}
    rows = {k: [i for i, x in enumerate(outputs) if x == k] for k in ends}
    found, places = [], []
    for end, k in results.items():
        for x, place in into[end].items():
            for i in rows[k]:
                found.append(place)
                places.append((i, column[x]))
    return writer.program(found), np.array(places, dtype=np.int64).reshape(-1, 2)


def _join(
    writer: _Writer, into: dict[int, dict[int, int]], out: dict[int, dict[int, int]], u: int, w: int, place: int
) -> None:  # fmt: skip
    """One more edge from u to w, beside those that there are."""
    known = into[w].get(u)
    new = place if known is None else writer.add(known, place, ONE)
    into[w][u] = out[u][w] = new


def _eliminate(
    writer: _Writer, into: dict[int, dict[int, int]], out: dict[int, dict[int, int]], inputs: set[int]
) -> None:
    """All numbers between inputs and results, the cheapest one at each time."""
    last = max(into)
    within = [k for k in into if k not in inputs and out[k]]
    heap = [(len(into[k]) * len(out[k]), -k) for k in within]
    heapq.heapify(heap)
    while heap:
        cost, k = heapq.heappop(heap)
        k = -k
        if k not in into:
            continue
        before, after = into[k], out[k]
        now = len(before) * len(after)
        if now > cost:
            heapq.heappush(heap, (now, -k))
            continue
        for u, first in before.items():
            own = out[u]
            del own[k]
            for w, second in after.items():
                known = own.get(w)
                place = writer.times(first, second) if known is None else writer.add(known, first, second)
                own[w] = place
                into[w][u] = place
        for w in after:
            del into[w][k]
        del into[k], out[k]
        for w in after:
            if out[w] and w <= last:
                heapq.heappush(heap, (len(into[w]) * len(out[w]), -w))
        for u in before:
            if u not in inputs:
                heapq.heappush(heap, (len(into[u]) * len(out[u]), -u))
