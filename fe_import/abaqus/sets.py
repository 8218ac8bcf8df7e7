"""Sets of an Abaqus or CalculiX deck: generated ones, sets of sets, surfaces, in any order and any case."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_import.abaqus.elements import face_nodes, solid_type
from fe_import.model import IntArray

MOST_MEMBERS = 20_000_000  # of generated sets, together; a deck of a few lines must not fill the memory
_MOST_FOLLOWED = 5 * MOST_MEMBERS  # of all sets when they are followed


@dataclass(frozen=True)
class NodesOf:
    """The nodes of the elements of a set."""

    element_set: str


Item = int | range | str | NodesOf  # a label, labels, the name of another set
_LABEL = re.compile(r"(?:[A-Za-z_][^=*]*\.)?(\d{1,18})\Z")
_NAME = re.compile(r"[A-Za-z_][^=*]*\Z")


class LostSet(Exception):
    """Why a set cannot be followed."""


@dataclass
class SetTable:
    """Named sets as a deck states them; a name may stand several times, its members add up.

    Attributes
    ----------
    nodes_of : callable
        Nodes of the elements of a set, for node sets made of them.
    names : dict
        Name in capitals -> as first written.
    items : dict
        Name in capitals -> what it holds.
    """

    nodes_of: Callable[[str], set[int]] | None = None
    names: dict[str, str] = field(default_factory=dict)
    items: dict[str, list[Item]] = field(default_factory=dict)
    generated: int = 0
    followed: int = 0
    _found: dict[str, IntArray] = field(default_factory=dict)

    def add(self, name: str, items: Sequence[Item]) -> None:
        """Add members to a set.

        Raises
        ------
        ValueError
            Generated sets with more members than memory should hold.
        """
        key = name.upper()
        self._found.clear()
        self.names.setdefault(key, name)
        self.items.setdefault(key, []).extend(items)
        self.generated += sum(len(i) for i in items if isinstance(i, range))
        if self.generated > MOST_MEMBERS:
            raise ValueError(f"sets of more than {MOST_MEMBERS} members")

    def members(self, name: str) -> set[int]:
        """Labels of a set, other sets followed.

        Raises
        ------
        LostSet
            A set that does not exist, that holds itself, or that has too many members together with others.
        """
        for key in self._within(name):
            self._found[key] = self._joined(key)
        return set(self._found[name.upper()].tolist())

    def _joined(self, key: str) -> IntArray:
        """Members of a set, rising; the sets that it is made of are known."""
        items = self.items[key]
        parts = [self._found[k] for k in {i.upper() for i in items if isinstance(i, str)}]
        parts += [np.arange(i.start, i.stop, i.step, dtype=np.int64) for i in items if isinstance(i, range)]
        if self.nodes_of is not None:
            asked = [i.element_set for i in items if isinstance(i, NodesOf)]
            parts += [np.array([*self.nodes_of(name)], dtype=np.int64) for name in asked]
        parts.append(np.array([i for i in items if isinstance(i, int)], dtype=np.int64))
        found = np.unique(np.concatenate(parts))
        self.followed += len(found)
        if self.followed > _MOST_FOLLOWED:
            raise LostSet(f"all sets together have more than {_MOST_FOLLOWED} members")
        return found

    def _within(self, name: str) -> list[str]:
        """The set and all that it is made of, each once, parts first, without those found already.

        Without recursion, as decks may nest them deeply.
        """
        done: list[str] = []
        known: set[str] = set()
        open_: list[tuple[str, Iterator[str]]] = []
        above: set[str] = set()
        waiting = [name]
        while True:
            if waiting:
                asked = waiting.pop()
                key = asked.upper()
                if key in above:
                    raise LostSet(f"set {asked!r} holds itself")
                if key not in self.items:
                    raise LostSet(f"it needs set {asked!r}, which the deck does not define")
                if key not in known and key not in self._found:
                    known.add(key)
                    above.add(key)
                    open_.append((key, iter([i for i in self.items[key] if isinstance(i, str)])))
            if not open_:
                return done
            key, rest = open_[-1]
            following = next(rest, None)
            if following is not None:
                waiting.append(following)
            else:
                open_.pop()
                above.discard(key)
                done.append(key)


def set_items(fields: list[str], generate: bool) -> list[Item]:
    """What a data line of *NSET or *ELSET holds; an instance's name before a label is dropped.

    Raises
    ------
    ValueError
        What is neither a label nor a name.
    """
    words = [f for f in fields if f]
    if generate and words:
        if not 2 <= len(words) <= 3 or not all(w.isascii() and w.lstrip("+-").isdigit() and len(w) < 19 for w in words):
            raise ValueError("a generated set needs first, last and step")
        first, last, step = (int(w) for w in (*words, "1")[:3])
        if step < 1:
            raise ValueError(f"a step of {step} in a generated set")
        return [range(first, last + 1, step)]
    return [_item(w) for w in words]


def _item(word: str) -> Item:
    if len(word) > 1 and word[0] == word[-1] == '"':
        return word[1:-1]
    if label := _LABEL.match(word):
        return int(label[1])
    if _NAME.match(word):
        return word
    raise ValueError(f"{word!r} is neither a number nor the name of a set")


def surface_nodes(
    rows: list[list[str]],
    elements: SetTable,
    connectivity: dict[int, tuple[str, list[int]]],
    node_sets: SetTable,
    by_nodes: bool,
) -> set[int]:
    """Labels of the nodes of a *SURFACE: rows of (element or set, face) or of (node or set).

    ``connectivity`` holds type and nodes of each element.

    Raises
    ------
    LostSet
        Sets or elements that do not exist, faces of other elements than solids, free surfaces without a face.
    """
    if not by_nodes:
        faces = surface_faces(rows, elements, connectivity)
        return {node for _, nodes in faces for node in nodes}
    found: set[int] = set()
    for row in rows:
        item = _first(row)
        found |= {item} if isinstance(item, int) else node_sets.members(str(item))
    return found


def surface_faces(
    rows: list[list[str]], elements: SetTable, connectivity: dict[int, tuple[str, list[int]]]
) -> Iterator[tuple[str, list[int]]]:
    """Type of the element and nodes, corners first, of each face of a *SURFACE of elements; see `surface_nodes`."""
    for row in rows:
        item = _first(row)
        face = row[1].upper() if len(row) > 1 else ""
        for label in sorted({item} if isinstance(item, int) else elements.members(str(item))):
            if label not in connectivity:
                raise LostSet(f"it needs element {label}, which the deck does not define")
            kind, nodes = connectivity[label]
            yield kind, _face_nodes(kind, nodes, face)


def _first(row: list[str]) -> Item:
    try:
        (item,) = set_items(row[:1], generate=False) or [""]
    except ValueError as problem:
        raise LostSet(str(problem)) from None
    return item


def _face_nodes(kind: str, nodes: list[int], face: str) -> list[int]:
    if face in ("SPOS", "SNEG"):
        return nodes
    if solid_type(kind) is None or not face.startswith("S") or not face[1:].isdigit():
        raise LostSet(f"face {face or 'of the free surface'!r} of an element of type {kind} is not followed")
    places = face_nodes(kind, int(face[1:]))
    if not places:
        raise LostSet(f"elements of type {kind} have no face {face}")
    return [nodes[k] for k in places]


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
