"""The record of a run with constraints: what the system stores of each knot, accelerations and multipliers."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from erls.equations.constrained_system import ConstrainedState, ConstrainedSystem
from erls.errors import SimulationError
from erls.integrate.base import Observer
from erls.integrate.constrained import ConstrainedSolution
from erls.integrate.driver import Recorder
from erls.maths.so3 import Array


class ConstrainedRecorder(Recorder):
    """Knots, accelerations, multipliers and work of a run so far.

    Parameters
    ----------
    system : ConstrainedSystem
    t : float
    start : ConstrainedState
        It tells how many numbers the system stores of a knot.
    observer : callable or None
        See rule 7 of `erls.integrate.base`.
    apart : float or None
        See `Recorder`.
    """

    def __init__(
        self,
        system: ConstrainedSystem,
        t: float,
        start: ConstrainedState,
        observer: Observer | None,
        apart: float | None = None,
    ) -> None:
        stored = len(system.stored(t, start.q, start.v, start.a)[0])
        super().__init__(stored, observer, 256, apart, len(start.a) + len(start.multipliers))
        self._system, self._velocities = system, len(start.a)

    def begin_with(self, t: float, state: ConstrainedState) -> None:
        """Add the knot at which a leg begins."""
        self.begin(t, *self._system.stored(t, state.q, state.v, state.a), state.a, state.multipliers)

    def add(self, t: float, state: ConstrainedState) -> None:
        """Add a knot."""
        self.append(t, *self._system.stored(t, state.q, state.v, state.a), state.a, state.multipliers)

    def extend_with(self, t: Array, states: Array, accelerations: Array, multipliers: Array) -> None:
        """Add the knots of accepted steps: stored (k, 3, s), accelerations (k, n), multipliers (k, m)."""
        self.extend(t, states, beside=np.hstack([accelerations, multipliers]))

    def solution(self, failure: SimulationError | None = None) -> ConstrainedSolution:
        """The run so far."""
        found = super().solution(failure)
        known = {f.name: getattr(found, f.name) for f in fields(found)}
        rows = self._so_far()[1][:, 3 * self._size :]
        n = self._velocities
        return ConstrainedSolution(**known, accelerations=rows[:, :n], multipliers=rows[:, n:])
