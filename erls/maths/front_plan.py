"""Which fronts eliminate a sparse matrix with a symmetric pattern, for `erls.maths.fronts`.

Unknowns come in groups that are eliminated together, in an order of least degree (J. W. H. Liu, ACM Trans. Math. Softw.
11 (1985) 141-153, as in SuperLU). What a group meets later is what it meets itself and what those that end in it meet;
groups that meet nearly the same become one front.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from erls.maths.fronts import BELOW, COUNT, FIRST, OWN, SCHUR
from fe_import.model import IntArray

_ZEROS = 0.05  # what may be stored in vain where two fronts become one, as a share of all of it
_FEW = 12  # unknowns of a front that is not worth its own


@dataclass(frozen=True)
class FrontPlan:
    """Fronts of a matrix.

    Attributes
    ----------
    groups : (g,) int array
        The groups in the order of elimination; unknowns of a group follow each other.
    fronts : (f, 7) int array
        As of `erls.maths.fronts`.
    later, into : (l,) int arrays
        Unknowns that fronts meet later, by their place in the order; their row in the front where each front ends.
    front_of : (n,) int array
        Of each unknown in the order.
    entries, stack : int
        Numbers of the factors, and of Schur complements at a time.
    products : int
        Multiplications that factors take.
    """

    groups: IntArray
    fronts: IntArray
    later: IntArray
    into: IntArray
    front_of: IntArray
    entries: int
    stack: int
    products: int


def least_degree(count: int, pairs: IntArray) -> IntArray:
    """(count,) vertices of a graph in an order of elimination; ``pairs`` (e, 2) of those that meet."""
    along, across = np.concatenate([pairs, pairs[:, ::-1]]).T
    graph = sp.coo_array((np.ones(len(along)), (along, across)), shape=(count, count)).tocsr()
    graph.data[:] = -1.0
    graph = graph + sp.diags_array(np.diff(graph.indptr) + 1.0)
    settings = {"SymmetricMode": True, "Equil": False}
    found = sla.splu(graph.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=settings)
    return np.argsort(found.perm_c).astype(np.int64)


def front_plan(order: IntArray, sizes: IntArray, pairs: IntArray) -> FrontPlan:
    """Of groups with so many unknowns each, eliminated in an order.

    Parameters
    ----------
    order : (g,) int array
        Groups, from `least_degree`.
    sizes : (g,) int array
        Unknowns of each group.
    pairs : (e, 2) int array
        Groups that meet.
    """
    parents, owns, laters = _merged(*_tree(order, pairs), sizes)
    fronts, last = [], 0
    groups: list[int] = []
    front_of_group, begins = np.zeros(len(order), dtype=np.int64), np.zeros(len(order), dtype=np.int64)
    children: dict[int, list[int]] = {}
    for f, parent in parents.items():
        children.setdefault(parent, []).append(f)
    sequence = _postorder(children)
    for k, f in enumerate(sequence):
        for group in owns[f]:
            front_of_group[group], begins[group] = k, last
            groups.append(group)
            last += int(sizes[group])
    number = {f: k for k, f in enumerate(sequence)}
    spans = [np.arange(begins[g], begins[g] + sizes[g]) for g in range(len(order))]
    listed: list[IntArray] = []
    into: list[IntArray] = []
    entries = products = 0
    below = np.ones(len(sequence), dtype=np.int64)
    for k, f in enumerate(sequence):
        rows = np.sort(np.concatenate([np.zeros(0, dtype=np.int64), *(spans[g] for g in laters[f])]))
        own, count = int(sum(sizes[g] for g in owns[f])), len(rows)
        first = int(begins[owns[f][0]])
        fronts.append([first, own, entries, sum(map(len, listed)), count, 0, 0])
        listed.append(rows)
        entries += own * (own + 2 * count)
        left = np.arange(own)[::-1]
        products += int((left * (left + count)).sum() + count * left.sum() + own * count**2)
        if parents[f] >= 0:
            below[number[parents[f]]] += below[k]
    table = np.array(fronts, dtype=np.int64)
    table[:, BELOW] = below
    for k, f in enumerate(sequence):
        if parents[f] < 0:
            continue
        up = table[number[parents[f]]]
        rows, own = listed[k], up[FIRST] + up[OWN]
        place = up[OWN] + np.searchsorted(listed[number[parents[f]]], rows)
        into.append(np.where(rows < own, rows - up[FIRST], place))
    stack = _stacked(table)
    every = np.concatenate([np.zeros(0, dtype=np.int64), *listed])
    whole = np.concatenate([np.zeros(0, dtype=np.int64), *into])
    front_of = np.repeat(np.arange(len(table)), table[:, OWN])
    return FrontPlan(np.array(groups), table, every, whole, front_of, entries, stack, products)


def _tree(order: IntArray, pairs: IntArray) -> tuple[dict[int, int], list[set[int]]]:
    """Parent of each group, -1 of roots, and the groups that it meets later."""
    place = np.argsort(order)
    meets: list[set[int]] = [set() for _ in order]
    for a, b in pairs.tolist():
        if a != b:
            first, second = (a, b) if place[a] < place[b] else (b, a)
            meets[first].add(second)
    parents = {}
    for group in order.tolist():
        own = meets[group]
        parents[group] = min(own, key=lambda g: int(place[g]), default=-1)
        if own:
            meets[parents[group]] |= own - {parents[group]}
    return parents, meets


def _merged(
    parents: dict[int, int], meets: list[set[int]], sizes: IntArray
) -> tuple[dict[int, int], dict[int, list[int]], dict[int, set[int]]]:
    """Fronts by their last group: parent, groups that each eliminates, groups that it meets later."""
    owns = {group: [group] for group in parents}
    gone: dict[int, int] = {}
    for group in list(parents):  # children come before their parents
        parent = parents[group]
        if parent < 0:
            continue
        own, up = (int(sum(sizes[g] for g in owns[f])) for f in (group, parent))
        count, above = (int(sum(sizes[g] for g in meets[f])) for f in (group, parent))
        apart = own * (own + 2 * count) + up * (up + 2 * above)
        whole = (own + up) * (own + up + 2 * above)
        if max(own, up) <= _FEW or whole - apart <= _ZEROS * whole:
            owns[parent] = owns[group] + owns[parent]
            gone[group] = parent

    def kept(f: int) -> int:
        while f in gone:
            f = gone[f]
        return f

    left = [f for f in parents if f not in gone]
    return {f: kept(parents[f]) for f in left}, {f: owns[f] for f in left}, {f: meets[f] for f in left}


def _postorder(children: dict[int, list[int]]) -> list[int]:
    """Fronts, those that end in one right before it."""
    found: list[int] = []
    waiting = list(children.get(-1, []))
    while waiting:
        f = waiting.pop()
        found.append(f)
        waiting += children.get(f, [])
    return found[::-1]


def _stacked(table: IntArray) -> int:
    """Places of Schur complements, each in the first gap that holds it; the length that they take."""
    live: list[tuple[int, int, int]] = []  # begin, end, front
    length = 0
    for f, (count, below) in enumerate(table[:, [COUNT, BELOW]].tolist()):
        begin = 0
        for start, end, _ in live:
            if start - begin >= count**2:
                break
            begin = end
        table[f, SCHUR], length = begin, max(length, begin + count**2)
        live = sorted([x for x in live if x[2] <= f - below] + [(begin, begin + count**2, f)])
    return length
