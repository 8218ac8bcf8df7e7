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
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from erls.equations.nodal.nodes import Nodes
from erls.errors import Cause, SimulationError
from erls.inverse.conditions import Demand
from erls.inverse.nodal.ends import bounded
from erls.inverse.nodal.servoed import Balance, Blocks, NodalServoed, Rest
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array

_ITERATIONS = 30
_TOLERANCE = 1e-10  # of the size of the mechanism: the last change
_SLOW = 0.1  # ratio of changes up to which tangents are kept
_ROUNDING = 1e-14  # of the largest entry of a row: what a factorization, whose fill it would multiply, does without


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
        """Blocks (..., r, c) at rows (...) and columns (...)."""
        at = np.nonzero(blocks)
        first, i, j = at[:-2], *at[-2:]
        self.rows.append(rows[first] + i)
        self.columns.append(columns[first] + j)
        self.values.append(blocks[at])

    def matrix(self, size: int) -> sp.csc_array:
        """(size, size)"""
        places = np.concatenate(self.rows), np.concatenate(self.columns)
        return sp.csc_array((np.concatenate(self.values), places), shape=(size, size))


class _TwoPoint:
    """The system over all knots: steps of Newton's method from states that it looks at.

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
        self._factors: Any = None
        self._units, self._rows = np.ones((2, self.size))

    def look(self, q: list[Nodes], holding: Array) -> None:
        """Take in configurations of all knots, multipliers and efforts (k, m + p)."""
        poses = np.array([each.poses for each in q])
        steps = motions.log(motions.inverse(poses[:-1]) @ poses[1:])
        twists = (steps[1:] + steps[:-1]) / (2 * self.h), (steps[1:] - steps[:-1]) / self.h**2
        motion = twists[0].reshape(len(holding), -1), twists[1].reshape(len(holding), -1)
        self._state, self._steps = (self.demand, q[1:-1], motion, holding), steps
        self._found = self.servoed.balance(*self._state)
        self._beyond = [self._end(q, last) for last in (False, True)]

    def _end(self, q: list[Nodes], last: bool) -> tuple[Balance, Array]:
        """The knot beyond an end, and how far what is bounded is from rest there."""
        still = np.zeros((1, self._blocks[0]))
        demand, none = self.demand.part(slice(-1, None) if last else slice(0, 1)), np.zeros((1, self.servoed.holding))
        there = self.servoed.balance(demand, [q[-1 if last else 0]], (still, still), none)
        pair = (q[-2], q[-1]) if last else (q[0], q[1])
        rest = motions.inverse(self.rests[last].q.poses)
        parts = zip(self.ends[last], pair, strict=True)
        away: Array = sum((part @ motions.log(rest @ each.poses).ravel() for part, each in parts), np.zeros(1))
        return there, away

    def step(self, most: float) -> tuple[Array, Array]:
        """Increments (k + 2, n) of all knots, changes (k, m + p) of multipliers and efforts; by tangents of an earlier
        step where that goes no farther than ``most`` [m], for links that bend far are lost in steps by stale ones.
        """
        if self._factors is not None:
            known = self._step()
            if float(np.abs(known[0] * self.servoed.metres).max()) <= most:
                return known
        self._learn()
        return self._step()

    def _step(self) -> tuple[Array, Array]:
        found, (ahead, behind) = self._found, self._beyond
        inside = np.hstack([found.force, found.open]).ravel()
        right = np.concatenate([ahead[0].open[0], ahead[1], inside, behind[0].open[0], behind[1]])
        solved = -self._units * self._factors.solve(self._rows * right)
        n, own = self._blocks
        middle = solved[n:-n].reshape(-1, own)
        return np.vstack([solved[:n], middle[:, :n], solved[-n:]]), middle[:, n:]

    def _learn(self) -> None:
        """Factor the tangents: in metres, and newtons per mass times h²; every row by its largest entry."""
        blocks, (n, own), metres = self.servoed.blocks(*self._state), self._blocks, self.servoed.metres
        on, by = self.servoed.pairs
        inertia = blocks.mass[:, on == by].diagonal(axis1=2, axis2=3).reshape(-1, n) / metres**2
        each = np.concatenate([1 / metres, np.full(own - n, (float(inertia.max()) or 1.0) / self.h**2)])
        self._units = np.concatenate([1 / metres, np.tile(each, len(self.demand.t)), 1 / metres])
        matrix = _Entries()
        self._knots(matrix, blocks)
        for last in (False, True):
            self._beside(matrix, last)
        whole = matrix.matrix(self.size) @ sp.diags_array(self._units)
        self._rows = 1 / np.maximum(abs(whole).max(axis=1).toarray().ravel(), np.finfo(float).tiny)
        scaled = sp.csc_array(sp.diags_array(self._rows) @ whole)
        scaled.data[np.abs(scaled.data) < _ROUNDING] = 0.0
        scaled.eliminate_zeros()
        try:
            self._factors = splu(scaled)
        except RuntimeError as problem:
            raise np.linalg.LinAlgError(str(problem)) from None

    def _knots(self, matrix: _Entries, blocks: Blocks) -> None:
        """Balance and conditions at all knots."""
        (n, _), (on, by) = self._blocks, self.servoed.pairs
        at, rows = self._at[1:-1], self._at[1:-1] - n + self._first
        damping, mass = blocks.damping / (2 * self.h), blocks.mass / self.h**2
        parts = motions.tangent_inverse(self._steps), motions.tangent_inverse(-self._steps)  # of d by its ends
        fore, back = (part[:, by] for part in parts)
        here = blocks.stiffness + damping @ (fore[:-1] - back[1:]) - mass @ (back[1:] + fore[:-1])
        sides = (mass + damping) @ fore[1:], here, (mass - damping) @ back[:-1]
        for values, columns in zip(sides, (self._at[2:], at, self._at[:-2]), strict=True):
            matrix.add(values, rows[:, None] + 6 * on, columns[:, None] + 6 * by)
        matrix.add(self._found.pushed, rows, at + n)
        matrix.add(self._found.rows, rows + n, at)

    def _beside(self, matrix: _Entries, last: bool) -> None:
        """Conditions at the knot beyond an end, and what is bounded there."""
        at = self._first + len(self.demand.t) * self._blocks[1] if last else 0
        matrix.add(self._beyond[last][0].rows, np.array([at]), self._at[[-1 if last else 0]])
        for part, k in zip(self.ends[last], (-2, -1) if last else (0, 1), strict=True):
            matrix.add(part[None], np.array([at + self.servoed.holding]), self._at[[k]])


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
        system.look(every, holding)
        steps, changes = system.step(_SLOW * worst)
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
