"""Curves over time: what a profile of a scene becomes once it is built.

Rules for a new kind of curve:

1. It is a frozen object with ``value``, ``derivatives`` and ``breakpoints`` (`Curve`).
2. ``breakpoints`` rise and hold every time at which the value or one of its first two derivatives jumps or
   its formula changes. Knots of a C² spline are left out: an integrator need not stop there.
3. At a breakpoint a curve gives the limit from the right, with ``left=True`` the limit from the left:
   an integrator evaluates there twice, at the end of one leg and at the start of the next.
4. Between breakpoints it is twice continuously differentiable, and it is defined for all times.
5. Times within `tolerance` of a breakpoint count as that breakpoint (0.1 + 0.2 and 0.3 are one event).
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Curve(Protocol):
    """A scalar function of time (s)."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Rising times at which the curve is not smooth, in s."""

    def value(self, t: float, left: bool = False) -> float:
        """Value at ``t``; at a breakpoint the limit from the right, or from the left."""

    def derivatives(self, t: float, left: bool = False) -> tuple[float, float, float]:
        """Value, first and second derivative at ``t``, with the same limits."""


def tolerance(t: float) -> float:
    """Distance in s within which two times are the same event: some ten rounding errors."""
    return 1e-13 + 1e-14 * abs(t)


def passed(knots: Sequence[float], t: float, left: bool) -> int:
    """Number of knots that lie behind ``t``; a knot at ``t`` itself counts unless ``left``."""
    return bisect_left(knots, t - tolerance(t)) if left else bisect_right(knots, t + tolerance(t))


def merged(times: Iterable[float]) -> tuple[float, ...]:
    """Sorted times, those that are the same event once."""
    kept: list[float] = []
    for t in sorted(times):
        if not kept or t - kept[-1] > tolerance(t):
            kept.append(t)
    return tuple(kept)


@dataclass(frozen=True, eq=False)
class Piecewise:
    """Polynomial pieces; before the first and after the last knot a constant or another polynomial.

    Parameters
    ----------
    knots : tuple of float
        n rising times, s.
    coefficients : (n + 1, k) array
        Row i belongs to the piece that ends at knot i, rising powers of the time since its own start
        (of the time since knot 0 for row 0).
    breakpoints : tuple of float
        The knots that are not smooth.
    """

    knots: tuple[float, ...]
    coefficients: NDArray[np.float64]
    breakpoints: tuple[float, ...]

    def _piece(self, t: float, left: bool) -> tuple[float, list[float]]:
        i = passed(self.knots, t, left)
        origin = self.knots[max(i - 1, 0)] if self.knots else 0.0
        coefficients: list[float] = self.coefficients[i].tolist()
        return t - origin, coefficients[::-1]

    def value(self, t: float, left: bool = False) -> float:
        """See `Curve`."""
        x, coefficients = self._piece(t, left)
        v = 0.0
        for c in coefficients:
            v = v * x + c
        return v

    def derivatives(self, t: float, left: bool = False) -> tuple[float, float, float]:
        """See `Curve`."""
        x, coefficients = self._piece(t, left)
        v = d = half = 0.0
        for c in coefficients:
            half = half * x + d
            d = d * x + v
            v = v * x + c
        return v, d, 2.0 * half


def piecewise(
    knots: ArrayLike, pieces: Sequence[ArrayLike] | NDArray[np.float64], *, smooth: bool = False
) -> Piecewise:
    """Assemble a `Piecewise`; rows of different length are filled up with zeros.

    Parameters
    ----------
    knots : (n,) array
        Rising times, s.
    pieces : n + 1 rows
        Coefficients as in `Piecewise`.
    smooth : bool
        The inner knots join with two continuous derivatives, only the ends are breakpoints.
    """
    times = np.asarray(knots, dtype=float)
    rows = [np.atleast_1d(np.asarray(p, dtype=float)) for p in pieces]
    table = np.zeros((len(rows), max(len(r) for r in rows)))
    for i, row in enumerate(rows):
        table[i, : len(row)] = row
    table.flags.writeable = False
    listed: list[float] = times.tolist()
    ends = listed[:1] + listed[-1:] if smooth else listed
    return Piecewise(tuple(listed), table, merged(ends))


def spline(
    t: NDArray[np.float64], v: NDArray[np.float64], rates: NDArray[np.float64] | None = None
) -> Piecewise:
    """Cubic C² spline through samples; outside the end values hold.

    Parameters
    ----------
    t, v : (n,) array
        At least 4 samples.
    rates : (2,) array, optional
        Slopes at both ends; without them the ends are not-a-knot.
    """
    from scipy.interpolate import CubicSpline  # here: slow to import, and few scenes have tables

    ends = "not-a-knot" if rates is None else ((1, rates[0]), (1, rates[1]))
    rows = np.zeros((len(t) + 1, 4))
    rows[1:-1] = CubicSpline(t, v, bc_type=ends).c[::-1].T
    rows[0, 0], rows[-1, 0] = v[0], v[-1]
    return piecewise(t, rows, smooth=True)


@dataclass(frozen=True)
class Harmonic:
    """``offset + amplitude sin(omega (t - start) + phase)`` from the first to the last breakpoint.

    Parameters
    ----------
    breakpoints : tuple of float
        Start and, unless it never stops, end, s.
    amplitude, offset : float
        In the unit of the curve.
    omega, phase : float
        rad/s, rad.
    before, after : float
        Values held outside.
    """

    breakpoints: tuple[float, ...]
    amplitude: float
    omega: float
    phase: float
    offset: float
    before: float
    after: float

    def value(self, t: float, left: bool = False) -> float:
        """See `Curve`."""
        return self.derivatives(t, left)[0]

    def derivatives(self, t: float, left: bool = False) -> tuple[float, float, float]:
        """See `Curve`."""
        count = passed(self.breakpoints, t, left)
        if count != 1:
            return self.before if count == 0 else self.after, 0.0, 0.0
        angle = self.omega * (t - self.breakpoints[0]) + self.phase
        s, c = self.amplitude * math.sin(angle), self.amplitude * math.cos(angle)
        return self.offset + s, self.omega * c, -(self.omega**2) * s


@dataclass(frozen=True)
class Sum:
    """Sum of curves."""

    parts: tuple[Curve, ...]

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """All breakpoints of the parts."""
        return merged(t for p in self.parts for t in p.breakpoints)

    def value(self, t: float, left: bool = False) -> float:
        """See `Curve`."""
        return sum((p.value(t, left) for p in self.parts), 0.0)

    def derivatives(self, t: float, left: bool = False) -> tuple[float, float, float]:
        """See `Curve`."""
        rows = [p.derivatives(t, left) for p in self.parts]
        return sum((r[0] for r in rows), 0.0), sum((r[1] for r in rows), 0.0), sum((r[2] for r in rows), 0.0)
