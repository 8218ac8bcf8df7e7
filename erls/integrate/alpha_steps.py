"""Steps of generalized-α over a run: the memory of their loop (`erls.integrate.stepping.generalized_alpha`), and walks
over a leg with equal steps, or with steps that follow the local error.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from erls.equations.stepped import Stepped
from erls.errors import Cause, SimulationError
from erls.integrate.alpha_rules import (
    FASTEST_TRUSTED,
    FROZEN_ITERATIONS,
    GROWTH,
    GUESSES,
    MAX_HALVINGS,
    MAX_ITERATIONS,
    ROUNDING,
    SINGULAR,
    SLOWEST_KNOWN,
    Formulas,
    Limit,
    Rules,
    Words,
    newton_failure,
    too_slow,
)
from erls.integrate.base import Halved, Leg
from erls.integrate.driver import Pace, Recorder
from erls.integrate.memory import Memory, recall, taken
from erls.integrate.stepping import alpha_memory as alpha
from erls.maths.jit import plain
from erls.maths.records import Memory as FlatMemory
from erls.maths.records import overwrite, python_reader
from erls.maths.so3 import Array
from erls.scene.integrators import MATRICES

_SAFETY, _LARGEST_CHANGE = 0.9, 4.0  # of an adaptive step
_FIRST, _SMALLEST = 1 / 64, 1e-6  # adaptive steps, of the largest
_TWICE = 16.0  # growth of a local error when the step is doubled, and something left
_MOST_ROUGH = 50_000  # steps: nobody can watch them
_RECOVERY = 1.02  # growth of the largest step after Newton's method failed, in each attempt
_AT_ONCE, _HELD = 4096, 8  # steps that are asked for, and those after a rejected one, which do not grow

_see_course, _see_memory = python_reader(alpha.Course), python_reader(alpha.Memory)


class Steps:
    """State and memory of one run.

    Parameters
    ----------
    system : Stepped
    metres : (n,) array
        Per unit of each velocity coordinate.
    rules : Rules
    words : Words
    recorder : Recorder
    """

    def __init__(self, system: Stepped, metres: Array, rules: Rules, words: Words, recorder: Recorder) -> None:
        from erls.integrate.stepping import generalized_alpha as loop  # here: it imports the compiler

        self._system, self._rules, self._words, self._recorder = system, rules, words, recorder
        self._arguments = system.functions(), system.reals, system.integers, system.scratch
        self._advance = loop.advance if system.compiled else plain(loop.advance)
        self._pace = Pace(recorder, system.compiled, single=True)
        self._metres, self._reach = metres, float(metres.max(initial=1.0))
        self._memory: Any = None
        self.h, self.error = 0.0, 0.0
        """Step [s], and local error of the last one [m]."""
        self.part = 0
        """Which of the parts of a leg with steps of their own is walked over."""
        self._walk = self._stood = np.zeros(0)  # where a walk stands, and stood when it was resumed
        self._reached = 0, alpha.DONE  # steps of the present stretch, and what ended them
        self.resumable = system.compiled

    def begin(self, q: Any, v: Array, a: Array) -> None:
        """Start a leg with consistent accelerations and multipliers (n + m,), which the algorithmic ones equal."""
        start = self._system.pack(q)
        if self._memory is None:
            self._make_room(start)
        memory = self._memory
        self._start[:], memory.v[:], memory.a[:], memory.alg[:] = start, v, a, a[: len(v)]
        self.part, self._reached = 0, (0, alpha.DONE)
        self._stood = np.zeros(0)

    def stand(self, *at: float) -> None:
        """Where a walk stands, in numbers of its own, as it asks for its next steps."""
        self._walk = np.array(at, dtype=float)

    def stood(self) -> list[float]:
        """Where a walk that was resumed stood, its step set; nothing of one that begins."""
        found, self._stood = self._stood.tolist(), np.zeros(0)
        return found

    def memory(self) -> Memory:
        """Between two steps, see `erls.integrate.memory`."""
        return {
            **{f"steps.{name}": array for name, array in self._arrays()},
            "steps.size": np.array([self.h, self.error]),
            "steps.walk": self._walk,
            "steps.reached": np.array([self.part, *self._reached]),
        }

    def restore(self, memory: Memory) -> None:
        """As another run left it."""
        self._make_room(taken(memory, "steps.start", np.zeros(1), axis=0))
        for name, array in self._arrays():
            recall(memory, f"steps.{name}", array)
        self.h, self.error = taken(memory, "steps.size", np.zeros(2)).tolist()
        self._walk = self._stood = taken(memory, "steps.walk", np.zeros(1), axis=0)
        self.part, *reached = taken(memory, "steps.reached", np.zeros(3, dtype=np.int64)).tolist()
        self._reached = reached[0], reached[1]

    def _arrays(self) -> list[tuple[str, NDArray[Any]]]:
        own = ("own", self._own), ("places", self._places), ("start", self._start), ("tried", self._tried)
        return [*own, ("scratch", self._system.scratch)]

    def _make_room(self, start: Any) -> None:
        """Records of a run in flat memory; ``start`` is like every configuration."""
        self._start, self._tried = start.copy(), start.copy()
        places = [0, 0, 0]
        flat = FlatMemory(places)
        blank = alpha.Settings(*[0] * len(alpha.Settings._fields))
        course = alpha.Course(np.zeros(6), np.zeros(7, dtype=np.int64))
        course.rates[alpha.RATE], course.counts[alpha.USUAL] = SLOWEST_KNOWN, MAX_ITERATIONS
        places[:3] = [flat.put(record) for record in (blank, course, self._room())]
        self._own, self._places = flat.numbers, np.array(places, dtype=np.int64)
        self._progress = _see_course(self._own, self._places, places[1])
        self._memory = _see_memory(self._own, self._places, places[2])

    def _room(self) -> alpha.Memory:
        n, m, own = self._system.size, self._system.conditions, self._system.factoring
        dense = n if own is None else 0
        rows = [np.zeros(n) for _ in range(6)]
        v, alg, increment, v1, change, guess = rows
        return alpha.Memory(
            v=v,
            alg=alg,
            a=np.zeros(n + m),
            increment=increment,
            v1=v1,
            a1=np.zeros(n + m),
            change=change,
            guess=guess,
            metres=np.array(self._metres, dtype=float),
            per_metre=1 / self._metres,
            right=np.zeros(n + m + 2 if m or self._rules.balance >= 0 else n),
            correction=np.zeros(n + m),
            factors=np.zeros(n * n if own is None else own.size),
            matrices=np.zeros((3, dense, dense)),
            pivots=np.zeros(dense, dtype=np.int64),
        )

    def set_step(self, h: float) -> None:
        """Change the step, with a₀ moved along; one that differs only by rounding keeps the iteration matrix."""
        memory = self._memory
        if abs(h - self.h) > 1e-6 * h:
            self._progress.counts[alpha.FACTORED] = 0
        if self.h:
            a = memory.a[: len(memory.v)]
            memory.alg[:] = a + (memory.alg - a) * (h / self.h)
        memory.change[:] = memory.guess[:] = 0.0
        self.h = h

    def stretch(self, times: Array, last: float, limit: Limit) -> tuple[int, int]:
        """Steps to ``times``, with forces up to ``last``, in chunks; how many were recorded, and what ended them."""
        overwrite(self._settings(last, limit), self._own, self._places, int(self._places[0]))
        own = self._own, self._places, self._start, self._tried
        done, status = self._reached
        while done < len(times) and status == alpha.DONE:
            part = times[done : done + self._pace.size()]
            knots = np.empty((len(part), 3, self._system.kept))
            beside = np.empty((len(part), self._recorder.beside))
            samples = self._system.samples(np.minimum(part, last))
            try:
                with self._pace:
                    status = self._advance(*self._arguments, *own, part, samples, knots, beside)
            finally:
                made = self._count()
            done += made
            self._reached = done, int(status)
            self._recorder.extend(part[:made], knots[:made], beside=beside[:made])
        self._reached = 0, alpha.DONE
        if status == alpha.REFUSED:
            self._system.refuse(float(times[done]), self._system.unpack(self._tried), self._memory.v1)
            status = alpha.FAILED  # it does not insist
        self.error = float(self._progress.rates[alpha.ERROR])
        return done, status

    @property
    def accelerations(self) -> Array:
        """(n + m,) copy of the accelerations and multipliers of the last knot."""
        return np.array(self._memory.a)

    def end(self) -> tuple[Any, Array]:
        """Configuration and velocity."""
        return self._system.unpack(self._start), self._memory.v.copy()

    def failure(self, t: float) -> SimulationError:
        """Why the step to ``t`` failed."""
        rates = self._progress.rates
        slow = too_slow(rates[alpha.BEFORE], rates[alpha.SIZE], rates[alpha.GOAL])
        reason = SINGULAR if self._progress.counts[alpha.REASON] == alpha.SINGULAR else slow
        size, suspect = self._system.size, self._memory.correction
        return newton_failure(self._words, size, self._rules, t, self.h, suspect, reason)

    def _settings(self, last: float, limit: Limit) -> alpha.Settings:
        use, rules = Formulas.of(self._rules, self.h), self._rules
        shared = ("h", "beta", "gamma", "share", "pull", "keep", "to_v", "to_a", "tolerance")
        return alpha.Settings(
            **{name: getattr(use, name) for name in shared},
            last=last,
            rounding=ROUNDING,
            reach=self._reach,
            balance=rules.balance,
            slowest=SLOWEST_KNOWN,
            fastest=FASTEST_TRUSTED,
            patience=rules.patience,
            renewal=rules.renewal,
            tolerated=rules.tolerated,
            error_limit=limit.error,
            error_factor=use.error,
            growth=GROWTH if limit.can_grow else 0.0,
            iterations=FROZEN_ITERATIONS if rules.matrix == MATRICES[alpha.FROZEN] else MAX_ITERATIONS,
            over=rules.over,
            fewest=rules.fewest,
            matrix=MATRICES.index(rules.matrix),
            guess=GUESSES.index(rules.guess),
        )

    def _count(self) -> int:
        """Steps made by the last call, whose work is added to that of the run."""
        counts, work = self._progress.counts, self._recorder.work
        work.rhs_calls += int(counts[alpha.EVALUATIONS])
        work.newton_iterations += int(counts[alpha.ITERATIONS])
        work.factorizations += int(counts[alpha.FACTORIZATIONS])
        counts[[alpha.EVALUATIONS, alpha.ITERATIONS, alpha.FACTORIZATIONS]] = 0
        return int(counts[alpha.STEPS])


def equal_steps(
    steps: Steps, leg: Leg, step: float, halve: bool, recorder: Recorder, given: bool = True
) -> None:
    """Equal steps over a leg, each of 2^MAX_HALVINGS units of time, so that halved steps meet its end.

    Where Newton's method fails they are halved for a while, which is told of ``given`` ones, or the run fails unless
    ``halve``.
    """
    unit = 1 << MAX_HALVINGS
    count = max(1, math.ceil((leg.end - leg.start) / step * (1 - 1e-9)))
    total, at, halvings, served = count * unit, 0, 0, 0
    span = leg.end - leg.start
    stood = steps.stood()
    if stood:
        at, halvings, served = map(int, stood)
    else:
        steps.set_step(span / count)
    while at < total:
        steps.stand(at, halvings, served)
        width = unit >> halvings
        ahead = 1 if halvings else min(_AT_ONCE, (total - at) // width)
        ends = at + width * np.arange(1, ahead + 1)
        times = np.where(ends == total, leg.end, leg.start + span * (ends / total))
        made, status = steps.stretch(times, leg.last, Limit())
        at, served = at + made * width, served + made
        whole = made if not halvings else int(made and at % unit == 0)
        if given and whole:
            recorder.halved = recorder.halved.and_then(Halved(whole if halvings else 0, whole))
        if status == alpha.FAILED:
            recorder.work.rejected_steps += 1
            if given:
                began = leg.start + span * (at // unit * unit / total)
                recorder.halved = recorder.halved.and_then(Halved(first=began))
            halvings, served = halvings + 1, 0
            if halvings > MAX_HALVINGS or not halve:
                raise steps.failure(float(times[made]))
        elif halvings and served >= 4 and at % (2 * width) == 0:
            halvings, served = halvings - 1, 0
        else:
            continue
        steps.set_step(span / count / (1 << halvings))


def adaptive_steps(steps: Steps, leg: Leg, largest: float, tolerance: float, recorder: Recorder) -> None:
    """Steps whose local error stays below ``tolerance`` [m]; each change of their size leads to the end of the leg.

    The error of a step is of third order (M. Géradin, A. Cardona, Flexible Multibody Dynamics, 2001, ch. 14).
    """
    t, h, held = leg.start, min(max(steps.h, _FIRST * largest), largest), False
    stood = steps.stood()
    if stood:
        t, h, held = stood[0], stood[1], bool(stood[2])
    while t < leg.end:
        steps.stand(t, h, held)
        count = max(1, math.ceil((leg.end - t) / h * (1 - 1e-9)))
        if not stood:
            steps.set_step((leg.end - t) / count)
        stood = []
        ahead = min(count, _HELD if held else _AT_ONCE)
        times = t + (leg.end - t) * np.arange(1, ahead + 1) / count
        if ahead == count:
            times[-1] = leg.end
        can_grow = not held and count > 1 and steps.h * GROWTH <= largest
        made, status = steps.stretch(times, leg.last, Limit(tolerance, can_grow))
        if made:
            t = float(times[made - 1])
        ratio = _SAFETY * (tolerance / max(steps.error, 1e-300)) ** (1 / 3)
        if status == alpha.FAILED:
            ratio = 1 / _LARGEST_CHANGE
        elif status == alpha.INACCURATE:
            ratio = min(ratio, 0.8)
        held = status in (alpha.FAILED, alpha.INACCURATE)
        recorder.work.rejected_steps += held
        h = min(largest, steps.h * min(max(ratio, 1 / _LARGEST_CHANGE), _LARGEST_CHANGE))
        if h < _SMALLEST * largest:
            raise steps.failure(float(times[made])) if status == alpha.FAILED else _too_small(t, steps, tolerance)


def rough_steps(steps: Steps, leg: Leg, largest: float, tolerance: float, recorder: Recorder) -> None:
    """Steps whose local error is about ``tolerance`` [m], without repeating those that fall short: enough to find out
    where a motion needs small steps. They are halved or doubled, a few at a time.

    Raises
    ------
    SimulationError
        BUDGET, beyond `_MOST_ROUGH` of them, beside what steps raise.
    """
    t, h, fewest, most = leg.start, min(max(steps.h, _FIRST * largest), largest), _SMALLEST * largest, largest
    while t < leg.end:
        count = max(1, math.ceil((leg.end - t) / h * (1 - 1e-9)))
        ahead = min(count, _HELD)
        if ahead == count:
            h = (leg.end - t) / count
        steps.set_step(h)
        times = np.linspace(t + h, t + ahead * h, ahead)
        if ahead == count:
            times[-1] = leg.end
        if recorder.steps > _MOST_ROUGH:
            raise SimulationError(Cause.BUDGET, f"more than {_MOST_ROUGH} rough steps", remedy="shorten the run")
        made, status = steps.stretch(times, leg.last, Limit(math.inf))
        if made:
            t = float(times[made - 1])
        if status == alpha.FAILED:
            recorder.work.rejected_steps += 1
            if h < fewest:
                raise steps.failure(float(times[made]))
            largest = max(h / 2, fewest)
            h /= _LARGEST_CHANGE
        elif steps.error > tolerance:
            h /= 2 if steps.error < _LARGEST_CHANGE**3 * tolerance else _LARGEST_CHANGE
        elif steps.error * _TWICE < tolerance:
            h = min(largest, 2 * h)
        largest, h = min(_RECOVERY * largest, most), max(h, fewest / 2)


def _too_small(t: float, steps: Steps, tolerance: float) -> SimulationError:
    return SimulationError(
        Cause.STEP_TOO_SMALL,
        f"a step of {steps.h:.3g} s still has an error of {steps.error:.3g} m",
        where=f"t = {t:.9g} s",
        value=f"{steps.h:.3g} s",
        limit=f"{tolerance:.3g} m",
        remedy="look for jumps of forces without breakpoint; or allow a larger error",
    )
