"""How far a run comes from its constraints: loops that close, joints between nodes, motions that are prescribed.

Trees in joint angles keep them by their coordinates. Runs in absolute coordinates are kept in these, too: how well
their joints hold shows in rates that are not those of the angles (`erls.accuracy.audits`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from erls.accuracy.looked_at import LookedAt
from erls.accuracy.panels import within_legs
from erls.equations.loops.closed_chain import ClosedChain
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.nodal.equations import Nodal


class Drift(NamedTuple):
    """Of constraints.

    Attributes
    ----------
    opening : float
        Farthest that a condition is from holding [m].
    speed : float
        Largest rate of one that does not vanish, at a few knots [m/s].
    worst : str
        The condition.
    """

    opening: float
    speed: float
    worst: str


def constraint_drift(look: LookedAt) -> Drift | None:
    """Of a run; None where its coordinates cannot break a constraint."""
    if look.nodal is not None:
        return _of_nodes(look.nodal, look)
    if not isinstance(look.formulation, ClosedChain) or not look.formulation.rows.names:
        return None  # elastic couplings tie nothing
    return _of_loops(look.formulation, look)


def _at(look: LookedAt) -> IntArray:
    """Knots to look at: both ends of the panels that were picked."""
    chosen = look.panels.picked(look.picked)
    return np.unique(np.concatenate([chosen.first, chosen.last, [len(look.solution.t) - 1]]))


def _of_loops(chain: ClosedChain, look: LookedAt) -> Drift:
    """Of closing joints: all conditions, those that follow from others included."""
    s = look.solution
    t, knots = within_legs(s.t), _at(look)
    gaps, _ = chain.whole.watched(t[knots], s.y[knots])
    worst, speed = int(knots[np.argmax(gaps)]), 0.0
    for k in (int(knots[len(knots) // 2]), worst):
        found = chain.closure(float(t[k]), s.y[k], s.v[k])
        speed = max(speed, float(np.abs(chain.row_metres * found.rate).max()))
    return Drift(float(gaps.max()), speed, chain.rows.names[int(np.abs(chain.openings(found)).argmax())])


def _of_nodes(nodal: Nodal, look: LookedAt) -> Drift:
    """Of joints between nodes; angles count by the size of the mechanism."""
    s, system, opening, speed, worst = look.solution, nodal.system, 0.0, 0.0, ""
    metres = np.where(system.rows.c.any(axis=1), 1.0, look.mechanism.reach)
    for k, t in zip(_at(look).tolist(), within_legs(s.t)[_at(look)].tolist(), strict=True):
        q, velocity = nodal.configuration(s.y[k], s.v[k])
        gaps = np.abs(system.constraint(t, q)) * metres
        rates = np.abs(system.constraint_matrix(t, q) @ velocity + system.constraint_rate(t, q)) * metres
        if gaps.max(initial=0.0) > opening or not worst:
            opening, worst = float(gaps.max(initial=0.0)), system.constraint_names[int(gaps.argmax())]
        speed = max(speed, float(rates.max(initial=0.0)))
    return Drift(opening, speed, worst)
