"""What integrators share: the walk over legs, the size of chunks of steps, the record of knots, the end of a run."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import fields, replace

import numpy as np

from erls.equations.system import MovingSystem, SecondOrderSystem
from erls.errors import Cause, SimulationError
from erls.integrate.base import Halved, Leg, Observer, Options, Solution, StopRun, Work, legs
from erls.integrate.memory import Keeper, Keeping, Memory, Method, taken, unfit
from erls.integrate.switching import Switch, Switching, switching_of
from erls.integrate.thinning import thinned
from erls.maths.so3 import Array
from fe_import.compiled.address_space import take_buffers

_PAUSE = 0.05  # s between looks at the observer and at interrupts
_SINGLE = 32  # first steps of an observed run, each looked at: a short run is seen step by step
_FIRST, LARGEST_CHUNK = 32, 4096  # steps in one go
_RESERVE = 12_000_000  # numbers: what writing a run file takes beside its knots


class Recorder:
    """Knots and work of a run so far, in an array that grows.

    Parameters
    ----------
    size : int
        Number of coordinates n.
    observer : callable or None
        See rule 7 of `erls.integrate.base`.
    capacity : int
        Knots to reserve.
    apart : float or None
        Of the knots that the observer was told of keep the states at these distances in time [s] beside the ends of all
        legs (`erls.integrate.thinning`), so that memory stays flat however many steps there are; None keeps all.
    beside : int
        Numbers to keep beside y, v, a of each knot.
    switching : Switching or None
        Looks for switches in new knots; those after one are dropped, and a `Switch` is raised.
    """

    def __init__(
        self,
        size: int,
        observer: Observer | None,
        capacity: int = 1024,
        apart: float | None = None,
        beside: int = 0,
        switching: Switching | None = None,
    ) -> None:
        self.work = Work()
        self.warnings: list[str] = []
        self.halved = Halved()
        self._size, self._observer, self._apart, self.beside = size, observer, apart, beside
        self.switching, self._told = switching, 0.0
        self._t, self._rows = np.empty(capacity), np.empty((capacity, 3 * size + beside))
        self._begun = 0.0
        take_buffers()
        self._reserve: Array | None = np.empty(_RESERVE)  # address space only, as nobody writes to it
        self._offer: Callable[[], None] = lambda: None
        # how many knots are kept, accepted steps, and, where knots are dropped, the last one that was looked at and
        # those after it: one object, so that an interrupt finds all or nothing
        self._kept: tuple[int, int, tuple[Array, Array]] = 0, 0, (self._t[:0], self._rows[:0])

    def release(self) -> None:
        """Give back what was set aside for whoever keeps a run that ended for lack of memory."""
        self._reserve = None

    def begin(self, t: float, *parts: Array) -> None:
        """Add a copy of the knot y, v, a (and what is kept beside it) at which a leg begins; the last leg ends."""
        row = np.concatenate(parts)[None]
        if self.switching is not None:
            self.switching.rest(row[:, : 3 * self._size].reshape(1, 3, self._size))
        if not self._kept[0]:
            self._begun = t
        times, rows = self._waiting()
        rest = (np.array([t]), row) if self._apart is not None else self._kept[2]
        self._store(np.append(times[-1:], t), np.concatenate([rows[-1:], row]), 0, rest)

    def append(self, t: float, *parts: Array) -> None:
        """Add a copy of a knot."""
        self._add(np.array([t]), np.concatenate(parts)[None], 0)

    def extend(self, t: Array, knots: Array, steps: int | None = None, beside: Array | None = None) -> None:
        """Add knots (k, 3, n) of y, v, a at ``t`` (k,), by default one per accepted step, and tell the observer.

        ``beside`` (k, m) is kept beside them.
        """
        rows = knots.reshape(len(t), 3 * self._size)
        if beside is not None and self.beside:
            rows = np.hstack([rows, beside])
        self._add(t, rows, len(t) if steps is None else steps)
        if len(t):
            self._tell(float(t[-1]))

    def accept(self, t: float) -> None:
        """Count an accepted step, whose knots were added, and tell the observer."""
        knots, steps, rest = self._kept
        self._kept = knots, steps + 1, rest
        self._tell(t)

    def _add(self, t: Array, rows: Array, steps: int) -> None:
        if self.switching is None:
            self._keep(t, rows, steps)
            return
        knots = rows[:, : 3 * self._size].reshape(len(t), 3, self._size)
        self.switching.rest(knots)
        rows[:, : 3 * self._size] = knots.reshape(len(t), 3 * self._size)
        count, knot, switch = self.switching.first(t, knots, rows[:, 3 * self._size :])
        t, rows = t[:count], rows[:count]
        if switch is not None and knot is not None:
            t, rows = np.append(t, switch.t), np.concatenate([rows, knot[None, : rows.shape[1]]])
        self._keep(t, rows, steps if switch is None else 1)
        if switch is not None:
            if self._apart is not None or self._due():  # what need not be kept is dropped before the next leg begins
                self._look(switch.t)  # nothing is offered: the steps stand beyond it
            raise switch

    def _keep(self, t: Array, rows: Array, steps: int) -> None:
        knots, before, (times, states) = self._kept
        if self._apart is None:
            self._store(t, rows, steps, (times, states))
        else:
            self._kept = knots, before + steps, (np.concatenate([times, t]), np.concatenate([states, rows]))

    def _tell(self, t: float) -> None:
        if self.switching is None or t >= self.switching.leg.end or self._due():  # else steps come one by one
            self._look(t)
            self._offer()

    def _due(self) -> bool:
        """Whether the observer was told of nothing for a while."""
        if due := time.perf_counter() - self._told >= _PAUSE:
            self._told = time.perf_counter()
        return due

    def _look(self, t: float) -> None:
        """Tell the observer, and drop what need not be kept."""
        whole: Sequence[float] | None = ()
        try:
            if self._observer is not None:
                whole = self._observer(t, self.solution)
        except StopRun as stop:
            whole = stop.args
            raise
        except SimulationError as problem:
            whole = problem.whole
            raise
        finally:
            self._thin(whole or ())

    def _thin(self, whole: Sequence[float]) -> None:
        """Drop what need not be kept, once the observer has seen it."""
        times, rows = self._kept[2]
        if self._apart is None or len(times) < 2:
            return
        t, kept = thinned(times, rows, self._size, self._begun, self._apart, whole)
        first = int(self._stored(t))
        self._store(t[first:], kept[first:], 0, (times[-1:].copy(), rows[-1:].copy()))

    def _stored(self, t: Array) -> bool:
        """Whether the first of some knots is the last one that is kept for good."""
        return bool(self._kept[0] and len(t) and self._t[self._kept[0] - 1] == t[0])

    def _waiting(self) -> tuple[Array, Array]:
        """Times and rows of knots that are not kept for good."""
        times, rows = self._kept[2]
        first = int(self._stored(times))
        return times[first:], rows[first:]

    def _store(self, t: Array, rows: Array, steps: int, rest: tuple[Array, Array]) -> None:
        start, before, _ = self._kept
        end = start + len(t)
        while end > len(self._t):
            self._t = np.concatenate([self._t, np.empty(len(self._t))])
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._t[start:end], self._rows[start:end] = t, rows
        self._kept = end, before + steps, rest

    def kept_by(self, offer: Callable[[], None]) -> None:
        """Call ``offer`` after each look of the observer."""
        self._offer = offer

    def memory(self) -> Memory:
        """Knots and work so far (`erls.integrate.memory`)."""
        knots, steps, (times, rows) = self._kept
        return {
            "time": np.array([self.time]),
            "recorder.begun": np.array([self._begun]),
            "recorder.work": np.array([getattr(self.work, f.name) for f in fields(Work)] + [steps]),
            "recorder.halved": np.array(self.halved, dtype=float),
            "recorder.t": self._t[:knots],
            "recorder.rows": self._rows[:knots],
            "recorder.waiting.t": times,
            "recorder.waiting.rows": rows,
            **({} if self.switching is None else self.switching.memory()),
        }

    def restore(self, memory: Memory) -> None:
        """Knots and work of such a memory, instead of none."""
        *work, steps = taken(memory, "recorder.work", np.zeros(len(fields(Work)) + 1, dtype=np.int64)).tolist()
        for field, number in zip(fields(Work), work, strict=True):
            setattr(self.work, field.name, number)
        halved, given, first = taken(memory, "recorder.halved", np.zeros(3)).tolist()
        self.halved = Halved(int(halved), int(given), first)
        self._begun = float(taken(memory, "recorder.begun", np.zeros(1))[0])
        t, waiting = (taken(memory, f"recorder.{name}", self._t, axis=0) for name in ("t", "waiting.t"))
        rows, more = (taken(memory, f"recorder.{name}", self._rows, axis=0) for name in ("rows", "waiting.rows"))
        if len(t) != len(rows) or len(waiting) != len(more) or not len(t):
            raise unfit("recorder.rows", (len(t), len(rows)))
        self._kept = 0, 0, (t[:0], rows[:0])
        self._store(t, rows, steps, (waiting, more))
        if self.switching is not None:
            self.switching.restore(memory)

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
        knots, _, (times, _) = self._kept
        if len(times):
            return float(times[-1])
        return float(self._t[knots - 1]) if knots else None

    def solution(self, failure: SimulationError | None = None) -> Solution:
        """The run so far; later knots leave its arrays unchanged."""
        t, rows = self._so_far()
        y, v, a = (rows[:, i * self._size : (i + 1) * self._size] for i in range(3))
        work = replace(self.work, steps=self.steps)
        return Solution(t, y, v, a, work, failure, tuple(self.warnings), halved=self.halved)

    def _so_far(self) -> tuple[Array, Array]:
        """Times and rows."""
        knots = self._kept[0]
        t, rows = self._t[:knots], self._rows[:knots]
        more = self._waiting()
        if len(more[0]):
            with suppress(MemoryError):  # of a run that ended for it: without its last knots
                t, rows = np.concatenate([t, more[0]]), np.concatenate([rows, more[1]])
        return t, rows


def recorder_for(
    system: SecondOrderSystem, observer: Observer | None, options: Options, capacity: int = 1024
) -> Recorder:
    """The record of a run of a system, with what looks for its switches."""
    return Recorder(system.size, observer, capacity, options.output_step, switching=switching_of(system))


class Pace:
    """How many steps to make in one go: what takes about 50 ms; one where functions are called from Python.

    As a context it measures the steps that were asked for last. ``single``: whether the first steps of an observed run
    are made one by one. Each call takes up to a millisecond, and a run by steps of high order a few in all. So are all
    steps after which a switch may drop others: what comes after them must not depend on how many there were.
    """

    def __init__(self, recorder: Recorder, compiled: bool, single: bool) -> None:
        self._single = _SINGLE if single and recorder.observed else 0
        many = compiled and recorder.switching is None
        self._recorder, self._steps, self._largest = recorder, _FIRST, LARGEST_CHUNK if many else 1
        self._asked, self._begun = 1, 0.0

    def size(self) -> int:
        """Steps to make next."""
        few = self._recorder.steps < self._single
        self._asked = 1 if few else min(self._steps, self._largest)
        return self._asked

    def __enter__(self) -> None:
        self._begun = time.perf_counter()

    def __exit__(self, *problem: object) -> None:
        spent = max(time.perf_counter() - self._begun, 1e-6)
        self._steps = max(1, min(4 * self._asked, math.ceil(_PAUSE * self._asked / spent)))


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
    method: Method | None,
    keeper: Keeper | None = None,
) -> Solution:
    """Walk over all legs and turn whatever ends the run early into the failure of its solution.

    Parameters
    ----------
    method : Method or None
        Not asked where there is nothing to integrate.
    keeper : Keeper or None
        Of what the run needs to go on, and what it goes on from.
    """

    switching = recorder.switching

    def stand(leg: Leg, y: Array, v: Array) -> None:
        recorder.work.rhs_calls += 1
        if switching is None:
            a = system.acceleration(leg.first, y, v)
        else:
            v, a = switching.stand(leg, y, v)
        if not np.isfinite(a).all():
            raise not_finite(leg.start, a)
        recorder.begin(leg.start, y, v, a)
        if method is None:  # every motion is prescribed and no link deforms
            recorder.append(leg.end, y, v, a)
            recorder.accept(leg.end)
        elif leg.end > leg.start:
            method.begin(leg, y, v, a)

    def go(walk: list[Leg]) -> None:
        y, v = start
        keeping = None if method is None else Keeping(keeper, recorder, method)
        for number, leg in enumerate(walk):
            if keeping is not None and keeping.passed(number):
                continue
            if keeping is None or not keeping.resumes(number):
                stand(leg, y, v)
            elif switching is not None:
                leg = switching.leg
            while method is not None and leg.end > leg.start:
                try:
                    y, v = method.finish(leg)
                    break
                except Switch as switch:
                    leg = Leg(switch.t, leg.end, switch.t, leg.last)
                    stand(leg, switch.y, switch.v)

    method = method if system.size else None
    start = np.array(y, dtype=float), np.array(v, dtype=float)
    return run_to_end(system, times, recorder, go, lambda: recorder.append(times[0], *start, np.zeros_like(start[0])))


def run_to_end(
    system: MovingSystem,
    times: tuple[float, float],
    recorder: Recorder,
    go: Callable[[list[Leg]], None],
    stand: Callable[[], None],
) -> Solution:
    """What ``go`` records on its way over all legs; whatever ends it early becomes the failure of the solution.

    ``stand`` records the start, of a run that failed at once.
    """
    failure: SimulationError | None = None
    walk = legs(system, times) or [Leg(times[0], times[1], times[0], times[1])]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found and reported
        try:
            go(walk)
        except StopRun:
            pass
        except KeyboardInterrupt:
            failure = SimulationError(
                Cause.INTERRUPTED,
                "the run was interrupted",
                remedy="the motion up to this time was kept",
            )
        except MemoryError:
            recorder.release()
            remedy = "the motion up to this time was kept; give a larger simulation.output_step, or free memory"
            failure = SimulationError(Cause.OUT_OF_MEMORY, "out of memory", remedy=remedy)
        except SimulationError as error:
            failure = error
    if recorder.time is None:  # a solution always has a knot
        stand()
    if failure is not None and not failure.where:
        failure.where = f"t = {recorder.time:.9g} s"
    return recorder.solution(failure)
