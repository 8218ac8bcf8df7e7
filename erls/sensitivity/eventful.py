"""Direct differentiation of runs with contacts, stops, and joints that stick: along the steps that were accepted where
forces are smooth, by steps of their own (`erls.sensitivity.passages`) where a body is pressed and before modes switch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from erls.mechanism.contacts import Stops
from erls.run.chain.run import ChainRun
from erls.sensitivity.equations import Equations, Walk
from erls.sensitivity.forward import stepped
from erls.sensitivity.passages import Passage
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.start import start_derivatives
from erls.sensitivity.switches import Modes, Piece
from erls.sensitivity.variants import Difference

_APART = 2.0  # times the steps of differences: what tangents see of a contact


def differentiated(run: ChainRun, differences: Sequence[Difference], scheme: Scheme) -> Array:
    """(k, 3, n, p) as of `erls.sensitivity.forward.differentiated`."""
    s = run.solution
    formulation: Any = run.formulation
    n, count = s.y.shape[1], len(differences)
    result = np.zeros((len(s.t), 3, n, count))
    if not n:
        return result
    modes = Modes(run)
    own = modes.differences(differences)
    modes.set(np.ones(0 if modes.sticking is None else len(modes.sticking.rubbing.places)))
    equations = Equations(run, own, scheme, modes.system)
    passage = Passage(equations, formulation.compiled, modes.held, float(formulation.mechanism.reach))
    pressed = _pressed(run, _APART * float((equations.evaluation.steps * metre_scales(formulation)).max(initial=0.0)))
    state = np.zeros((4, n, count))  # of y, v, a and α
    state[:2] = start_derivatives(run, differences)
    pieces = modes.pieces(run)
    for number, piece in enumerate(pieces):
        modes.set(piece.modes)
        t, y, v = (x[piece.first] for x in (s.t, s.y, s.v))
        at = float(np.clip(t, piece.leg.first, piece.leg.last))
        state[2] = state[3] = passage.gains(at, y, v, s.a[piece.first], state[:2])
        result[piece.first] = state[:3]
        walk = Walk(piece.first, piece.end, piece.leg)
        for first, end, smooth in _parts(piece, pressed, scheme.count):
            if smooth:
                state = stepped(equations, walk, (first, end), state, result)
                continue
            times = s.t[first - 1 : end]
            result[first:end] = passage.over(times, piece.leg, s.y[first - 1], s.v[first - 1], state[:2])
            state[:3] = result[end - 1]
            state[3] = state[2]
        if piece.switched:
            state[:2] = modes.through(run, piece, pieces[number + 1], state[:2], passage, own)
    return result


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
