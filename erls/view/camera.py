"""Where a picture is taken from: a parallel isometric view that fits a box, and the box with its measured grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from erls.maths.so3 import Array

Size = tuple[int, int]
Pixels = NDArray[np.uint8]
_AZIMUTH, _ELEVATION = math.radians(-58.0), math.radians(26.0)
_LEAST = 0.3  # thinnest side of the box, of its longest


@dataclass(frozen=True)
class Tick:
    """A number on an axis: its axis, place in the world and text; an axis title has no number."""

    axis: int
    place: Array
    text: str
    title: bool = False


@dataclass(frozen=True)
class Box:
    """A measured box around everything that moves: (3,) corners and the distance of grid lines [m]."""

    low: Array
    high: Array
    step: float

    @classmethod
    def around(cls, points: Array) -> Box:
        """A box around (n, 3) points, with a margin, that is not flat."""
        low, high = points.min(axis=0), points.max(axis=0)
        longest = max(float((high - low).max()), 1e-6)
        grow = np.maximum(_LEAST * longest - (high - low), 0.0) / 2 + 0.04 * longest
        return cls(low - grow, high + grow, round_number(longest / 7))

    @property
    def corners(self) -> Array:
        """(8, 3) corners."""
        ends = np.array([self.low, self.high])
        return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])

    def marks(self, axis: int) -> Array:
        """Grid lines along an axis."""
        first, last = math.ceil(self.low[axis] / self.step), math.floor(self.high[axis] / self.step)
        return np.arange(first, last + 1) * self.step


def round_number(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    decade = 10.0 ** math.floor(math.log10(value))
    return float(next(decade * k for k in (1, 2, 5, 10) if decade * k >= value * 0.999))


@dataclass(frozen=True)
class Camera:
    """A parallel view: (3,) directions in the world, the point in the middle of the picture, metres per pixel."""

    right: Array
    up: Array
    towards: Array
    vertical: int
    focal: Array
    pixel: float
    size: Size

    @classmethod
    def fitting(cls, box: Box, gravity: Array, size: Size) -> Camera:
        """The view of a box: from the front, right and above, with gravity pointing down.

        Parameters
        ----------
        box : Box
        gravity : (3,) array
        size : (width, height)
            Of the picture [pixel].
        """
        vertical = int(np.abs(gravity).argmax()) if gravity.any() else 2
        turned = np.roll(np.eye(3), -(vertical + 1), axis=0)  # first and second horizontal axis, vertical axis
        if gravity[vertical] > 0:
            turned = np.array([turned[1], turned[0], -turned[2]])
        flat, rise = math.cos(_ELEVATION), math.sin(_ELEVATION)
        first, second, _ = np.abs(turned) @ (box.high - box.low)
        azimuth = _AZIMUTH if first > 0.8 * second else -math.pi / 2 - _AZIMUTH  # along the longer side
        towards = np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), rise]) @ turned
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0]) @ turned
        up = np.cross(towards, right)
        width, height = size
        em = text_unit(size)
        left, across, top, bottom = 4.5 * em, 10.0 * em, 5.5 * em, 4.0 * em
        x, y = box.corners @ right, box.corners @ up
        pixel = max(np.ptp(x) / max(width - left - across, 1.0), np.ptp(y) / max(height - top - bottom, 1.0))
        middle = (box.low + box.high) / 2
        shift_x = (x.max() + x.min()) / 2 - middle @ right + pixel * (across - left) / 2
        shift_y = (y.max() + y.min()) / 2 - middle @ up + pixel * (top - bottom) / 2
        focal = middle + shift_x * right + shift_y * up
        return cls(right, up, towards, vertical, focal, float(pixel), size)

    def project(self, points: Array) -> Array:
        """(..., 2) pixels, from the top left, of (..., 3) points."""
        away = (points - self.focal) / self.pixel
        width, height = self.size
        return np.stack([width / 2 + away @ self.right, height / 2 - away @ self.up], axis=-1)

    def lift(self, x: float, y: float) -> Array:
        """(3,) point of the focal plane at a pixel."""
        width, height = self.size
        away = (x - width / 2) * self.right + (height / 2 - y) * self.up
        return np.asarray(self.focal + self.pixel * away)


def text_unit(size: Size) -> float:
    """Height of common text [pixel]: a fifty-fifth of the picture, but readable."""
    return max(min(size[1] / 55, size[0] / 80), 9.0)


@dataclass(frozen=True)
class Walls:
    """The floor and the two far sides of a box with their grid, as seen by a camera."""

    box: Box
    camera: Camera

    @cached_property
    def far(self) -> Array:
        """(3,) coordinate of the far side of each axis."""
        return np.where(self.camera.towards > 0, self.box.low, self.box.high)

    @cached_property
    def near(self) -> Array:
        """(3,) coordinate of the near side of each axis."""
        return np.where(self.camera.towards > 0, self.box.high, self.box.low)

    def lines(self) -> Array:
        """(n, 2, 3) grid lines."""
        result = []
        for wall in range(3):
            for along in {0, 1, 2} - {wall}:
                across = 3 - wall - along
                for mark in (self.box.low[across], *self.box.marks(across), self.box.high[across]):
                    start = self.far.copy()
                    start[across], start[along] = mark, self.box.low[along]
                    end = start.copy()
                    end[along] = self.box.high[along]
                    result.append([start, end])
        return np.array(result)

    def edge(self, axis: int) -> Array:
        """(3,) point on the edge that carries the numbers of an axis; its own coordinate does not count."""
        vertical = self.camera.vertical
        if axis != vertical:
            edge = self.near.copy()
            edge[vertical] = self.far[vertical]
            return edge
        first, second = (k for k in range(3) if k != vertical)
        ends = [self.near.copy(), self.near.copy()]
        ends[0][first], ends[1][second] = self.far[first], self.far[second]
        return min(ends, key=lambda e: float(e @ self.camera.right))

    def outward(self, axis: int) -> Array:
        """(2,) direction on the picture from the box to the numbers of an axis."""
        at = self.edge(axis)
        at[axis] = (self.box.low[axis] + self.box.high[axis]) / 2
        centre = (self.box.low + self.box.high) / 2
        middle, here, there = self.camera.project(np.array([centre, at, at + np.eye(3)[axis]]))
        along = (there - here) / np.linalg.norm(there - here)
        away = (here - middle) - ((here - middle) @ along) * along
        return np.asarray(away / max(float(np.linalg.norm(away)), 1e-9))

    def ticks(self) -> list[Tick]:
        """Numbers and titles of all axes."""
        em, result = text_unit(self.camera.size), []
        for axis in range(3):
            marks, at = self.box.marks(axis), self.edge(axis)
            ends = self.camera.project(np.array([at, at + self.box.step * np.eye(3)[axis]]))
            apart = float(np.linalg.norm(ends[1] - ends[0]))
            every = next((n for n in (1, 2, 5, 10) if n * apart > 3.2 * em), 10)
            for mark in marks:
                if round(mark / self.box.step) % every == 0:
                    place = at.copy()
                    place[axis] = mark
                    result.append(Tick(axis, place, f"{mark + 0.0:.6g}"))
            place = at.copy()
            place[axis] = (self.box.low[axis] + self.box.high[axis]) / 2
            result.append(Tick(axis, place, f"{'xyz'[axis]} [m]", title=True))
        return result
