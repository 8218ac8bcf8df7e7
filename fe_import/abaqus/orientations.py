"""Orientations of materials in a deck: *ORIENTATION, rectangular and cylindrical, turned about one of their axes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fe_import.abaqus.deck import Deck, Statement
from fe_import.abaqus.statements import Unused, numbers, only
from fe_import.abaqus.transforms import cylindrical, rectangular
from fe_import.model import Array


def orientation(deck: Deck, name: str) -> Callable[[Array], Array]:
    """(e, 3, 3) axes (columns) at points (e, 3).

    Raises
    ------
    Unused
        It is not there, or not followed.
    """
    stated = [s for s in deck.statements if s.name == "ORIENTATION"]
    found = [s for s in stated if s.options.get("NAME", "").upper() == name.upper()]
    if len(found) != 1:
        raise Unused(f"orientation {name} is " + ("there twice" if found else "not there"))
    statement = found[0]
    only(statement, "NAME", "SYSTEM", "DEFINITION")
    system = statement.options.get("SYSTEM", "RECTANGULAR").upper()
    if statement.options.get("DEFINITION", "COORDINATES").upper() != "COORDINATES":
        raise Unused(f"orientation {name} is not given by coordinates")
    given = numbers(statement.rows[0]) if statement.rows else []
    if system not in ("RECTANGULAR", "CYLINDRICAL") or len(given) not in (6, 9):
        raise Unused(f"orientation {name} is neither rectangular nor cylindrical, by two points or three")
    first, second, origin = np.array(given[:3]), np.array(given[3:6]), np.array([*given[6:], 0.0, 0.0, 0.0][:3])
    turn = _turn(statement)
    place = deck.placement(statement)
    if system == "RECTANGULAR":
        axes = place.rotation @ rectangular(first - origin, second - origin) @ turn
        return lambda points: np.tile(axes, (len(points), 1, 1))
    if not (second - first).any():
        raise Unused(f"orientation {name} has an axis of two points in one place")

    def around(points: Array) -> Array:
        own = np.stack([cylindrical(first, second, point) for point in place.in_part(points)])
        return np.asarray(place.rotation @ own @ turn)

    return around


def _turn(statement: Statement) -> Array:
    """(3, 3) additional rotation about an axis, by degrees."""
    given = numbers(statement.rows[1]) if len(statement.rows) > 1 else [1.0, 0.0]
    axis, angle = (*given, 0.0)[:2]
    if axis not in (1.0, 2.0, 3.0):
        raise Unused("the additional rotation of an orientation is about axis 1, 2 or 3")
    one, two = int(axis) % 3, (int(axis) + 1) % 3
    result = np.eye(3)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    result[[one, two], [one, two]] = c
    result[two, one], result[one, two] = s, -s
    return result
