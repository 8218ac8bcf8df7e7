"""Derivatives of runs with contacts, stops, and joints that stick, forward and transposed: along the steps that were
accepted where forces are smooth, by steps of their own (`erls.sensitivity.passages`) where a body is pressed and before
modes switch.

Over such a passage the adjoint method takes what becomes of every change of a state: the equations of its derivatives
want as many forces, those along all coordinates and rates and those by all parameters, as the adjoint equations would.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from erls.mechanism.contacts import Stops
from erls.run.chain.run import ChainRun
from erls.sensitivity.adjoint import Seeds, stepped_back
from erls.sensitivity.equations import Equations, Walk
from erls.sensitivity.forward import stepped
from erls.sensitivity.passages import Passage
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.start import start_derivatives
from erls.sensitivity.switches import Modes, Piece, Switch
from erls.sensitivity.variants import Difference

_APART = 2.0  # times the steps of differences: what tangents see of a contact


class _Eventful:
    """A run in pieces, with what takes derivatives over them."""

    def __init__(self, run: ChainRun, differences: Sequence[Difference], scheme: Scheme) -> None:
        formulation: Any = run.formulation
        self.run, self.scheme, self.modes = run, scheme, Modes(run)
        self.own = self.modes.differences(differences)
        sticking = self.modes.sticking
        self.modes.set(np.ones(0 if sticking is None else len(sticking.rubbing.places)))
        self.equations = Equations(run, self.own, scheme, self.modes.system)
        reach = float(formulation.mechanism.reach)
        self.passage = Passage(self.equations, formulation.compiled, self.modes.held, reach)
        seen = self.equations.evaluation.steps * metre_scales(formulation)
        self.pressed = _pressed(run, _APART * float(seen.max(initial=0.0)))
        self.pieces = self.modes.pieces(run)

    def start(self, piece: Piece) -> tuple[float, Array, Array, Array]:
        """Time and state of the first knot of a piece."""
        s = self.run.solution
        at = float(np.clip(s.t[piece.first], piece.leg.first, piece.leg.last))
        return at, s.y[piece.first], s.v[piece.first], s.a[piece.first]

    def parts(self, piece: Piece) -> list[tuple[int, int, bool]]:
        """See `_parts`."""
        return list(_parts(piece, self.pressed, self.scheme.count))

    def before(self, first: int, end: int) -> tuple[Array, Array, Array]:
        """Times of a part and the knot before it, with the state there."""
        s = self.run.solution
        return s.t[first - 1 : end], s.y[first - 1], s.v[first - 1]

    def switch(self, number: int) -> Switch:
        """At the end of a piece whose modes are set."""
        return self.modes.switch(self.run, self.pieces[number], self.pieces[number + 1], self.passage, self.own)


def differentiated(run: ChainRun, differences: Sequence[Difference], scheme: Scheme) -> Array:
    """(k, 3, n, p) as of `erls.sensitivity.forward.differentiated`."""
    n, count = run.solution.y.shape[1], len(differences)
    result = np.zeros((len(run.solution.t), 3, n, count))
    if not n:
        return result
    events = _Eventful(run, differences, scheme)
    state = np.zeros((4, n, count))  # of y, v, a and α
    state[:2] = start_derivatives(run, differences)
    for number, piece in enumerate(events.pieces):
        events.modes.set(piece.modes)
        state[2] = state[3] = events.passage.gains(*events.start(piece), state[:2])
        result[piece.first] = state[:3]
        walk = Walk(piece.first, piece.end, piece.leg)
        for first, end, smooth in events.parts(piece):
            if smooth:
                state = stepped(events.equations, walk, (first, end), state, result)
                continue
            times, y, v = events.before(first, end)
            result[first:end] = events.passage.over(times, piece.leg, y, v, state[:2])
            state[:3] = result[end - 1]
            state[3] = state[2]
        if piece.switched:
            state[:2] = events.switch(number).through(state[:2])
    return result


def gradients(run: ChainRun, differences: Sequence[Difference], scheme: Scheme, seeds: Seeds, count: int) -> Array:
    """(p, c) as of `erls.sensitivity.adjoint.gradients`: the transpose of `differentiated`."""
    n = run.solution.y.shape[1]
    total = np.zeros((len(differences), count))
    if not n:
        return total
    events = _Eventful(run, differences, scheme)
    state = np.zeros((4, n, count))
    for number in range(len(events.pieces) - 1, -1, -1):
        piece = events.pieces[number]
        events.modes.set(piece.modes)
        if piece.switched:
            state[:2], by = events.switch(number).back(state[:2])
            total += by
        walk = Walk(piece.first, piece.end, piece.leg)
        for first, end, smooth in reversed(events.parts(piece)):
            if smooth:
                state = stepped_back(events.equations, walk, (first, end), seeds, state, total)
                continue
            times, y, v = events.before(first, end)
            found = events.passage.transition(times, piece.leg, y, v)
            rows = np.einsum("onq,onc->qc", found[-1], state[:3])
            rows += found[-1, 2].T @ state[3]
            for knot in seeds.keys() & set(range(first, end)):
                rows += np.einsum("onq,onc->qc", found[knot - first], seeds[knot])
            state = np.zeros_like(state)
            state[:2] = rows[: 2 * n].reshape(2, n, count)
            total += rows[2 * n :]
        if piece.first in seeds:
            state[:3] += seeds[piece.first]
        through, by = events.passage.gains_back(*events.start(piece), state[2] + state[3])
        state = np.concatenate([state[:2] + through, np.zeros((2, n, count))])
        total += by
    return np.asarray(total + np.tensordot(start_derivatives(run, differences), state[:2], ((0, 1), (0, 1))))


def _pressed(run: ChainRun, margin: float) -> Any:
    """(k,) whether a contact or a stop acts at each knot, or within a margin [m or rad] of it."""
    s, mechanism = run.solution, run.formulation.mechanism
    found = np.asarray((run.formulation.contact_series(s.t, s.y, s.v).gap < margin).any(axis=1))
    ends: list[tuple[Stops | None, Callable[[str, Array], Array], str]] = [
        (joint.forces.stops, run.joint_coordinate, joint.name) for joint in mechanism.joints
    ]
    free = [(loop.freedom, loop.name) for loop in mechanism.loops]
    ends += [(freedom.forces.stops, run.loop_coordinate, name) for freedom, name in free if freedom is not None]
    for stops, coordinate, name in ends:
        if stops is not None:
            angles = coordinate(name, s.t)
            found |= (angles < stops.lower + margin) | (angles > stops.upper - margin)
    return found


def _parts(piece: Piece, pressed: Any, nodes: int) -> Iterator[tuple[int, int, bool]]:
    """Whole steps of a piece, by the knots that they lead to, together as long as they are smooth or as they are not;
    what is left before a switch is no whole step.
    """
    steps = (piece.end - piece.first - (2 if piece.switched else 1)) // nodes
    start = piece.first + 1
    smooth = [not pressed[at - 1 : at + nodes].any() for at in range(start, start + steps * nodes, nodes)]
    if start + steps * nodes < piece.end:
        smooth.append(False)
    begun = 0
    for number in range(1, len(smooth) + 1):
        if number == len(smooth) or smooth[number] != smooth[begun]:
            yield start + begun * nodes, min(start + number * nodes, piece.end), smooth[begun]
            begun = number
