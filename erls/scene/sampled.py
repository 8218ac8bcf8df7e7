"""Functions of time of Python as tables of a scene, sampled until a cubic spline between samples is the function.

It is looked at in two places of every interval, in the middle and off it. What is over in less than a five-hundredth of
the duration may still be missed: give such a thing as a shape, or as a table.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array

_FIRST, _MOST = 512, 8192  # intervals: what is over in less than a five-hundredth of the time may not be seen
_ASKEW = 0.31  # of an interval: vibrations that are nothing in the middle are something there
_MISSED = 1e-9  # of the range, between samples
_BEYOND = 1.01  # of the duration: a table rests behind its last sample


def sampled_motion(motion: Callable[[float], float], duration: float, where: str) -> dict[str, Any]:
    """A motion [rad or m] over a duration [s] as a table, with its rates at the ends.

    Raises
    ------
    SceneError
        BAD_FIELD: it is not smooth, or gives no finite number.
    """
    times, values, rates = _sampled(motion, duration, where)
    return {"shape": "table", "times": times.tolist(), "values": values.tolist(), "rates": rates}


def sampled_load(load: Callable[[float], float], duration: float, where: str) -> dict[str, Any]:
    """A load [N m or N], or a factor, over a duration [s] as a table; errors are those of `sampled_motion`."""
    times, values, _ = _sampled(load, duration, where)
    return {"shape": "table", "times": times.tolist(), "values": values.tolist(), "interpolation": "cubic"}


def _sampled(function: Callable[[float], float], duration: float, where: str) -> tuple[Array, Array, list[float]]:
    from scipy.interpolate import CubicSpline  # heavy

    end = _BEYOND * duration
    count, times = _FIRST, np.linspace(0.0, end, _FIRST + 1)
    values = _values(function, times, where)
    while True:
        spline = CubicSpline(times, values)
        between = _values(function, (times[1:] + times[:-1]) / 2, where)
        askew = times[:-1] + _ASKEW * np.diff(times)
        missed = max(
            float(np.abs(spline((times[1:] + times[:-1]) / 2) - between).max()),
            float(np.abs(spline(askew) - _values(function, askew, where)).max()),
        )
        if missed <= _MISSED * max(float(np.ptp(values)), float(np.abs(values).max()), 1e-12):
            return times, values, [float(spline(times[0], 1)), float(spline(times[-1], 1))]
        if 2 * count > _MOST:
            message, remedy = "the function is not smooth enough for a table", "give a shape, or a table of samples"
            raise SceneError(Cause.BAD_FIELD, message, where=where, value=missed, remedy=remedy)
        count *= 2
        times, merged = np.linspace(0.0, end, count + 1), np.empty(count + 1)
        merged[::2], merged[1::2] = values, between
        values = merged


def _values(function: Callable[[float], float], times: Array, where: str) -> Array:
    try:
        found = np.array([float(function(t)) for t in times.tolist()])
    except (TypeError, ValueError) as problem:
        message, remedy = f"the function gives no number: {problem}", "let it take a time [s] and give one"
        raise SceneError(Cause.BAD_FIELD, message, where=where, remedy=remedy) from problem
    if not np.isfinite(found).all():
        message, at = "the function gives no finite number", float(times[~np.isfinite(found)][0])
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=f"t = {at:g}", remedy="mend it there")
    return found
