"""What a sweep keeps of each run: numbers, named as columns of the run's table with a time or a function over time.

    tip.z@0.5   elbow.angle@end   max(tip.distance)   rms(elbow.effort)   range(energy.total)   error   knots

Names are those of `Run.columns` without their units; ``point.`` and ``joint.`` before them change nothing.
``tip.distance`` is how far a point is from where it was at the start.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.run.tables import HEAD

_Of = Callable[[ArrayLike], Array]

TIMES = 1001
"""Even times over which functions are taken, ends included."""

FUNCTIONS: dict[str, Callable[[Array], float]] = {
    "max": lambda values: float(values.max()),
    "min": lambda values: float(values.min()),
    "mean": lambda values: float(values.mean()),
    "rms": lambda values: float(np.sqrt(np.mean(values**2))),
    "range": lambda values: float(np.ptp(values)),
}
"""Over time: one line each."""

_OF_RUN: dict[str, tuple[str, Callable[[Run], float]]] = {
    "error": ("m", lambda run: _total(run)),
    "knots": ("1", lambda run: float(len(run.times))),
    "wall_s": ("s", lambda run: run.wall_s),
}
_OVER = re.compile(rf"({'|'.join(FUNCTIONS)})\((.+)\)")
_JOINT = {
    "coordinate": "joint_coordinate",
    "angle": "joint_angle",
    "rate": "joint_rate",
    "effort": "joint_effort",
}


def _total(run: Run) -> float:
    total = None if run.accuracy is None else run.accuracy.total
    return math.nan if total is None else total


@dataclass(frozen=True)
class Quantity:
    """A number of a run.

    Attributes
    ----------
    text : str
        As it was asked for.
    name : str
        Of a column without its unit; empty where it is of the run itself.
    over : str
        A name from `FUNCTIONS`; empty for a time.
    time : float
        [s], or the end where it is infinite.
    """

    text: str
    name: str = ""
    over: str = ""
    time: float = math.nan

    def of(self, run: Run, seen: dict[str, Array]) -> float:
        """Its value.

        Parameters
        ----------
        run : Run
        seen : dict
            Histories that other quantities of this run have asked for; filled.
        """
        if not self.name:
            return _OF_RUN[self.text][1](run)
        if not self.over:
            return float(history(run, self.name, [run.end if math.isinf(self.time) else self.time])[0])
        if self.name not in seen:
            seen[self.name] = history(run, self.name, run.spread(TIMES))
        return FUNCTIONS[self.over](seen[self.name])

    def unit(self, run: Run) -> str:
        """Of its value."""
        if not self.name:
            return _OF_RUN[self.text][0]
        base, _, part = self.name.rpartition(".")
        return "m" if part == "distance" and base in run.point_names else _heads(run)[self.name][1]


@cache
def quantity(text: str) -> Quantity:
    """Read what is asked for.

    Raises
    ------
    SceneError
        BAD_FIELD: not of one of the forms.
    """
    asked = text.strip()
    if asked in _OF_RUN:
        return Quantity(asked)
    if found := _OVER.fullmatch(asked):
        return Quantity(asked, _plain(found[2]), found[1])
    name, at, time = asked.partition("@")
    try:
        value = math.inf if time == "end" else float(time)
    except ValueError:
        value = math.nan
    if not at or not name or math.isnan(value) or value < 0:
        message = "says neither at which time nor over all times"
        remedy = f"e.g. tip.z@0.5, tip.z@end, max(tip.z); functions are {', '.join(FUNCTIONS)}"
        raise SceneError(Cause.BAD_FIELD, message, where="--get", value=text, remedy=remedy)
    return Quantity(asked, _plain(name), time=value)


def kept_texts(asked: Sequence[str], verdict: bool) -> tuple[str, ...]:
    """What is asked for, checked.

    Raises
    ------
    SceneError
        BAD_FIELD: nothing, not of one of the forms, or the error of runs that state none.
    """
    found = tuple(quantity(text).text for text in ([asked] if isinstance(asked, str) else asked))
    message = ""
    if not found:
        message, remedy = "nothing is kept of the runs", "e.g. --get 'max(tip.distance)'"
    elif "error" in found and not verdict:
        message, remedy = "runs of a sweep do not state their error unless asked to", "add --verdict (verdict=True)"
    if message:
        raise SceneError(Cause.BAD_FIELD, message, where="--get", value=", ".join(found) or "nothing", remedy=remedy)
    return found


def values_of(run: Run, quantities: Sequence[Quantity]) -> list[float]:
    """Each of them.

    Raises
    ------
    SceneError
        BAD_REFERENCE, TIME_OUT_OF_RANGE.
    """
    seen: dict[str, Array] = {}
    return [each.of(run, seen) for each in quantities]


def histories(run: Run, names: Sequence[str], times: ArrayLike) -> Array:
    """(c, k) values of columns at times; the whole table is asked for once, and only where it must be.

    Raises
    ------
    SceneError
        BAD_REFERENCE: there is none of a name.
    """
    alone = [_alone(run, name) for name in names]
    if all(alone):
        return np.array([of(times) for of in alone if of])
    heads = _heads(run)
    for name, of in zip(names, alone, strict=True):
        if of is None and name not in heads:
            known = [*heads, *(f"{point}.distance" for point in run.point_names)]
            message, remedy = "the table of the run has no such column", "name one of its columns"
            raise SceneError(Cause.BAD_REFERENCE, message, where="--get", value=name, limit=known, remedy=remedy)
    columns = run.columns(np.asarray(times, dtype=float))  # what stands there is not asked for again
    found = [columns[heads[n][0]] if n in heads else cast(_Of, of)(times) for n, of in zip(names, alone, strict=True)]
    return np.array(found)


def history(run: Run, name: str, times: ArrayLike) -> Array:
    """(k,) values of one of `histories`."""
    return np.asarray(histories(run, [name], times)[0])


def _alone(run: Run, name: str) -> _Of | None:
    """What gives the values (k,) of a column at times (k,) without the others; None of one that a run does not give so.
    """
    base, _, part = name.rpartition(".")
    if base in run.point_names and part in ("x", "y", "z", "distance"):
        return partial(_distance, run, base) if part == "distance" else partial(_place, run, base, "xyz".index(part))
    if isinstance(run, ChainRun) and base in run.joint_names and part in _JOINT:
        of = partial(getattr(run, _JOINT[part]), base)
        return of if np.ndim(of([run.start])) == 1 else None
    return None


def _place(run: Run, point: str, axis: int, times: ArrayLike) -> Array:
    return np.asarray(run.position(point, times)[..., axis])


def _distance(run: Run, point: str, times: ArrayLike) -> Array:
    places = run.position(point, [run.start, *np.asarray(times, dtype=float).tolist()])
    return np.asarray(np.linalg.norm(places[1:] - places[0], axis=-1))


def _heads(run: Run) -> dict[str, tuple[str, str]]:
    """Head and unit of each column, by its name."""
    found = (HEAD.fullmatch(head) for head in run.columns(np.array([run.start])))
    return {match["name"]: (match[0], match["unit"]) for match in found if match}


def _plain(name: str) -> str:
    """Without the word for its kind."""
    return re.sub(r"^\s*(point|joint)\.", "", name).strip()
