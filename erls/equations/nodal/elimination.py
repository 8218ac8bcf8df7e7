"""How the iteration matrix of a nodal system is eliminated: as a band, or front by front where that is less work.

Bands are for chains of any length, and exchange rows at will. Fronts are for surfaces; conditions come after both nodes
of their joint there, so that every leading block is regular as long as every node has mass.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from erls.equations.nodal.joints import JointRows
from erls.equations.nodal.scatter import IntArray
from erls.maths.front_plan import FrontPlan, front_plan, least_degree

_PRODUCT, _ENTRY = 0.5, 8.0  # of fronts, measured beside a product of a band: rows are read once for four, but found
_CHAIN = 12  # width of the band of a chain: two neighbouring nodes


def _none() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Elimination:
    """Order of all unknowns N, and memory of the factors.

    Attributes
    ----------
    place : (N,) int array
        Number of each unknown in the order.
    width : int
        Of the band; -1 where there are fronts.
    entries, stack : int
        Numbers of the factors, and what else they take.
    work : float
        Of a factorization, in products of a band.
    fronts, front_of, later, into : int arrays
        As of `erls.maths.front_plan.FrontPlan`; empty for a band.
    """

    place: IntArray
    width: int
    entries: int
    work: float
    stack: int = 0
    fronts: IntArray = field(default_factory=lambda: np.zeros((0, 7), dtype=np.int64))
    front_of: IntArray = field(default_factory=_none)
    later: IntArray = field(default_factory=_none)
    into: IntArray = field(default_factory=_none)


def elimination(count: int, pairs: IntArray, rows: JointRows, heavy: bool) -> Elimination:
    """Whichever takes less.

    Parameters
    ----------
    count : int
        Nodes.
    pairs : (E, 2) int array
        Nodes of all elements.
    rows : JointRows
    heavy : bool
        Whether every node has mass.
    """
    band = banded(count, pairs, rows)
    if not heavy or band.width < _CHAIN:
        return band
    fronts = fronted(count, pairs, rows)
    return fronts if fronts.work < band.work else band


def banded(count: int, pairs: IntArray, rows: JointRows) -> Elimination:
    """As a band."""
    place, width = band_order(count, pairs, rows)
    return Elimination(place, width, len(place) * (3 * width + 1), 2.0 * len(place) * width**2)


def fronted(count: int, pairs: IntArray, rows: JointRows) -> Elimination:
    """Front by front; every node has mass."""
    own, places = node_fronts(count, pairs, rows)
    work = _PRODUCT * own.products + _ENTRY * own.entries
    return Elimination(places, -1, own.entries, work, own.stack, own.fronts, own.front_of, own.later, own.into)


def node_fronts(count: int, pairs: IntArray, rows: JointRows) -> tuple[FrontPlan, IntArray]:
    """Fronts of nodes with the conditions of joints that lead to earlier ones; (N,) place of each unknown."""
    every = np.concatenate([pairs, rows.nodes])
    every = every[(every >= 0).all(axis=1)]
    order = least_degree(count, every)
    turn = np.argsort(order)
    ends = np.where(rows.nodes >= 0, turn[rows.nodes], -1).max(axis=1)
    carrier = order[ends][rows.joint_of_row] if len(rows.names) else _none()
    sizes = 6 + np.bincount(carrier, minlength=count)
    plan = front_plan(order, sizes, every)
    begins = np.zeros(count, dtype=np.int64)
    begins[plan.groups] = np.cumsum(sizes[plan.groups]) - sizes[plan.groups]
    places = np.concatenate([(begins[:, None] + np.arange(6)).ravel(), np.zeros(len(carrier), dtype=np.int64)])
    taken = begins + 6
    for row, node in enumerate(carrier.tolist()):
        places[6 * count + row] = taken[node]
        taken[node] += 1
    return plan, places


def band_order(count: int, pairs: IntArray, rows: JointRows) -> tuple[IntArray, int]:
    """Numbers of all unknowns in the band, nodes and joints by the reverse Cuthill-McKee order; width of the band.

    E. Cuthill, J. McKee, Proc. 24th Nat. Conf. ACM (1969) 157–172.
    """
    joints = len(rows.joints)
    groups = [*pairs, *(np.append(pair, count + k) for k, pair in enumerate(rows.nodes))]
    of_joints = np.bincount(rows.joint_of_row, minlength=joints).tolist()
    return _ordered(tuple(tuple(g[g >= 0].tolist()) for g in groups), (*count * [6], *of_joints))


@lru_cache(maxsize=16)
def _ordered(groups: tuple[tuple[int, ...], ...], sizes: tuple[int, ...]) -> tuple[IntArray, int]:
    """Of unknowns in blocks of these sizes, all in each group together; systems of other constants have the same."""
    along = np.array([i for g in groups for i in g for _ in g], dtype=np.int64)
    across = np.array([j for g in groups for _ in g for j in g], dtype=np.int64)
    graph = sp.csr_array((np.ones(len(along)), (along, across)), shape=(len(sizes), len(sizes)))
    own = np.cumsum([0, *sizes])
    places = np.zeros(own[-1], dtype=np.int64)
    last = 0
    for block in reverse_cuthill_mckee(graph, symmetric_mode=True):
        places[own[block] : own[block + 1]] = np.arange(last, last + sizes[block])
        last += sizes[block]
    places.setflags(write=False)
    spans = [np.concatenate([places[own[b] : own[b + 1]] for b in g]) for g in groups if g]
    return places, max((int(np.ptp(s)) for s in spans if len(s)), default=5)
