"""What integrators share: the walk from breakpoint to breakpoint, the record of knots, the end of a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from erls.errors import Cause, SimulationError
from erls.integrators.base import Array, Leg, Observer, SecondOrderSystem, Solution, Work, legs


class Recorder:
    """Knots and work of a run so far, in arrays that grow.

    Parameters
    ----------
    size : int
        Number of coordinates n.
    observer : callable or None
        See rule 7 of `erls.integrators.base`.
    capacity : int
        Knots to reserve.
    """

    def __init__(self, size: int, observer: Observer | None, capacity: int = 1024) -> None:
        self.work = Work()
        self.warnings: list[str] = []
        self._size, self._observer = size, observer
        self._kept = 0, 0  # knots and accepted steps: one object, so that an interrupt finds both or neither
        self._t = np.empty(capacity)
        self._knots = np.empty((capacity, 3, size))

    def append(self, t: float, y: Array, v: Array, a: Array) -> None:
        """Add a copy of a knot."""
        k, steps = self._kept
        if k == len(self._t):
            self._t = np.concatenate([self._t, np.empty(k)])
            self._knots = np.concatenate([self._knots, np.empty((k, 3, self._size))])
        knot = self._knots[k]
        knot[0], knot[1], knot[2] = y, v, a
        self._t[k] = t
        self._kept = k + 1, steps  # last, so that an interrupt never leaves half a knot

    def extend(self, t: Array, knots: Array, steps: int | None = None) -> None:
        """Add knots (k, 3, n) of y, v, a at ``t`` (k,), by default one per accepted step, and tell the observer."""
        (start, before), count = self._kept, len(t)
        while start + count > len(self._t):
            self._t = np.concatenate([self._t, np.empty(len(self._t))])
            self._knots = np.concatenate([self._knots, np.empty_like(self._knots)])
        self._t[start : start + count], self._knots[start : start + count] = t, knots
        self._kept = start + count, before + (count if steps is None else steps)
        if count:
            self._tell(float(t[-1]))

    def accept(self, t: float) -> None:
        """Count an accepted step, whose knots were added, and tell the observer."""
        knots, steps = self._kept
        self._kept = knots, steps + 1
        self._tell(t)

    def _tell(self, t: float) -> None:
        if self._observer is not None:
            self._observer(t, self.solution)

    @property
    def steps(self) -> int:
        """Accepted steps."""
        return self._kept[1]

    @property
    def observed(self) -> bool:
        """Whether anybody looks on."""
        return self._observer is not None

    @property
    def time(self) -> float | None:
        """Time of the last knot."""
        knots = self._kept[0]
        return float(self._t[knots - 1]) if knots else None

    def solution(self, failure: SimulationError | None = None) -> Solution:
        """The run so far; its arrays are views that later knots leave unchanged."""
        k, steps = self._kept
        y, v, a = (self._knots[:k, i] for i in range(3))
        return Solution(self._t[:k], y, v, a, replace(self.work, steps=steps), failure, tuple(self.warnings))


Advance = Callable[[Leg, Array, Array, Array, Recorder], tuple[Array, Array]]


def not_finite(t: float, values: Array) -> SimulationError:
    """Failure because ``values`` (n,) holds an infinity or NaN at time ``t``."""
    bad = int(np.argmin(np.isfinite(values)))
    return SimulationError(
        Cause.NOT_FINITE,
        f"coordinate {bad} (counted from 0) is no longer finite",
        where=f"t = {t:.9g} s",
        value=float(values[bad]),
        remedy="check forces, drives and initial velocities; end the run before a motion without bound",
    )


def integrate_legs(
    system: SecondOrderSystem,
    times: tuple[float, float],
    y: Array,
    v: Array,
    recorder: Recorder,
    advance: Advance,
) -> Solution:
    """Walk over all legs and turn whatever ends the run early into the failure of its solution.

    Parameters
    ----------
    advance : callable
        ``advance(leg, y, v, a, recorder) -> (y, v)`` adds the knots after the first one of a leg and returns
        the state at its end; raises `SimulationError` when it cannot.
    """
    failure: SimulationError | None = None
    y, v = np.array(y, dtype=float), np.array(v, dtype=float)
    start, end = times
    walk = legs(system, times) or [Leg(start, end, start, end)]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found and reported
        try:
            for leg in walk:
                recorder.work.rhs_calls += 1
                a = system.acceleration(leg.first, y, v)
                if not np.isfinite(a).all():
                    raise not_finite(leg.start, a)
                recorder.append(leg.start, y, v, a)
                if system.size == 0:  # every motion is prescribed and no link deforms: nothing to integrate
                    recorder.append(leg.end, y, v, a)
                    recorder.accept(leg.end)
                elif leg.end > leg.start:
                    y, v = advance(leg, y, v, a, recorder)
        except KeyboardInterrupt:
            failure = SimulationError(
                Cause.INTERRUPTED,
                "the run was interrupted",
                remedy="the motion up to this time was kept",
            )
        except SimulationError as error:
            failure = error
    if recorder.time is None:  # failed at once; a solution always has a knot
        recorder.append(start, y, v, np.zeros_like(y))
    if failure is not None and not failure.where:
        failure.where = f"t = {recorder.time:.9g} s"
    return recorder.solution(failure)
