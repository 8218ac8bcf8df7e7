"""Torques and forces over time in a scene file; their sum drives a joint.

Each shape is one record, which a scene selects by ``shape = "..."``, and its ``build``, which checks the
numbers and returns a `Curve`. To add a shape: one record with ``build``, one name in `Load`, one row in the
table of ``tests/erls/test_profiles.py``. Times in s; torques in N m, at a prismatic joint forces in N.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np

from erls.mechanism.curves import Curve, Harmonic, Sum, piecewise, spline
from erls.mechanism.place import SHORTEST, Place
from erls.mechanism.tables import samples


class ProfileRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="shape"):
    """Base of all shapes, of loads and of motions."""


class Constant(ProfileRecord, frozen=True, tag="constant"):
    """The same load at all times.

    Attributes
    ----------
    value : float
        Load [N m or N].
    """

    value: float

    def build(self, place: Place) -> Curve:
        """Check and build."""
        return piecewise([], [place.number("value", self.value)])


class Step(ProfileRecord, frozen=True, tag="step"):
    """A load that jumps from zero to its value.

    Attributes
    ----------
    start : float
        Time of the jump [s].
    value : float
        Load from then on [N m or N].
    end : float, optional
        Time at which it jumps back to zero [s]; never unless given.
    """

    start: float
    value: float
    end: float | None = None

    def build(self, place: Place) -> Curve:
        """Check and build."""
        start, value = place.time("start", self.start), place.number("value", self.value)
        if self.end is None:
            return piecewise([start], [0.0, value])
        if place.time("end", self.end) - start < SHORTEST:
            remedy = f"give a time after start = {start}, or leave it out"
            raise place.error("end", "not after the start", self.end, remedy=remedy)
        return piecewise([start, self.end], [0.0, value, 0.0])


class Trapezoid(ProfileRecord, frozen=True, tag="trapezoid"):
    """A load that rises linearly, holds and falls linearly; zero outside.

    Attributes
    ----------
    start : float
        Time at which it begins to rise [s].
    rise : float
        Duration of the rise [s]; 0 is a jump.
    hold : float
        Duration at full load [s]; may be 0.
    fall : float
        Duration of the fall [s]; 0 is a jump.
    value : float
        Full load [N m or N].
    """

    start: float
    rise: float
    hold: float
    fall: float
    value: float

    def build(self, place: Place) -> Curve:
        """Check and build."""
        value = place.number("value", self.value)
        spans = [place.span(n, getattr(self, n), zero=True) for n in ("rise", "hold", "fall")]
        if sum(spans) == 0.0:
            raise place.error(
                "hold", "rise, hold and fall are all 0", 0.0, remedy="give at least one of them"
            )
        slopes = [
            [0.0, value / max(self.rise, SHORTEST)],
            [value],
            [value, -value / max(self.fall, SHORTEST)],
        ]
        knots, pieces = [place.time("start", self.start)], [[0.0]]
        for span, piece in zip(spans, slopes, strict=True):
            if span > 0.0:
                knots.append(knots[-1] + span)
                pieces.append(piece)
        return piecewise(knots, [*pieces, [0.0]])


class SineBurst(ProfileRecord, frozen=True, tag="sine_burst"):
    """A number of cycles of a sine; zero outside.

    Attributes
    ----------
    start : float
        Time of the first cycle [s].
    amplitude : float
        Largest load [N m or N].
    frequency_hz : float
        Cycles per second [Hz].
    cycles : float
        Number of cycles, not necessarily whole.
    phase_deg : float
        Phase at the start [deg].
    """

    start: float
    amplitude: float
    frequency_hz: float
    cycles: float
    phase_deg: float = 0.0

    def build(self, place: Place) -> Curve:
        """Check and build."""
        start, frequency = place.time("start", self.start), place.positive("frequency_hz", self.frequency_hz)
        duration = place.positive("cycles", self.cycles) / frequency
        place.span("cycles", duration)
        return Harmonic(
            breakpoints=(start, start + duration),
            amplitude=place.number("amplitude", self.amplitude),
            omega=2.0 * math.pi * frequency,
            phase=math.radians(place.number("phase_deg", self.phase_deg)),
            offset=0.0,
            before=0.0,
            after=0.0,
        )


class LoadTable(ProfileRecord, frozen=True, tag="table"):
    """A load from samples; before the first and after the last one the end values hold.

    Attributes
    ----------
    file : str, optional
        CSV file with the time in its first column; the path starts at the scene.
    column : int
        Column of the load in the file; column 0 is the time.
    times : list of float, optional
        Times of the samples instead of a file [s].
    values : list of float, optional
        Loads at these times [N m or N].
    interpolation : str
        ``linear``, ``cubic`` (C² spline, not-a-knot ends, at least 4 samples) or ``hold`` (steps).
    """

    file: str | None = None
    column: int = 1
    times: tuple[float, ...] | None = None
    values: tuple[float, ...] | None = None
    interpolation: str = "linear"

    def build(self, place: Place) -> Curve:
        """Check and build."""
        place.choice("interpolation", self.interpolation, ("linear", "cubic", "hold"))
        cubic = self.interpolation == "cubic"
        given = None if self.values is None else place.quantities("values", self.values, None)
        t, v = samples(place, self.file, self.column, self.times, given, 4 if cubic else 2)
        if cubic:
            return spline(t, v, None)
        slopes = np.diff(v) / np.diff(t) if self.interpolation == "linear" else np.zeros(len(t) - 1)
        rows = np.zeros((len(t) + 1, 2))
        rows[:, 0] = np.concatenate((v[:1], v))
        rows[1:-1, 1] = slopes
        return piecewise(t, rows)


Load = Constant | Step | Trapezoid | SineBurst | LoadTable
"""Shapes of a torque (N m) or force (N)."""


def build_loads(records: tuple[Load, ...], place: Place, name: str) -> Curve:
    """Sum of the loads in the list ``name`` of the record at ``place``."""
    return Sum(tuple(r.build(place.at(f"{name}[{i}]")) for i, r in enumerate(records)))
