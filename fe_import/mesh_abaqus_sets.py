"""Sets of an Abaqus or CalculiX deck: generated ones, sets of sets, surfaces, in any order and any case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_import.model import IntArray

MOST_MEMBERS = 20_000_000  # of generated sets, together; a deck of a few lines must not fill the memory
Item = int | range | str  # a label, labels, or the name of another set

# corners of face S1, S2 ... of an element of that many corners, in the deck's (meshio's) order
_FACES = {
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
}
_CORNERS = {4: 4, 10: 4, 8: 8, 20: 8, 27: 8}


class LostSet(Exception):
    """Why a set cannot be followed."""


@dataclass
class SetTable:
    """Named sets as a deck states them; a name may stand several times, its members add up.

    Attributes
    ----------
    names : dict
        Name in capitals -> as first written.
    items : dict
        Name in capitals -> what it holds.
    """

    names: dict[str, str] = field(default_factory=dict)
    items: dict[str, list[Item]] = field(default_factory=dict)
    generated: int = 0

    def add(self, name: str, items: Sequence[Item]) -> None:
        """Add members to a set."""
        key = name.upper()
        self.names.setdefault(key, name)
        self.items.setdefault(key, []).extend(items)
        self.generated += sum(len(i) for i in items if isinstance(i, range))
        if self.generated > MOST_MEMBERS:
            raise ValueError(f"sets of more than {MOST_MEMBERS} members")

    def drop(self, name: str) -> None:
        """Forget a set."""
        self.names.pop(name.upper(), None)
        self.items.pop(name.upper(), None)

    def members(self, name: str, above: tuple[str, ...] = ()) -> set[int]:
        """Labels of a set, other sets followed.

        Raises
        ------
        LostSet
            A set that does not exist, or that holds itself.
        """
        key = name.upper()
        if key not in self.items:
            raise LostSet(f"it needs set {name!r}, which the deck does not define")
        if key in above:
            raise LostSet(f"set {name!r} holds itself")
        found: set[int] = set()
        for item in self.items[key]:
            if isinstance(item, str):
                found |= self.members(item, (*above, key))
            else:
                found.update([item] if isinstance(item, int) else item)
        return found


def set_items(fields: list[str], generate: bool) -> list[Item]:
    """What a data line of *NSET or *ELSET holds; an instance's name before a label is dropped."""
    words = [f.strip().strip('"') for f in fields if f.strip()]
    if generate and words:
        first, last, step = (int(w) for w in (*words, "1")[:3])
        if step < 1:
            raise ValueError(f"a step of {step} in a generated set")
        return [range(first, last + 1, step)]
    return [int(tail) if (tail := w.rpartition(".")[2]).isdigit() else w for w in words]


def surface_nodes(
    rows: list[list[str]], elements: SetTable, connectivity: dict[int, list[int]], node_sets: SetTable, by_nodes: bool
) -> set[int]:
    """Labels of the nodes of a *SURFACE: rows of (element or set, face) or of (node or set).

    Raises
    ------
    LostSet
        Sets or elements that do not exist, faces of other elements than solids, free surfaces without a face.
    """
    found: set[int] = set()
    for row in rows:
        (item,) = set_items(row[:1], generate=False) or [""]
        table = node_sets if by_nodes else elements
        labels = table.members(item) if isinstance(item, str) else {item} if isinstance(item, int) else set(item)
        if by_nodes:
            found |= labels
            continue
        face = row[1].strip().upper() if len(row) > 1 else ""
        for label in labels:
            if label not in connectivity:
                raise LostSet(f"it needs element {label}, which the deck does not define")
            found.update(_face_nodes(connectivity[label], face))
    return found


def _face_nodes(nodes: list[int], face: str) -> list[int]:
    if face in ("SPOS", "SNEG"):
        return nodes
    corners = _CORNERS.get(len(nodes))
    if corners is None or not face.startswith("S") or not face[1:].isdigit():
        raise LostSet(f"face {face or 'of the free surface'!r} of an element of {len(nodes)} nodes is not followed")
    number = int(face[1:])
    if not 1 <= number <= len(_FACES[corners]):
        raise LostSet(f"elements of {corners} corners have no face {face}")
    chosen = set(_FACES[corners][number - 1])
    # a mid-side node belongs to the face when both corners of its edge do
    edges = _HEX_EDGES if corners == 8 else _TET_EDGES
    inside = [k for k, edge in enumerate(edges, start=corners) if k < len(nodes) and chosen.issuperset(edge)]
    return [nodes[k] for k in (*sorted(chosen), *inside)]


_TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (3, 0)),
    *((4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)


def indices(labels: set[int], place: dict[int, int], what: str) -> IntArray:
    """Positions of labels, rising.

    Raises
    ------
    LostSet
        A label that the deck does not define.
    """
    missing = next((label for label in sorted(labels) if label not in place), None)
    if missing is not None:
        raise LostSet(f"it names {what} {missing}, which the deck does not define")
    return np.array(sorted(place[label] for label in labels), dtype=np.int64)
