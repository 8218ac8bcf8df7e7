"""The record of a run with constraints: what the system stores of each knot, accelerations and multipliers."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from erls.equations.constrained_system import ConstrainedState, ConstrainedSystem
from erls.errors import SimulationError
from erls.integrate.base import Observer
from erls.integrate.constrained import ConstrainedSolution
from erls.integrate.driver import Recorder
from erls.integrate.switching import switching_of


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
        beside = len(start.a) + len(start.multipliers)
        super().__init__(stored, observer, 256, apart, beside, switching_of(system))
        self._system, self._velocities = system, len(start.a)

    @property
    def kept(self) -> int:
        """Numbers that the system stores of a knot."""
        return self._size

    def begin_with(self, t: float, state: ConstrainedState) -> None:
        """Add the knot at which a leg begins."""
        self.begin(t, *self._system.stored(t, state.q, state.v, state.a), state.a, state.multipliers)

    def add(self, t: float, state: ConstrainedState) -> None:
        """Add a knot."""
        self.append(t, *self._system.stored(t, state.q, state.v, state.a), state.a, state.multipliers)

    def solution(self, failure: SimulationError | None = None) -> ConstrainedSolution:
        """The run so far."""
        found = super().solution(failure)
        known = {f.name: getattr(found, f.name) for f in fields(found)}
        rows = self._so_far()[1][:, 3 * self._size :]
        n = self._velocities
        return ConstrainedSolution(**known, accelerations=rows[:, :n], multipliers=rows[:, n:])


_TOLD = 64  # knots of a run that is told again, between looks of the observer


def tell_again(found: ConstrainedSolution, recorder: Recorder) -> None:
    """Record a run that was made before anybody looked on."""
    recorder.switching = None  # its switches are known
    recorder.work = replace(found.work, steps=0)
    recorder.warnings += found.warnings
    beside = np.concatenate([found.accelerations, found.multipliers], axis=1)
    for leg in np.split(np.arange(len(found.t)), np.flatnonzero(np.diff(found.t) == 0) + 1):
        first = leg[0]
        recorder.begin(float(found.t[first]), found.y[first], found.v[first], found.a[first], beside[first])
        for part in np.split(leg[1:], np.arange(_TOLD, len(leg) - 1, _TOLD)):
            if len(part):
                knots = np.stack([found.y[part], found.v[part], found.a[part]], axis=1)
                recorder.extend(found.t[part], knots, beside=beside[part])
