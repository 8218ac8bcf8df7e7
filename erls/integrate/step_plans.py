"""Steps of generalized-α that a run is to take: equal ones over stretches of time, made after those of another run."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from erls.integrate.base import Leg
from erls.maths.so3 import Array

_WINDOWS = 16  # of a leg, each with steps of its own
_CROWD = 8  # steps of the other run in a window, on average, at the least
_AT_ONCE = 1e-3  # of a step: that far apart two switches are at the same time


class Stretch(NamedTuple):
    """Start, end and number of equal steps."""

    start: float
    end: float
    steps: int

    @property
    def size(self) -> float:
        """Of a step [s]."""
        return (self.end - self.start) / self.steps


Plan = tuple[Stretch, ...]


def plan_like(t: Array) -> Plan:
    """Equal steps over windows of time as many as a run with knots ``t`` took there, windows that differ by less than
    half taken together; its legs, at whose ends times stand twice, stay apart, but for those between two switches
    at nearly the same time, which say nothing of steps.
    """
    found: list[Stretch] = []
    for leg in np.split(t, np.flatnonzero(np.diff(t) == 0) + 1):
        if len(leg) < 2:
            continue
        if found and leg[-1] - leg[0] < _AT_ONCE * found[-1].size:
            found[-1] = found[-1]._replace(end=float(leg[-1]))
        else:
            found += _stretches(leg)
    return tuple(found)


def _stretches(t: Array) -> list[Stretch]:
    windows = max(1, min(_WINDOWS, (len(t) - 1) // _CROWD))
    edges = np.linspace(t[0], t[-1], windows + 1)
    numbers = np.interp(edges, t, np.arange(len(t)))
    steps = np.diff(edges) / np.diff(numbers)
    octaves = np.floor(np.log2(steps.max() / steps) + 0.5)
    found = []
    for part in np.split(np.arange(windows), np.flatnonzero(np.diff(octaves)) + 1):
        first, last = int(part[0]), int(part[-1]) + 1
        # the largest need of a step decides
        density = float((1 / steps[first:last]).max())
        start, end = float(edges[first]), float(edges[last]) if last < windows else float(t[-1])
        found.append(Stretch(start, end, max(1, math.ceil(density * (end - start) * (1 - 1e-9)))))
    return found


def finer(plan: Plan, factor: float) -> Plan:
    """A plan with ``factor`` times as many steps everywhere."""
    return tuple(s._replace(steps=max(1, math.ceil(factor * s.steps * (1 - 1e-9)))) for s in plan)


def planned(plan: Plan, leg: Leg) -> list[tuple[Leg, float]]:
    """The parts of a leg in which a plan takes equal steps, with their size [s].

    Legs that a switch ends, or begins at one, are no legs of the plan: of a stretch over such an end each has its part.
    """
    own = [s for s in plan if s.start < leg.end and s.end > leg.start]
    edges = [leg.start, *(s.start for s in own[1:]), leg.end]
    return [(leg._replace(start=a, end=b), s.size) for (a, b), s in zip(pairwise(edges), own, strict=True)]
