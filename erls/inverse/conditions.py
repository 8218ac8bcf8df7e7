"""Servo conditions h(q) = y_d(t): coordinates of points, their angles about lines, sums of joint angles.

Rules for a further kind of measure:

1. It says, at k states, its value h, its rows C = ∂h/∂q, its rate ḣ and the bias by which ḧ = C q̈ + bias.
2. ``metres`` are those of its point per unit; 0 where no point moves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from erls.inverse.frames import PointMotion
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, Point
from erls.mechanism.curves import Curve
from erls.mechanism.paths import series
from erls.mechanism.place import Place
from erls.scene.chain import Scene
from erls.scene.check_servo import AXES
from erls.scene.servo import About, Servo
from fe_import.model import IntArray


class Joints(NamedTuple):
    """Joint coordinates at k states.

    Attributes
    ----------
    angles, rates, accelerations : (k, j) arrays
        Of all joints; accelerations where the independent ones are zero.
    rows : (j, n) array
        Over the n independent coordinates.
    """

    angles: Array
    rates: Array
    accelerations: Array
    rows: Array


class Measured(NamedTuple):
    """What a measure says, (k,) each, rows (k, n)."""

    value: Array
    rate: Array
    bias: Array
    rows: Array
    metres: Array


class Measure(Protocol):
    """What is demanded; see the module."""

    @property
    def turns(self) -> bool:
        """Whether whole turns count nothing."""

    def at(self, points: PointMotion, joints: Joints) -> Measured:
        """At k states."""


@dataclass(frozen=True)
class Along:
    """A coordinate of the point ``end`` in a ``direction`` (3,) of the world."""

    end: int
    direction: Array
    turns: bool = False

    def at(self, points: PointMotion, joints: Joints) -> Measured:
        """See `Measure`."""
        place, velocity, acceleration, rows = (x[:, self.end] for x in points)
        value, rate, bias = (x @ self.direction for x in (place, velocity, acceleration))
        return Measured(value, rate, bias, self.direction @ rows, np.ones(len(place)))


@dataclass(frozen=True)
class Angle:
    """Angle of the point ``end`` about a line through ``origin`` (3,), from the first of two ``axes`` (2, 3) to the
    second.
    """

    end: int
    origin: Array
    axes: Array
    turns: bool = True

    def at(self, points: PointMotion, joints: Joints) -> Measured:
        """See `Measure`."""
        place, velocity, acceleration, rows = (x[:, self.end] for x in points)
        x, y = ((place - self.origin) @ self.axes.T).T
        dx, dy = (velocity @ self.axes.T).T
        ddx, ddy = (acceleration @ self.axes.T).T
        square = np.maximum(x * x + y * y, np.finfo(float).tiny)
        rate = (x * dy - y * dx) / square
        bias = (x * ddy - y * ddx - 2 * (x * dx + y * dy) * rate) / square
        across = (x[:, None] * self.axes[1] - y[:, None] * self.axes[0]) / square[:, None]
        return Measured(np.arctan2(y, x), rate, bias, (across[:, None] @ rows)[:, 0], np.sqrt(square))


@dataclass(frozen=True)
class Together:
    """Joint coordinates times ``factors`` (j,), added up."""

    factors: Array
    turns: bool = False

    def at(self, points: PointMotion, joints: Joints) -> Measured:
        """See `Measure`."""
        value, rate, bias = (x @ self.factors for x in (joints.angles, joints.rates, joints.accelerations))
        count = len(joints.angles)
        rows = np.broadcast_to(self.factors @ joints.rows, (count, joints.rows.shape[-1]))
        return Measured(value, rate, bias, rows, np.zeros(count))


class Condition(NamedTuple):
    """What is demanded, by which curve, and how reports call it."""

    name: str
    unit: str
    measure: Measure
    curve: Curve


class Held(NamedTuple):
    """Conditions at k states.

    Attributes
    ----------
    gap, rate, bias : (k, p) arrays
        h - y_d; ḣ - ẏ_d; ḧ - ÿ_d without accelerations.
    rows : (k, p, n) array
        C.
    metres : (k, p) array
        See `Measure`.
    """

    gap: Array
    rate: Array
    bias: Array
    rows: Array
    metres: Array


class Demand(NamedTuple):
    """What conditions demand at times t (k,): y_d and its derivatives, (k, p) each."""

    t: Array
    value: Array
    rate: Array
    acceleration: Array

    def part(self, rows: slice | IntArray) -> Demand:
        """Of some times."""
        return Demand(*(x[rows] for x in self))


@dataclass(frozen=True)
class Conditions:
    """All conditions of a scene, and the points that they look at."""

    every: tuple[Condition, ...]
    points: tuple[Point, ...]

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which a demanded acceleration may jump [s]."""
        return tuple(sorted({t for each in self.every for t in each.curve.breakpoints}))

    def demand(self, t: Array) -> Demand:
        """What is demanded at times (k,)."""
        return Demand(t, *series(tuple(each.curve for each in self.every), t))

    def held(self, demand: Demand, points: PointMotion, joints: Joints) -> Held:
        """At as many states."""
        found = [each.measure.at(points, joints) for each in self.every]
        value, rate, bias, metres = (np.stack([getattr(f, x) for f in found], 1) for x in _STACKED)
        gap = value - demand.value
        turns = np.array([each.measure.turns for each in self.every])
        gap[:, turns] -= 2 * math.pi * np.round(gap[:, turns] / (2 * math.pi))
        rows = np.stack([f.rows for f in found], 1)
        return Held(gap, rate - demand.rate, bias - demand.acceleration, rows, metres)


_STACKED = ("value", "rate", "bias", "metres")


def conditions_of(scene: Scene, mechanism: Mechanism) -> Conditions:
    """Those of the tables ``servo``.

    Raises
    ------
    SceneError
        BAD_FIELD: a motion or path with bad numbers, or there are no conditions.
    """
    points: list[Point] = []
    found: list[Condition] = []
    for k, servo in enumerate(scene.record.servo):
        found += _of_one(servo, Place(scene.folder, f"{scene.path}: servo[{k}]"), mechanism, points)
    if not found:
        where = Place(scene.folder, str(scene.path))
        raise where.error("servo", "nothing is demanded", remedy="add [[servo]] with a point and its motion")
    return Conditions(tuple(found), tuple(points))


def _of_one(servo: Servo, place: Place, mechanism: Mechanism, points: list[Point]) -> list[Condition]:
    if servo.joints:
        names = [joint.name for joint in mechanism.joints]
        turning = {mechanism.joints[names.index(name)].freedom.turns for name in servo.joints}
        if len(turning) > 1:
            raise place.error("joints", "angles and lengths do not add up", remedy="name joints of one kind")
        factors = np.array([servo.joints.get(name, 0.0) for name in names])
        own = Place(place.folder, place.where, turning.pop())
        plain = list(servo.joints.items())
        name = plain[0][0] if plain[0][1] == 1.0 and len(plain) == 1 else " + ".join(f"{x:g} {n}" for n, x in plain)
        unit = "rad" if own.revolute else "m"
        return [Condition(name, unit, Together(factors), _motion(servo, own))]
    point = next(p for p in mechanism.points if p.name == servo.point)
    if point not in points:
        points.append(point)
    end = points.index(point)
    if servo.about is not None:
        measure = _angle(servo.about, end)
        return [Condition(f"{point.name} angle", "rad", measure, _motion(servo, place))]
    axes = [AXES.index(axis) for axis in servo.coordinates]
    measures = [Along(end, np.eye(3)[axis]) for axis in axes]
    names = [f"{point.name}.{axis}" for axis in servo.coordinates]
    if servo.path is None:
        curves: Sequence[Curve] = [_motion(servo, Place(place.folder, place.where, False))]
    else:
        whole = servo.path.build(place.at("path"))
        curves = [whole[axis] for axis in axes]
    return [Condition(name, "m", *each) for name, each in zip(names, zip(measures, curves, strict=True), strict=True)]


def _motion(servo: Servo, place: Place) -> Curve:
    assert servo.motion is not None  # checked with the scene
    return servo.motion.build(place.at("motion"))


def _angle(about: About, end: int) -> Angle:
    axis, zero = np.array(about.axis, dtype=float), np.array(about.zero, dtype=float)
    axis = axis / np.linalg.norm(axis)
    zero = zero - axis * (axis @ zero)
    zero = zero / np.linalg.norm(zero)
    return Angle(end, np.array(about.position, dtype=float), np.stack([zero, np.cross(axis, zero)]))
