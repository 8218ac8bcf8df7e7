"""Paths of a point in the world over time, run through from rest to rest.

Each shape is one record, which a scene selects by ``shape = "..."``, and its ``build``, which checks the numbers and
returns x, y and z as a `Curve` each. To add a shape: one record with ``build``, one name in `Path`, one row in the
table of ``tests/erls/test_servo.py``. Before its start a path rests at its first place, after its end at its last one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np

from erls.maths.so3 import Array, cross
from erls.mechanism.curves import Curve, Piecewise
from erls.mechanism.motions import rest_to_rest
from erls.mechanism.place import Place
from erls.mechanism.profiles import ProfileRecord
from fe_import.description.base import Vector

_PLANE = 1e-6  # of the radius: how far a first place may lie beside the plane of its circle


class _Timed(ProfileRecord, frozen=True, kw_only=True):
    """How a path is run through in time."""

    duration: float
    start: float = 0.0
    degree: int = 9

    def law(self, place: Place, whole: float) -> Piecewise:
        """From 0 to ``whole``."""
        return rest_to_rest(place, self.start, self.duration, 0.0, whole, self.degree)


class LinePath(_Timed, frozen=True, kw_only=True, tag="line"):
    """A straight line.

    Attributes
    ----------
    from_ : (3,) floats
        Where it begins, in the world [m].
    to : (3,) floats
        Where it ends, in the world [m].
    start : float
        Time at which it starts [s].
    duration : float
        How long it takes [s].
    degree : int
        3, 5, 7 or 9, of the polynomial by which it is run through.
    """

    from_: Vector = msgspec.field(name="from")
    to: Vector

    def build(self, place: Place) -> tuple[Curve, Curve, Curve]:
        """Check and build."""
        first, last = np.array(self.from_, dtype=float), np.array(self.to, dtype=float)
        if np.array_equal(first, last):
            raise place.error("to", "a line of no length", self.to, remedy="give another place than 'from'")
        ends = zip(first.tolist(), last.tolist(), strict=True)
        x, y, z = (rest_to_rest(place, self.start, self.duration, *each, self.degree) for each in ends)
        return x, y, z


class CirclePath(_Timed, frozen=True, kw_only=True, tag="circle"):
    """An arc of a circle, or whole turns.

    Attributes
    ----------
    centre : (3,) floats
        In the world [m].
    from_ : (3,) floats
        Where it begins, in the world [m].
    normal : (3,) floats
        Of its plane, in the world; turns are positive about it.
    turn_deg : float
        How far it goes [deg].
    start : float
        Time at which it starts [s].
    duration : float
        How long it takes [s].
    degree : int
        3, 5, 7 or 9, of the polynomial by which it is run through.
    """

    centre: Vector
    from_: Vector = msgspec.field(name="from")
    normal: Vector = (0.0, 0.0, 1.0)
    turn_deg: float = 360.0

    def build(self, place: Place) -> tuple[Curve, Curve, Curve]:
        """Check and build."""
        centre, arm = np.array(self.centre, dtype=float), np.subtract(self.from_, self.centre)
        normal, radius = np.array(self.normal, dtype=float), float(np.linalg.norm(arm))
        if not normal.any():
            raise place.error("normal", "an axis needs a direction", self.normal, remedy="give three numbers")
        normal = normal / np.linalg.norm(normal)
        if not radius:
            raise place.error("from", "the centre itself", self.from_, remedy="give a place on the circle")
        if abs(normal @ arm) > _PLANE * radius:
            remedy = "give a place in the plane through the centre, across the normal"
            raise place.error("from", "not in the plane of the circle", self.from_, remedy=remedy)
        turn = math.radians(place.number("turn_deg", self.turn_deg))
        if not turn:
            raise place.error("turn_deg", "an arc of no length", self.turn_deg, remedy="give an angle")
        law, across = self.law(place, turn), cross(normal, arm)
        x, y, z = (Around(law, *numbers) for numbers in zip(*(p.tolist() for p in (centre, arm, across)), strict=True))
        return x, y, z


Path = LinePath | CirclePath
"""Paths of a point (m), with two derivatives."""


@dataclass(frozen=True)
class Around:
    """One coordinate on a circle: ``centre + arm cos φ + across sin φ`` at the angle φ(t) of ``law``."""

    law: Curve
    centre: float
    arm: float
    across: float

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """See `Curve`."""
        return self.law.breakpoints

    def value(self, t: float, left: bool = False) -> float:
        """See `Curve`."""
        return self.derivatives(t, left)[0]

    def derivatives(self, t: float, left: bool = False) -> tuple[float, float, float]:
        """See `Curve`."""
        angle, rate, acceleration = self.law.derivatives(t, left)
        s, c = math.sin(angle), math.cos(angle)
        out, on = self.arm * c + self.across * s, self.across * c - self.arm * s
        return self.centre + out, on * rate, on * acceleration - out * rate**2


def series(curves: tuple[Curve, ...], times: Array) -> Array:
    """(3, k, p) values, first and second derivatives of p curves at times (k,)."""
    found = np.array([[curve.derivatives(t) for curve in curves] for t in times.tolist()])
    return np.ascontiguousarray(found.reshape(len(times), len(curves), 3).transpose(2, 0, 1))
