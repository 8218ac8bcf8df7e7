"""Motions of a joint over time in a scene file, with two derivatives.

Each shape is one record, which a scene selects by ``shape = "..."``, and its ``build``, which checks the
numbers and returns a `Curve`. To add a shape: one record with ``build``, one name in `Motion`, one row in the
table of ``tests/erls/test_profiles.py``. A motion is continuous, and its end values hold outside (after ``spin_up``
the rate).
Times in s; coordinates in rad, at a prismatic joint in m, where fields in degrees are refused.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from erls.mechanism.curves import Curve, Harmonic, Piecewise, Sum, piecewise, spline
from erls.mechanism.place import Place
from erls.mechanism.profiles import ProfileRecord
from erls.mechanism.tables import samples

REST_TO_REST: dict[int, tuple[float, ...]] = {
    3: (0.0, 0.0, 3.0, -2.0),
    5: (0.0, 0.0, 0.0, 10.0, -15.0, 6.0),
    7: (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0),
    9: (0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0),
}
"""From 0 to 1 over x = 0..1, with 1, 2, 3 and 4 vanishing derivatives at both ends; rising powers of x."""


class Polynomial(ProfileRecord, frozen=True, tag="polynomial"):
    """One motion from rest to rest.

    Attributes
    ----------
    from_, from_deg : float
        Coordinate before the motion [rad or m], or in degrees; give one.
    to, to_deg : float
        Coordinate after it [rad or m], or in degrees; give one.
    start : float
        Time at which it starts [s].
    duration : float
        How long it takes [s].
    degree : int
        3 (acceleration jumps at the ends), 5 (acceleration is continuous), 7 (jerk is continuous too) or 9 (and the
        derivative of the jerk).
    """

    duration: float
    from_: float | None = msgspec.field(name="from", default=None)
    from_deg: float | None = None
    to: float | None = None
    to_deg: float | None = None
    start: float = 0.0
    degree: int = 7

    def build(self, place: Place) -> Curve:
        """Check and build."""
        first, last = place.quantity("from", self.from_, self.from_deg), place.quantity("to", self.to, self.to_deg)
        return rest_to_rest(place, self.start, self.duration, first, last, self.degree)


class Waypoints(ProfileRecord, frozen=True, tag="waypoints"):
    """Motions from rest to rest through a list of coordinates.

    Attributes
    ----------
    times : list of float
        Times of the stops [s].
    values, values_deg : list of float
        Coordinates at the stops [rad or m], or in degrees; give one.
    degree : int
        3, 5, 7 or 9, of each leg, see polynomial.
    """

    times: tuple[float, ...]
    values: tuple[float, ...] | None = None
    values_deg: tuple[float, ...] | None = None
    degree: int = 7

    def build(self, place: Place) -> Curve:
        """Check and build."""
        degree = place.choice("degree", self.degree, tuple(REST_TO_REST))
        values = place.quantities("values", self.values, self.values_deg)
        return legs(*samples(place, None, 1, self.times, values, 2), degree)


class Sine(ProfileRecord, frozen=True, tag="sine"):
    """A sine motion without end; before its start the first value holds.

    The rate jumps at the start unless the phase is 90 or -90 degrees.

    Attributes
    ----------
    amplitude, amplitude_deg : float
        [rad or m], or in degrees; give one.
    frequency_hz : float
        Cycles per second [Hz].
    offset, offset_deg : float, optional
        Coordinate about which it swings [rad or m], or in degrees; 0 unless given.
    phase_deg : float
        Phase at the start [deg].
    start : float
        Time at which it starts [s].
    """

    frequency_hz: float
    amplitude: float | None = None
    amplitude_deg: float | None = None
    offset: float | None = None
    offset_deg: float | None = None
    phase_deg: float = 0.0
    start: float = 0.0

    def build(self, place: Place) -> Curve:
        """Check and build."""
        amplitude = place.quantity("amplitude", self.amplitude, self.amplitude_deg)
        centred = self.offset is None and self.offset_deg is None
        offset = 0.0 if centred else place.quantity("offset", self.offset, self.offset_deg)
        phase = math.radians(place.number("phase_deg", self.phase_deg))
        return Harmonic(
            breakpoints=(place.time("start", self.start),),
            amplitude=amplitude,
            omega=2.0 * math.pi * place.positive("frequency_hz", self.frequency_hz),
            phase=phase,
            offset=offset,
            before=offset + amplitude * math.sin(phase),
            after=0.0,
        )


class SpinUp(ProfileRecord, frozen=True, tag="spin_up"):
    """From rest to a rate that then holds without end.

    With x the share of the ramp that has passed, the rate is rate · s(x): ``polynomial`` takes the s of a motion from
    rest to rest of that degree, ``sine`` x - sin(2πx)/2π, whose slope is a whole wave.

    Attributes
    ----------
    rate, rate_deg : float
        Rate that is reached [rad/s or m/s], or in degrees per second; give one.
    duration : float
        How long it takes to reach it [s].
    from_, from_deg : float, optional
        Coordinate before [rad or m], or in degrees; 0 unless given.
    start : float
        Time at which it starts [s].
    ramp : str
        ``polynomial`` or ``sine``.
    degree : int, optional
        Of the polynomial: 3 (acceleration has kinks at the ends), 5, 7 or 9; 7 unless given.
    """

    duration: float
    rate: float | None = None
    rate_deg: float | None = None
    from_: float | None = msgspec.field(name="from", default=None)
    from_deg: float | None = None
    start: float = 0.0
    ramp: str = "polynomial"
    degree: int | None = None

    def build(self, place: Place) -> Curve:
        """Check and build."""
        start, span = place.time("start", self.start), place.span("duration", self.duration)
        rate = place.quantity("rate", self.rate, self.rate_deg)
        standing = self.from_ is None and self.from_deg is None
        first = 0.0 if standing else place.quantity("from", self.from_, self.from_deg)
        knots = [start, start + span]
        if place.choice("ramp", self.ramp, ("polynomial", "sine")) == "sine":
            if self.degree is not None:
                raise place.error("degree", "a sine has none", self.degree, remedy="remove it")
            swing, omega = rate * span / (2 * math.pi) ** 2, 2 * math.pi / span
            low = first - swing
            pieces = [[low], [low, 0.0, rate / (2 * span)], [low + rate * span / 2, rate]]
            wave = Harmonic(tuple(knots), swing, omega, math.pi / 2, 0.0, before=swing, after=swing)
            return Sum((piecewise(knots, pieces), wave))
        degree = place.choice("degree", 7 if self.degree is None else self.degree, tuple(REST_TO_REST))
        shape = np.array(REST_TO_REST[degree])
        powers = np.arange(1, len(shape) + 1)
        ramp = np.concatenate([[first], rate * shape / powers / span ** (powers - 1)])
        return piecewise(knots, [[first], ramp, [first + rate * span / 2, rate]])


class MotionTable(ProfileRecord, frozen=True, tag="table"):
    """A motion through at least 4 samples, by a cubic spline with continuous rate and acceleration.

    Attributes
    ----------
    file : str, optional
        CSV file with the time in its first column; the path starts at the scene.
    column : int
        Column of the coordinate in the file; column 0 is the time.
    degrees : bool
        The file holds degrees.
    times : list of float, optional
        Times of the samples instead of a file [s].
    values, values_deg : list of float, optional
        Coordinates at these times [rad or m], or in degrees.
    rates, rates_deg : (2,) floats, optional
        Rate at the first and at the last sample [rad/s or m/s], or in degrees per second; at rest unless given.
    """

    file: str | None = None
    column: int = 1
    degrees: bool = False
    times: tuple[float, ...] | None = None
    values: tuple[float, ...] | None = None
    values_deg: tuple[float, ...] | None = None
    rates: tuple[float, float] | None = None
    rates_deg: tuple[float, float] | None = None

    def build(self, place: Place) -> Curve:
        """Check and build."""
        if self.degrees:
            place.angular("degrees", "degrees = false")
            if self.file is None:
                raise place.error("degrees", "applies to a file", True, remedy="use 'values_deg' for lists")
        listed = self.values is not None or self.values_deg is not None
        given = place.quantities("values", self.values, self.values_deg) if listed else None
        t, v = samples(place, self.file, self.column, self.times, given, 4)
        rest = self.rates is None and self.rates_deg is None
        rates = np.zeros(2) if rest else place.quantities("rates", self.rates, self.rates_deg)
        return spline(t, v * (math.pi / 180.0) if self.degrees else v, rates)


Motion = Polynomial | Waypoints | Sine | SpinUp | MotionTable
"""Shapes of a joint coordinate (rad or m), with two derivatives."""


def rest_to_rest(place: Place, start: float, duration: float, first: float, last: float, degree: int) -> Piecewise:
    """One motion from rest to rest, its fields ``start``, ``duration`` and ``degree`` checked."""
    begun = place.time("start", start)
    times = np.array([begun, begun + place.span("duration", duration)])
    return legs(times, np.array([first, last]), place.choice("degree", degree, tuple(REST_TO_REST)))


def legs(times: NDArray[np.float64], values: NDArray[np.float64], degree: int) -> Piecewise:
    """From rest to rest between values (n,), by polynomials of a degree of `REST_TO_REST`; the ends hold outside."""
    shape = np.array(REST_TO_REST[degree])
    pieces: list[ArrayLike] = [values[0]]
    for span, first, last in zip(np.diff(times), values, values[1:], strict=False):
        row = (last - first) * shape / span ** np.arange(len(shape))
        row[0] = first
        pieces.append(row)
    return piecewise(times, [*pieces, values[-1]])
