"""Axes in which a deck gives the components of nodes: *TRANSFORM."""

from __future__ import annotations

import numpy as np

from fe_import.abaqus.deck import Deck, Statement
from fe_import.abaqus.statements import Unused, numbers, only, option
from fe_import.model import Array

_SAME = 1e-9  # sine of the angle between two directions


def node_axes(deck: Deck) -> dict[int, Array]:
    """(3, 3) axes (columns) of the components of the nodes that a *TRANSFORM names; the last one holds.

    Raises
    ------
    Unused
        What is not followed.
    """
    result: dict[int, Array] = {}
    for statement in deck.statements:
        if statement.name == "TRANSFORM":
            only(statement, "NSET", "TYPE")
            place = deck.placement(statement)
            for node in deck.node_sets.members(option(statement, "NSET")):
                if node in deck.points:
                    own = _axes(statement, place.in_part(np.array(deck.points[node])))
                    result[node] = np.asarray(place.rotation @ own)
    return result


def along_axes(node: int, component: int, factor: float, axes: dict[int, Array]) -> list[tuple[int, int, float]]:
    """Terms in mesh axes of a component (0 ... 5) of a node."""
    if node not in axes:
        return [(node, component, factor)]
    turning = 3 * (component // 3)
    return [(node, turning + k, factor * float(s)) for k, s in enumerate(axes[node][:, component % 3]) if s]


def _axes(statement: Statement, position: Array) -> Array:
    kind = statement.options.get("TYPE", "R").upper()
    given = numbers(statement.rows[0]) if statement.rows else []
    if len(given) != 6 or kind not in ("R", "C"):
        raise Unused("a *TRANSFORM needs six numbers, and is rectangular or cylindrical")
    first, second = np.array(given[:3]), np.array(given[3:])
    return rectangular(first, second) if kind == "R" else cylindrical(first, second, position)


def cylindrical(first: Array, second: Array, position: Array) -> Array:
    """(3, 3) axes (columns) at a point: outward from the line through two points, around it, along it.

    Raises
    ------
    Unused
        A point on the line, or a line of one point.
    """
    along, outward = second - first, position - first
    share = float(along @ outward) / max(float(along @ along), 1e-300)
    return rectangular(outward - share * along, np.cross(along, outward))


def rectangular(first: Array, second: Array) -> Array:
    """(3, 3) axes (columns): the first along a direction, the second in the plane of both.

    Raises
    ------
    Unused
        Directions that are parallel, or none.
    """
    third = np.cross(first, second)
    if not np.linalg.norm(third) > _SAME * np.linalg.norm(first) * np.linalg.norm(second):
        raise Unused("a system of directions that are parallel")
    axes = np.stack([first, np.cross(third, first), third], axis=1)
    return np.asarray(axes / np.linalg.norm(axes, axis=0))
