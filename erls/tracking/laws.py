"""Laws of motion s(t) from rest at 0 to rest at 1: cubic splines on even knots, as tables of a scene are read.

Their acceleration is linear between knots, so that what oscillators answer is exact (`erls.tracking.vibration`).
Shapers are impulses of a sum of 1, by which a law is folded: an oscillator that they leave at rest stays at rest after
the folded law, too (N. C. Singer and W. P. Seering, J. Dyn. Syst. Meas. Control 112 (1990) 76-82).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.motions import REST_TO_REST


class Law(NamedTuple):
    """At even knots, (k,) each: times [s], s and its derivatives."""

    t: Array
    place: Array
    rate: Array
    acceleration: Array

    @property
    def step(self) -> float:
        """Between knots [s]."""
        return float(self.t[1] - self.t[0])

    @property
    def duration(self) -> float:
        """From rest to rest [s]."""
        return float(self.t[-1])


class Shaper(NamedTuple):
    """Impulses: (c,) times [s], the first 0, and sizes, which add up to 1."""

    times: Array
    sizes: Array


def law_of(duration: float, place: Array) -> Law:
    """Through s (k,) at even knots, at rest at the ends."""
    from scipy.interpolate import CubicSpline  # here: slow to import

    t = np.linspace(0.0, duration, len(place))
    spline = CubicSpline(t, place, bc_type="clamped")
    return Law(t, *(np.asarray(spline(t, k)) for k in range(3)))


def polynomial(duration: float, degree: int, knots: int, shaper: Shaper | None = None) -> Law:
    """The polynomial of a degree (`REST_TO_REST`) that takes a duration [s], folded by a shaper if there is one."""
    rising = np.array(REST_TO_REST[degree])
    times, sizes = (np.zeros(1), np.ones(1)) if shaper is None else shaper
    whole = duration + float(times[-1])
    x = np.clip((np.linspace(0.0, whole, knots)[:, None] - times) / duration, 0.0, 1.0)
    return law_of(whole, np.polynomial.polynomial.polyval(x, rising) @ sizes)


def shaper(omega: float, damping: float) -> Shaper:
    """Of two impulses, which leave an oscillator at rest.

    Parameters
    ----------
    omega : float
        Without damping [rad/s].
    damping : float
        Ratio.
    """
    root = np.sqrt(1 - damping**2)
    left = np.exp(-np.pi * damping / root)
    return Shaper(np.array([0.0, np.pi / (omega * root)]), np.array([1.0, left]) / (1 + left))


def folded(shapers: Sequence[Shaper]) -> Shaper | None:
    """All of them one after the other."""
    if not shapers:
        return None
    times, sizes = np.zeros(1), np.ones(1)
    for each in shapers:
        times, sizes = np.add.outer(times, each.times).ravel(), np.outer(sizes, each.sizes).ravel()
    order = np.argsort(times)
    return Shaper(times[order], sizes[order])
