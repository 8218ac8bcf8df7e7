"""Nodal inversions over all steps at once, by Lie-group generalized-α with β = 0 and γ = 1/2:

    q₊ = q ∘ exp(d),    d = h v + h²/2 v̇,    v₊ = v + h/2 (v̇ + v̇₊),

so that with the steps d₋ and d before and after a knot v = (d₋ + d) / 2h and v̇ = (d - d₋) / h²: the poses of all knots
are all there is to find. Marched forward that member of the family is explicit and ends where steps are longer than
2 / ω. Over all steps at once it is the other way round: what is faster has one root z + 1/z = 2 - h² ω² that grows and
one that decays, so that it follows what is slow from both sides, statically and with its accelerations to second order.
Stiff motions along axes, which neither grow nor decay, and ring without end in steps that keep them (357 N m in a
prototype), have nothing to start from. No basis of modes is needed for that.

Forces are in balance and all conditions hold at every knot, and at one knot more on either side conditions alone;
what holds there besides is `erls.inverse.nodal.ends`. Newton's method solves one sparse system over all knots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from erls.equations.nodal.nodes import Nodes
from erls.errors import Cause, SimulationError
from erls.inverse.conditions import Demand
from erls.inverse.nodal.ends import bounded
from erls.inverse.nodal.servoed import Forces, NodalServoed, Rest
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array

_ITERATIONS = 30
_TOLERANCE = 1e-8  # of the size of the mechanism: changes fall by their square, so that the next one is rounding


class NodalStates(NamedTuple):
    """Nodes at k knots, multipliers and efforts (k, m + p), and iterations."""

    q: list[Nodes]
    holding: Array
    iterations: int


@dataclass
class _Entries:
    """Of a sparse matrix."""

    rows: list[Array] = field(default_factory=list)
    columns: list[Array] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)

    def add(self, blocks: Array, rows: Array, columns: Array) -> None:
        """Blocks (k, r, c) at rows (k,) and columns (k,)."""
        k, i, j = np.nonzero(blocks)
        self.rows.append(rows[k] + i)
        self.columns.append(columns[k] + j)
        self.values.append(blocks[k, i, j])

    def matrix(self, size: int) -> sp.csc_array:
        """(size, size)"""
        places = np.concatenate(self.rows), np.concatenate(self.columns)
        return sp.csc_array((np.concatenate(self.values), places), shape=(size, size))


class _TwoPoint:
    """The system over all knots: a step of Newton's method from states.

    Unknowns are increments (n,) of the knot ahead, increments, multipliers and efforts (n + m + p,) of all knots, and
    increments of the knot behind.
    """

    def __init__(self, servoed: NodalServoed, demand: Demand, h: float, first: Rest, last: Rest) -> None:
        self.servoed, self.demand, self.h, self.rests = servoed, demand, h, (first, last)
        self.ends = bounded(first, last, servoed.metres, h)
        n, own = servoed.size, servoed.size + servoed.holding
        count = len(demand.t)
        self.size = 2 * n + count * own
        self._at = np.concatenate([[0], n + own * np.arange(count), [n + count * own]])  # columns of knots
        self._blocks = n, own
        self._first = servoed.holding + len(self.ends[0].first)  # row of the first knot

    def step(self, q: list[Nodes], holding: Array) -> tuple[Array, Array]:
        """Increments (k + 2, n) of all knots, changes (k, m + p) of multipliers and efforts."""
        poses = np.array([each.poses for each in q])
        steps = motions.log(motions.inverse(poses[:-1]) @ poses[1:])
        motion = (steps[1:] + steps[:-1]) / (2 * self.h), (steps[1:] - steps[:-1]) / self.h**2
        flat = motion[0].reshape(len(holding), -1), motion[1].reshape(len(holding), -1)
        found = self.servoed.forces(self.demand, q[1:-1], flat, holding)
        matrix, right = _Entries(), np.zeros(self.size)
        self._knots(matrix, right, found, steps)
        self._end(matrix, right, q, False)
        self._end(matrix, right, q, True)
        solved = self._solved(matrix, right, found)
        n, own = self._blocks
        middle = solved[n:-n].reshape(-1, own)
        return np.vstack([solved[:n], middle[:, :n], solved[-n:]]), middle[:, n:]

    def _knots(self, matrix: _Entries, right: Array, found: Forces, steps: Array) -> None:
        """Balance and conditions at all knots."""
        n, own = self._blocks
        at, h = self._at[1:-1], self.h
        rows = at - n + self._first
        damping, mass = found.damping / (2 * h), found.mass / h**2
        fore, back = motions.tangent_inverse(steps), motions.tangent_inverse(-steps)  # of d by its ends
        matrix.add(_times(mass + damping, fore[1:]), rows, self._at[2:])
        matrix.add(_times(mass - damping, back[:-1]), rows, self._at[:-2])
        here = found.stiffness + _times(damping, fore[:-1] - back[1:]) - _times(mass, back[1:] + fore[:-1])
        matrix.add(here, rows, at)
        matrix.add(found.pushed, rows, at + n)
        matrix.add(found.rows, rows + n, at)
        right[rows[0] : rows[-1] + own] = -np.hstack([found.force, found.open]).ravel()

    def _end(self, matrix: _Entries, right: Array, q: list[Nodes], last: bool) -> None:
        """Conditions at the knot beyond an end, and what is bounded there."""
        servoed, n = self.servoed, self._blocks[0]
        rest, rows, beyond, beside = self.rests[last], self.ends[last], -last, -2 if last else 1
        demand = self.demand.part(slice(-1, None) if last else slice(0, 1))
        still = np.zeros((1, n))
        there = servoed.forces(demand, [q[beyond]], (still, still), np.zeros((1, servoed.holding)))
        at = self._first + len(self.demand.t) * self._blocks[1] if last else 0
        matrix.add(there.rows, np.array([at]), self._at[[beyond]])
        right[at : at + servoed.holding] = -there.open[0]
        below = at + servoed.holding
        pair = (beside, beyond) if last else (beyond, beside)
        for part, k in zip(rows, pair, strict=True):
            matrix.add(part[None], np.array([below]), self._at[[k]])
            away = motions.log(motions.inverse(rest.q.poses) @ q[k].poses).ravel()
            right[below : below + len(part)] -= part @ away

    def _solved(self, matrix: _Entries, right: Array, found: Forces) -> Array:
        """In metres, and newtons per mass times h²; every row by its largest entry."""
        n, own = self._blocks
        metres = self.servoed.metres
        mass = float((np.einsum("kii->ki", found.mass) / metres**2).max()) or 1.0
        each = np.concatenate([1 / metres, np.full(own - n, mass / self.h**2)])
        units = np.concatenate([1 / metres, np.tile(each, len(found.force)), 1 / metres])
        whole = matrix.matrix(self.size) @ sp.diags_array(units)
        rows = 1 / np.maximum(abs(whole).max(axis=1).toarray().ravel(), np.finfo(float).tiny)
        try:
            factors = splu(sp.csc_array(sp.diags_array(rows) @ whole))
        except RuntimeError as problem:
            raise np.linalg.LinAlgError(str(problem)) from None
        return np.asarray(units * factors.solve(rows * right))


def _times(blocks: Array, nodes: Array) -> Array:
    """(k, n, n) matrices times those of each node (k, N, 6, 6)."""
    k, n, _ = blocks.shape
    split = blocks.reshape(k, n, -1, 6).transpose(0, 2, 1, 3)
    return np.asarray((split @ nodes).transpose(0, 2, 1, 3).reshape(k, n, n))


def solved(
    servoed: NodalServoed,
    demand: Demand,
    h: float,
    q: list[Nodes],
    holding: Array,
    told: Callable[[int, float], None] = lambda iteration, change: None,
) -> NodalStates:
    """From a first guess of configurations, multipliers and efforts (k, m + p).

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM, UNSTABLE_INVERSE at the ends; NEWTON_FAILED: says where.
    """
    first, last = (servoed.rest(demand.part(part), q[part][0]) for part in (slice(0, 1), slice(-1, None)))
    system = _TwoPoint(servoed, demand, h, first, last)
    every, worst, far = [first.q, *q, last.q], np.inf, np.zeros(1)
    for iteration in range(1, _ITERATIONS + 1):
        steps, changes = system.step(every, holding)
        far = np.abs(steps * servoed.metres).max(axis=1)
        worst = float(far.max())
        told(iteration, worst)
        if not np.isfinite(worst):
            break
        every = [servoed.system.compose(each, step) for each, step in zip(every, steps, strict=True)]
        holding = holding + changes
        if worst <= _TOLERANCE * servoed.reach:
            return NodalStates(every[1:-1], holding, iteration)
    place = min(max(int(np.argmax(np.nan_to_num(far, nan=np.inf))) - 1, 0), len(demand.t) - 1)
    raise SimulationError(
        Cause.NEWTON_FAILED,
        "Newton's method over all steps does not converge on nodal elements",
        where=f"t = {float(demand.t[place]):.6g} s",
        value=f"change {worst:.3g} m",
        limit=f"{_TOLERANCE * servoed.reach:.3g} m",
        remedy="demand a slower or shorter motion, take a smaller step (simulation.step), or invert in modes "
        "(simulation.formulation = 'erls')",
    )
