"""Rotation vectors that turn on for ever: a run in stretches, between which a vector is exchanged for a shorter one.

A rotation vector ψ tells its rotation badly near a full turn, where T(ψ) is singular. Beyond `LONGEST` it goes on with
a full turn less (`erls.maths.full_turns`): the same rotation with the opposite sense of turning. Nothing else changes,
and no rotation has to be remembered beside the coordinates: equations, files and interpolation know vectors alone. At
the exchange a solution holds two knots, one in either vector.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np

from erls.integrate.base import Halved, Observer, Options, Solution, StopRun, Work
from erls.integrate.memory import Memory, Within, taken
from erls.maths.full_turns import turned_on
from erls.maths.so3 import Array

_CHART = "chart.begun"

LONGEST = 1.25 * np.pi
"""Length of a rotation vector beyond which it is exchanged; a step may go on by the rest of a full turn [rad]."""


def exchanged(y: Array, v: Array, places: Sequence[int]) -> tuple[Array, Array]:
    """The same state with short rotation vectors.

    Parameters
    ----------
    y, v : (n,) arrays
    places : sequence of int
        Of the first component of each vector among the coordinates.
    """
    y, v = y.copy(), v.copy()
    for k in places:
        if np.linalg.norm(y[k : k + 3]) > LONGEST:
            y[k : k + 3], v[k : k + 3] = turned_on(y[k : k + 3], v[k : k + 3], -1)
    return y, v


def in_charts(integrate: Callable[..., Solution], places: Sequence[int]) -> Callable[..., Solution]:
    """An integrator that exchanges rotation vectors on its way; ``places`` as of `exchanged`."""

    def integrated(
        system: Any,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        before: Solution | None = None
        state = exchanged(np.asarray(y), np.asarray(v), places)
        (start, end), keeper = times, options.keeper
        inner = None if keeper is None else keeper.memory
        if inner is not None and _CHART in inner:
            start, state, before = _restored(inner, len(y))
        while True:
            watch = _Watch(observer, places, before)
            if keeper is not None:
                own = partial(_memory, start, state, before) if before is not None else dict
                options = replace(options, keeper=Within(keeper, own, inner))
            found = integrate(system, (start, end), *state, options, watch)
            long = _first_long(found, places)
            last = len(found.t) - 1 if long is None else long
            whole = joined(before, _up_to(found, last))
            if long is None or watch.stopped or not found.t[long] < end:
                return whole if long is None else replace(whole, failure=found.failure)
            start, before = float(found.t[long]), replace(whole, failure=None)
            state, inner = exchanged(found.y[long], found.v[long], places), None

    return integrated


def _memory(start: float, state: tuple[Array, Array], before: Solution) -> Memory:
    """Of a stretch: how it began, and what was before."""
    work = [getattr(before.work, f.name) for f in fields(Work)]
    known = {_CHART: np.array([start]), "chart.work": np.array(work), "chart.start": np.array(state)}
    known["chart.halved"] = np.array(before.halved, dtype=float)
    return {**known, **{f"chart.{name}": getattr(before, name) for name in ("t", "y", "v", "a")}}


def _restored(memory: Memory, size: int) -> tuple[float, tuple[Array, Array], Solution]:
    """The same again."""
    start = float(taken(memory, _CHART, np.zeros(1))[0])
    work = Work(*taken(memory, "chart.work", np.zeros(len(fields(Work)), dtype=np.int64)).tolist())
    state, t = taken(memory, "chart.start", np.zeros((2, size))), taken(memory, "chart.t", np.zeros(1), axis=0)
    y, v, a = (taken(memory, f"chart.{name}", np.zeros((len(t), size))) for name in ("y", "v", "a"))
    halved, given, first = taken(memory, "chart.halved", np.zeros(3)).tolist()
    whole = Solution(t, y, v, a, work, halved=Halved(int(halved), int(given), first))
    return start, (state[0], state[1]), whole


class _Watch:
    """Tells the observer of the whole run, and ends a stretch where a rotation vector has grown too long."""

    def __init__(self, observer: Observer | None, places: Sequence[int], before: Solution | None) -> None:
        self._observer, self._places, self._before = observer, places, before
        self.stopped = False

    def __call__(self, t: float, knots: Callable[[], Solution]) -> Sequence[float] | None:
        kept: Sequence[float] | None = None
        if self._observer is not None:
            try:
                kept = self._observer(t, lambda: joined(self._before, knots()))
            except StopRun:
                self.stopped = True
                raise
        if _first_long(knots(), self._places) is not None:
            raise StopRun
        return kept


def _first_long(solution: Solution, places: Sequence[int]) -> int | None:
    """The first knot, not counting that at the start, with a vector that is too long."""
    lengths = [np.linalg.norm(solution.y[1:, k : k + 3], axis=1) for k in places]
    found = np.flatnonzero(np.max(lengths, axis=0) > LONGEST)
    return int(found[0]) + 1 if len(found) else None


def _up_to(solution: Solution, last: int) -> Solution:
    """The knots up to one, and their share of the work: how many more were made depends on when it was looked at."""
    count = len(solution.t)
    parts: dict[str, Any] = {}
    for field in fields(solution):
        value = getattr(solution, field.name)
        if isinstance(value, np.ndarray) and len(value) == count:
            parts[field.name] = value[: last + 1]
    if last < count - 1:
        made, kept = (int(np.count_nonzero(np.diff(t))) for t in (solution.t, solution.t[: last + 1]))
        share = kept / max(made, 1)
        parts["work"] = Work(**{f.name: round(share * getattr(solution.work, f.name)) for f in fields(Work)})
    return replace(solution, **parts)


def joined(before: Solution | None, after: Solution) -> Solution:
    """One solution of two stretches, the first of which may be none."""
    if before is None:
        return after
    parts: dict[str, Any] = {}
    for field in fields(after):
        first, second = getattr(before, field.name), getattr(after, field.name)
        if isinstance(second, np.ndarray):
            parts[field.name] = np.concatenate([first, second])
    work = Work(**{f.name: getattr(before.work, f.name) + getattr(after.work, f.name) for f in fields(Work)})
    warnings = tuple(dict.fromkeys((*before.warnings, *after.warnings)))
    choice = before.choice or after.choice
    halved = before.halved.and_then(after.halved)
    return replace(after, **parts, work=work, warnings=warnings, choice=choice, companion=None, halved=halved)
