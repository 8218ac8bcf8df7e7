"""The record of a run with constraints: what the system stores of each knot, and the multipliers."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from erls.errors import SimulationError
from erls.integrators.base import Observer
from erls.integrators.constrained import ConstrainedSolution, ConstrainedState, ConstrainedSystem
from erls.integrators.driver import Recorder


class ConstrainedRecorder(Recorder):
    """Knots, multipliers and work of a run so far.

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
        self._multipliers = np.empty((256, len(start.multipliers)))

    def add(self, t: float, state: ConstrainedState) -> None:
        """Add a knot."""
        k = self._count
        if k == len(self._multipliers):
            self._multipliers = np.concatenate([self._multipliers, np.empty_like(self._multipliers)])
        self._multipliers[k] = state.multipliers
        self.append(t, *self._system.stored(t, state.q, state.v, state.a))

    def solution(self, failure: SimulationError | None = None) -> ConstrainedSolution:
        """The run so far."""
        found = super().solution(failure)
        known = {f.name: getattr(found, f.name) for f in fields(found)}
        return ConstrainedSolution(**known, multipliers=self._multipliers[: len(found.t)])
