"""Nastran grid points: positions and displacement frames from GRID and CORD1R ... CORD2S cards."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array
from fe_import.nastran.cards import Card

_BY_POINTS = ("CORD2R", "CORD2C", "CORD2S")
_BY_GRIDS = ("CORD1R", "CORD1C", "CORD1S")
_DEEPEST = 100  # coordinate systems defined in each other
CARDS = frozenset({"GRID", "GRDSET", "SPOINT", "PLOTEL", *_BY_POINTS, *_BY_GRIDS})


@dataclass(frozen=True)
class GridPoints:
    """Grid points of a bulk data file.

    Attributes
    ----------
    positions : dict of (3,) arrays
        By number, in the basic frame.
    axes : dict of (3, 3) arrays
        Axes (columns) of the displacement frame, of those points that have one of their own.
    scalar_points : set of int
    lines : list of pairs
        Points that PLOTEL cards join.
    frames : Frames
        All coordinate systems.
    """

    positions: dict[int, Array]
    axes: dict[int, Array]
    scalar_points: set[int]
    lines: list[tuple[int, int]]
    frames: Frames


@dataclass(frozen=True)
class Frame:
    """Origin and axes (columns) in the basic frame; ``kind``: rectangular R, cylindrical C, spherical S."""

    origin: Array
    axes: Array
    kind: str = "R"

    def position(self, given: Array) -> Array:
        """Of a point with these coordinates; angles in degrees."""
        if self.kind == "C":
            radius, angle = given[0], np.radians(given[1])
            given = np.array([radius * np.cos(angle), radius * np.sin(angle), given[2]])
        elif self.kind == "S":
            radius, (polar, angle) = given[0], np.radians(given[1:])
            flat = radius * np.sin(polar)
            given = np.array([flat * np.cos(angle), flat * np.sin(angle), radius * np.cos(polar)])
        return np.asarray(self.origin + self.axes @ given)

    def axes_at(self, position: Array) -> Array:
        """(3, 3) axes (columns) at a point; on the axis of a curved frame those of the frame."""
        x, y, z = self.axes.T @ (position - self.origin)
        flat = float(np.hypot(x, y))
        if self.kind == "R" or flat <= 1e-12 * np.hypot(flat, z):
            return self.axes
        outward, around = np.array([x, y, 0.0]) / flat, np.array([-y, x, 0.0]) / flat
        if self.kind == "C":
            local = np.stack([outward, around, [0.0, 0.0, 1.0]], axis=1)
        else:
            radius = np.hypot(flat, z)
            radial = np.array([x, y, z]) / radius
            local = np.stack([radial, outward * z / radius - np.array([0, 0, flat / radius]), around], axis=1)
        return np.asarray(self.axes @ local)


_BASIC = Frame(np.zeros(3), np.eye(3))


def grid_points(cards: Iterable[Card]) -> GridPoints:
    """Positions and frames that the cards state.

    Raises
    ------
    FEImportError
        ``EXPORT``: a faulty field, a number that stands twice; ``BAD_REFERENCE``: a coordinate system that is
        not there.
    """
    found = list(cards)
    frames = Frames(found)
    result = GridPoints({}, {}, set(), [], frames)
    for card in found:
        if card.name == "GRID":
            _add_grid(card, frames, result)
        elif card.name == "SPOINT":
            result.scalar_points.update(_numbers(card))
        elif card.name == "PLOTEL":
            result.lines.append((card.integer(2), card.integer(3)))
    return result


def _defaults(cards: list[Card]) -> tuple[int, int]:
    """Coordinate systems of grid points that name none: of GRDSET, else the basic one."""
    found = [card for card in cards if card.name == "GRDSET"]
    if len(found) > 1:
        raise found[1].fault("this card stands twice")
    return (found[0].integer(2, 0), found[0].integer(6, 0)) if found else (0, 0)


def _add_grid(card: Card, frames: Frames, points: GridPoints) -> None:
    number = card.integer(1)
    if number in points.positions:
        raise card.fault("this grid point stands twice", number)
    points.positions[number] = frames.of_grid(card)
    frame = card.integer(6, frames.moved)
    if frame:
        points.axes[number] = frames.get(frame, card).axes_at(points.positions[number])


def _numbers(card: Card) -> Iterable[int]:
    if card.field(2).upper() == "THRU":
        first, last = card.integer(1), card.integer(3)
        if not 0 < first <= last < first + 1_000_000:
            raise card.fault("a range must rise, by less than a million", f"{first} THRU {last}")
        return range(first, last + 1)
    return [card.integer(k) for k in range(1, len(card.fields) + 1) if card.field(k)]


class Frames:
    """Coordinate systems by number, each worked out when it is asked for."""

    def __init__(self, cards: list[Card]) -> None:
        self._known: dict[int, Frame] = {0: _BASIC}
        self._cards: dict[int, tuple[Card, int]] = {}  # with the field of its number: a CORD1 may define two
        self._grids = {card.integer(1): card for card in cards if card.name == "GRID"}
        self._open: set[int] = set()
        self._placed, self.moved = _defaults(cards)
        for card in cards:
            for at in (1, 5) if card.name in _BY_GRIDS and card.field(5) else (1,):
                if card.name.startswith("CORD"):
                    number = card.integer(at)
                    if number in self._cards:
                        raise card.fault("this coordinate system stands twice", number)
                    self._cards[number] = card, at

    def of_grid(self, card: Card) -> Array:
        """(3,) position that a GRID states."""
        return self.get(card.integer(2, self._placed), card).position(np.array([card.real(k, 0.0) for k in (3, 4, 5)]))

    def get(self, number: int, user: Card) -> Frame:
        """The coordinate system that a card refers to."""
        if number in self._known:
            return self._known[number]
        if number not in self._cards:
            raise FEImportError(
                Cause.BAD_REFERENCE,
                f"{user.name}: coordinate system {number} is not there",
                where=user.where,
                value=number,
                limit="0, or that of a CORD1R, CORD1C, CORD1S, CORD2R, CORD2C or CORD2S",
                remedy="export the coordinate systems too, or grid points in the basic frame",
            )
        card, at = self._cards[number]
        if number in self._open or len(self._open) > _DEEPEST:
            deep = number not in self._open
            message = "is nested too deeply" if deep else "is defined by itself"
            raise card.fault(f"this coordinate system {message}", number)
        self._open.add(number)
        if card.name in _BY_GRIDS:
            points = [self._grid(card.integer(at + k), card) for k in (1, 2, 3)]
        else:
            reference = self.get(card.integer(2, 0), card)
            points = [reference.position(np.array([card.real(k + j, 0.0) for j in range(3)])) for k in (3, 6, 9)]
        frame = self._known[number] = _by_points(card, *points)
        self._open.discard(number)
        return frame

    def _grid(self, number: int, user: Card) -> Array:
        if number not in self._grids:
            raise user.fault("it needs a grid point that is not there", number)
        return self.of_grid(self._grids[number])


def _by_points(card: Card, a: Array, b: Array, c: Array) -> Frame:
    """Origin A, z axis towards B, xz plane through C."""
    z, side = b - a, c - a
    y = np.cross(z, side)
    if not np.linalg.norm(y) > 1e-9 * np.linalg.norm(z) * np.linalg.norm(side):
        raise card.fault("the three points lie on one line")
    axes = np.stack([np.cross(y, z), y, z], axis=1)
    axes /= np.linalg.norm(axes, axis=0)
    return Frame(a, axes, card.name[-1])
