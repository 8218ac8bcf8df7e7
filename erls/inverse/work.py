"""The solution of an inversion: where its internal motion starts, what it is, what follows, what moves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from erls.equations.linearization import Linearization
from erls.errors import Cause, SimulationError
from erls.inverse.conditions import Demand
from erls.inverse.internal import Basis, Internal, basis_of
from erls.inverse.inversion import Inversion
from erls.inverse.marching import shoot
from erls.inverse.nature import nature_of
from erls.inverse.problem import Problem
from erls.inverse.servoed import States
from erls.inverse.two_point import Ends, Solved, collocate, ends_of
from erls.maths.so3 import Array

_TOLERANCE = 1e-11  # m: change that ends iterations
_ROUGH = (1e-4, 1e-6, 1e-8)  # m: the same of those that give others a start, nearer each time that it was too far
_PASSES = 3  # of fast ways, at most
_FAST = 20.0  # times the slowest frequency of a demanded motion: internal motions that follow
_EXCITED = 6.0  # times the same: undamped internal motions that what is demanded makes
_STEEP = 0.1  # of the largest, the smallest metres that count
SAME = 1e-3
"""Of the largest effort: change that ends passes of fast ways."""


class Found(NamedTuple):
    """Efforts of an iteration over fast ways, and what it took."""

    iterations: int
    left: float


class Work:
    """An inversion on its way.

    Parameters
    ----------
    problem : Problem
    rigid : States
        Motion of rigid links, next to which joint coordinates are looked for.
    """

    def __init__(self, problem: Problem, rigid: States) -> None:
        self.problem = problem
        self._known: dict[int, Ends] = {}
        servoed = problem.flexible
        self.demand: Demand = problem.conditions.demand(problem.t)
        self.near = np.tile(servoed.beginning, (len(problem.t), 1))
        joints = servoed.tree.free_joints
        self.near[:, : len(joints)] = problem.rigid.joints(problem.t, rigid.y, rigid.v).angles[:, joints]
        m = servoed.count
        start = Internal(servoed, self.demand.part(slice(0, 1)), self.near[:1], self._whole())
        start.look(np.concatenate([self.near[:1, servoed.internal], np.zeros((1, m))], axis=1))
        start.learn(np.zeros(1, dtype=np.int64))
        first = start.tangents()[0]
        metres = servoed.metres[servoed.internal]
        units = 1 / np.maximum(metres, _STEEP * metres.max(initial=0.0))
        both = np.concatenate([units, units / problem.step])
        zeros = np.linalg.eigvals(first * both / both[:, None]).astype(complex) if m else np.zeros(0, dtype=complex)
        own, loops = servoed.plain_tangents(self.demand.t[:1], start.states), servoed.closing
        ways = np.eye(servoed.tree.size)
        if loops is not None:
            ways = loops.ways(self.demand.t[:1], start.states.y, servoed.metres)
        motions = Linearization(own.mass[0], own.damping[0], own.stiffness[0], ways)
        self._units = units
        self.nature = nature_of(zeros, motions, self._limit(), _EXCITED * self._slowest(), float(problem.t[-1]))
        self._take(basis_of(first[m:, :m], units, self.nature.limit))

    def _limit(self) -> float:
        """Internal motions faster than this follow [rad/s]."""
        given = self.problem.scene.record.inverse.bandwidth
        if given is not None:
            return 2 * math.pi * given
        return _FAST * self._slowest()

    def _slowest(self) -> float:
        """Frequency of what is demanded [rad/s], that of a sine with its range and its largest acceleration."""
        ranges, fastest = np.ptp(self.demand.value, axis=0), np.abs(self.demand.acceleration).max(axis=0)
        moving = ranges > 0
        found = np.sqrt(2 * fastest[moving] / ranges[moving])
        return float(found.max(initial=2 * math.pi / float(self.problem.t[-1])))

    def _whole(self) -> Basis:
        """All ways are slow."""
        m = self.problem.flexible.count
        return Basis(np.eye(m), np.zeros((m, 0)), np.eye(m), np.zeros((0, m)))

    def _take(self, basis: Basis, before: States | None = None) -> None:
        """Go on in other coordinates, from the first guess or from what is known."""
        slow = np.abs(basis.slow / self._units[:, None]).max(axis=0, initial=0.0)
        self.basis, self.scales = basis, np.concatenate([1 / slow, 1 / slow / self.problem.step])
        self.solved = Internal(self.problem.flexible, self.demand, self.near, basis)
        if before is not None:
            self.solved.begin(before)

    def _ends(self, first: Array, last: Array) -> Ends:
        """Those of what the scene demands, found once in each coordinates."""
        if len(first) not in self._known:
            self._known[len(first)] = ends_of(first, last, self.scales)
        return self._known[len(first)]

    def solve(self, method: str, progress: Callable[[int, float], None]) -> Found:
        """With fast ways that follow; then, where that leaves something and no bandwidth says so, as they move."""
        found = self._followed(method, progress)
        if found.left <= SAME or self.problem.scene.record.inverse.bandwidth is not None:
            return found
        slow = self.basis, self.scales, self.solved
        try:
            self._take(self._whole(), self.solved.states)
            more = self._solved(method, self._now(), progress)
        except SimulationError as problem:
            if problem.cause not in (Cause.NEWTON_FAILED, Cause.UNSTABLE_INVERSE):
                raise
            self.basis, self.scales, self.solved = slow
            return found
        return Found(found.iterations + more.iterations, 0.0)

    def again(self, demand: Demand) -> Found:
        """For another demand near the one before, in the same coordinates."""
        self.demand = self.solved.demand = demand
        found = self._followed("collocation", lambda iteration, change: None)
        return found if self.basis.fast.shape[1] else found._replace(left=0.0)

    def resume(self, inversion: Inversion) -> None:
        """Go on from an inversion."""
        self._take(self.basis if inversion.left else self._whole(), inversion.states)
        self.again(self.demand)

    def _now(self) -> Array:
        """(k, d) states where the motion is."""
        own, states, back = self.problem.flexible.internal, self.solved.states, self.basis.to_slow.T
        return np.hstack([states.y[:, own] @ back, states.v[:, own] @ back])

    def _followed(self, method: str, progress: Callable[[int, float], None]) -> Found:
        """Iterate, then let fast ways have their accelerations, as long as that changes less each time."""
        internal, x = self.solved, self._now()
        iterations, before, left = 0, np.zeros(0), math.inf
        for number in range(_PASSES):
            found = self._solved(method, x, progress)
            x, iterations = found.x, iterations + found.iterations
            efforts = internal.states.efforts[:, : len(self.problem.drives)]
            if not self.basis.fast.shape[1]:
                left = 0.0
            elif number:
                left = float(np.abs(efforts - before).max()) / max(float(np.abs(efforts).max()), 1e-300)
            before = efforts
            if left <= SAME or number == _PASSES - 1:
                break
            internal.refine()
        return Found(iterations, left)

    def _solved(self, method: str, x: Array, progress: Callable[[int, float], None]) -> Solved:
        """From a guess; of shooting, whose stretches are lost from far away, after a rough collocation: in steps in
        which something grows many times over, only what is very near them meets.
        """
        end = self._ends, self.scales
        if method != "shooting":
            return collocate(self.solved, self.problem.t, x, *end, _TOLERANCE, progress)[0]
        for rough in _ROUGH:
            x = collocate(self.solved, self.problem.t, x, *end, rough, progress)[0].x
            try:
                return shoot(self.solved, self.problem.t, x, *end, _TOLERANCE, progress)[0]
            except SimulationError as problem:
                if rough == _ROUGH[-1] or problem.cause is not Cause.NEWTON_FAILED:
                    raise
                self.solved.begin(self._at(x))
        raise AssertionError

    def _at(self, x: Array) -> States:
        """The mechanism at states (k, d), with what belongs to knots as it is."""
        self.solved.look(x)
        return self.solved.states
