"""Cams of a scene: curves over a coordinate, closed where it turns."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.couplings import Cam
from erls.mechanism.curves import Piecewise, piecewise, spline
from erls.mechanism.motions import REST_TO_REST, legs
from erls.mechanism.place import Place
from erls.scene.couplings import Cam as CamRecord

_SAME = 1e-9  # of the range of values: a curve that closes
_CLOSE = 1e-9  # of a period


def build_cam(record: CamRecord, place: Place, carrier: bool, follower: bool) -> Cam:
    """Check and build.

    Parameters
    ----------
    record : CamRecord
    place : Place
    carrier, follower : bool
        Whether the joint that carries it turns, and the one that follows.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    on, over = replace(place, revolute=carrier), replace(place, revolute=follower)
    angles = on.quantities("angles", record.angles, record.angles_deg)
    values = over.quantities("values", record.values, record.values_deg)
    if len(angles) != len(values):
        raise place.error("values", "as many as there are angles", len(values), len(angles), remedy="give one for each")
    least = 4 if record.law == "spline" else 2
    if len(angles) < least or np.any(np.diff(angles) <= 0.0):
        message = f"at least {least} coordinates that rise"
        raise place.error("angles", message, len(angles), remedy="list them in rising order")
    period = _period(record, on, carrier)
    if period:
        angles, values = _closed(angles, values, period, place)
    degree = place.choice("degree", record.degree, tuple(REST_TO_REST))
    curve = legs(angles, values, degree) if record.law == "dwell" else _spline(angles, values, bool(period))
    return Cam(curve, float(angles[0]), period)


def _period(record: CamRecord, on: Place, turns: bool) -> float:
    if record.period is None and record.period_deg is None:
        return 2 * math.pi if turns else 0.0
    found = on.quantity("period", record.period, record.period_deg)
    return on.not_negative("period", found)


def _closed(angles: Array, values: Array, period: float, place: Place) -> tuple[Array, Array]:
    """With a point where the curve comes back to its first one."""
    span = float(angles[-1] - angles[0])
    if span > period * (1 + _CLOSE):
        remedy = "give those of one, or a longer period"
        raise place.error("angles", "more than one period", span, period, remedy=remedy)
    if span < period * (1 - _CLOSE):
        return np.append(angles, angles[0] + period), np.append(values, values[0])
    if abs(values[-1] - values[0]) > _SAME * float(np.ptp(values)):
        message = "the curve does not come back to where it began"
        raise place.error("values", message, float(values[-1]), float(values[0]), remedy="end with the first value")
    return angles, np.append(values[:-1], values[0])


def _spline(angles: Array, values: Array, periodic: bool) -> Piecewise:
    """Cubic; at rest at its ends where it is not closed, so that it goes on smoothly."""
    if not periodic:
        return spline(angles, values, np.zeros(2))
    from scipy.interpolate import CubicSpline  # here: slow to import

    rows = np.zeros((len(angles) + 1, 4))
    rows[1:-1] = CubicSpline(angles, values, bc_type="periodic").c[::-1].T
    rows[0], rows[-1] = rows[1], rows[1]
    return piecewise(angles, rows, smooth=True)
