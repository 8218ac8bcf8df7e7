"""The record of a run with constraints: what the system stores of each knot, accelerations and multipliers."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from erls.errors import SimulationError
from erls.integrators.base import Array, Observer
from erls.integrators.constrained import ConstrainedSolution, ConstrainedState, ConstrainedSystem
from erls.integrators.driver import Recorder


class ConstrainedRecorder(Recorder):
    """Knots, accelerations, multipliers and work of a run so far.

    Parameters
    ----------
    system : ConstrainedSystem
    t : float
    start : ConstrainedState
        It tells how many numbers the system stores of a knot.
    observer : callable or None
        See rule 7 of `erls.integrators.base`.
    """

    def __init__(self, system: ConstrainedSystem, t: float, start: ConstrainedState, observer: Observer | None) -> None:
        super().__init__(len(system.stored(t, start.q, start.v, start.a)[0]), observer)
        self._system = system
        self._more = np.empty((256, len(start.a) + len(start.multipliers)))
        self._velocities = len(start.a)

    def add(self, t: float, state: ConstrainedState) -> None:
        """Add a knot."""
        self._beside(1)[0] = np.concatenate([state.a, state.multipliers])
        self.append(t, *self._system.stored(t, state.q, state.v, state.a))

    def extend_with(self, t: Array, states: Array, accelerations: Array, multipliers: Array) -> None:
        """Add the knots of accepted steps: stored (k, 3, s), accelerations (k, n), multipliers (k, m)."""
        rows = self._beside(len(t))
        rows[:, : self._velocities], rows[:, self._velocities :] = accelerations, multipliers
        self.extend(t, states)

    def solution(self, failure: SimulationError | None = None) -> ConstrainedSolution:
        """The run so far."""
        found = super().solution(failure)
        known = {f.name: getattr(found, f.name) for f in fields(found)}
        n, k = self._velocities, len(found.t)
        return ConstrainedSolution(**known, accelerations=self._more[:k, :n], multipliers=self._more[:k, n:])

    def _beside(self, count: int) -> Array:
        """Room for accelerations and multipliers of the next knots."""
        end = self._kept[0] + count
        while end > len(self._more):
            self._more = np.concatenate([self._more, np.empty_like(self._more)])
        return self._more[self._kept[0] : end]
