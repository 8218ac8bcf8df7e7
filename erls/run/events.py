"""Events: when a coordinate of the motion crosses a value, and runs that end there.

A crossing is looked for between the knots of a run, so that one there and back within a step is not seen; its time is
the root of the interpolated motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from erls.equations.formulation import Formulation, State
from erls.integrate.base import Solution, hermite
from erls.mechanism.chain import Mechanism
from erls.run.chain.places import point_position
from erls.scene.chain import Event
from erls.scene.check import OF_POINTS


@dataclass(frozen=True)
class Happening:
    """An event that happened.

    Attributes
    ----------
    name : str
    time : float
        [s]
    rising : bool
        Whether the coordinate grew past the value.
    """

    name: str
    time: float
    rising: bool


def event_value(event: Event) -> float:
    """Value that the coordinate crosses [m, rad, m/s or rad/s]."""
    return float(np.radians(event.value_deg) if event.value is None else event.value)  # type: ignore[arg-type]


def happenings(
    events: Sequence[Event], formulation: Formulation, solution: Solution, since: float | None = None
) -> tuple[Happening, ...]:
    """What happened in a motion, in the order of time.

    Parameters
    ----------
    events : sequence of Event
    formulation : Formulation
    solution : Solution
    since : float, optional
        Knots from this time on; all of them unless given.
    """
    if not events:
        return ()
    s = solution
    first = 0 if since is None else int(np.searchsorted(s.t, since))
    states = [formulation.state(float(s.t[k]), s.y[k], s.v[k]) for k in range(first, len(s.t))]
    found = []
    for event in events:
        height = _height(formulation.mechanism, event)
        values = [height(state) for state in states]
        for k, (before, after) in enumerate(pairwise(values), start=first):
            rising = before < 0 <= after
            if s.t[k] < s.t[k + 1] and (
                (rising and event.direction != "falling") or (before > 0 >= after and event.direction != "rising")
            ):
                time = _root(formulation, s, height, float(s.t[k]), float(s.t[k + 1]))
                found.append(Happening(event.name, time, rising))
    return tuple(sorted(found, key=lambda happening: happening.time))


def cut(solution: Solution, time: float) -> Solution:
    """A solution up to its first knot at or after a time."""
    knots = int(np.searchsorted(solution.t, time)) + 1
    parts = {f.name: getattr(solution, f.name) for f in fields(solution)}
    own: dict[str, Any] = {name: part[:knots] for name, part in parts.items() if isinstance(part, np.ndarray)}
    return replace(solution, **own)


def _height(mechanism: Mechanism, event: Event) -> Callable[[State], float]:
    """The coordinate less the value, of a state."""
    value = event_value(event)
    if event.joint:
        names = [joint.name for joint in mechanism.joints]
        number, what = names.index(event.joint), {"angle": "angles", "rate": "rates"}[event.coordinate]
        return lambda state: float(getattr(state, what)[number]) - value
    number = [point.name for point in mechanism.points].index(event.point)
    axis = OF_POINTS.index(event.coordinate)
    return lambda state: float(point_position(mechanism, state, number)[axis]) - value


def _root(
    formulation: Formulation, s: Solution, height: Callable[[State], float], start: float, end: float
) -> float:
    from scipy.optimize import brentq  # here: only events need it

    def at(t: float) -> float:
        y, v = hermite(s.t, s.y, s.v, s.a, np.array([t]))
        return height(formulation.state(t, y[0], v[0]))

    ends = at(start), at(end)
    if ends[0] * ends[1] > 0:  # rounding of the interpolation: the crossing is at an end
        return start if abs(ends[0]) < abs(ends[1]) else end
    return float(brentq(at, start, end, xtol=1e-12))
