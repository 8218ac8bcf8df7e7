"""Nodes, elements and node sets of an input deck (``.inp``) of CalculiX or Abaqus.

meshio loses sets made of other sets and generated ones, so the deck is read here. Only what says where nodes are is
read; the names of all other keywords are kept, because some change the matrices.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fe_import.errors import Cause, FEImportError, shortened
from fe_import.exports.inp_elements import node_count
from fe_import.exports.text_file import TextFile
from fe_import.model import Array, IntArray

_MOST_MEMBERS = 20_000_000  # of generated sets and of sets within sets, together
_ELSEWHERE = {
    "INCLUDE": "name the file that holds the nodes as the mesh, or join the files into one",
    "PART": "write a flat deck without parts and assemblies",
    "INSTANCE": "write a flat deck without parts and assemblies",
}
_INTEGER = re.compile(r"[+-]?\d{1,18}\Z")


@dataclass(frozen=True)
class InpMesh:
    """What a deck says about its mesh.

    Attributes
    ----------
    nodes : (n, 3) array
    labels : (n,) int array
        Their numbers in the deck.
    elements : dict of (m, k) int arrays
        Type -> indices of the nodes of its elements.
    node_sets : dict of int arrays
        Name (capitals, as the programs read it) -> indices of nodes, rising.
    keywords : Counter of str
        All keywords, in capitals.
    unread : Counter of str
        Element types whose number of nodes is not known; these elements are left out.
    source : str
    """

    nodes: Array
    labels: IntArray
    elements: dict[str, IntArray]
    node_sets: dict[str, IntArray]
    keywords: Counter[str]
    unread: Counter[str]
    source: str

    def element_nodes(self) -> IntArray:
        """Nodes that belong to an element, rising."""
        parts = [np.unique(e) for e in self.elements.values()]
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *parts]))


@dataclass
class _Deck:
    """What has been read so far."""

    positions: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[str, list[list[int]]] = field(default_factory=dict)
    element_nodes: dict[int, list[int]] = field(default_factory=dict)
    node_sets: dict[str, set[int]] = field(default_factory=dict)
    element_sets: dict[str, set[int]] = field(default_factory=dict)
    keywords: Counter[str] = field(default_factory=Counter)
    unread: Counter[str] = field(default_factory=Counter)
    spent: int = 0

    def spend(self, members: int, reader: _Reader) -> None:
        """Refuse a deck whose few lines make sets that fill the memory."""
        self.spent += members
        if self.spent > _MOST_MEMBERS:
            raise reader.fault(f"sets of more than {_MOST_MEMBERS} members", remedy="keep those that a link needs")


def read_inp(path: Path) -> InpMesh:
    """Read a deck, plain or gzip.

    Raises
    ------
    FEImportError
        ``EXPORT``: faulty numbers, a node or element that stands twice, elements or sets of what is not there,
        *INCLUDE, *PART.
    """
    deck = _Deck()
    with TextFile(path) as file:
        reader = _Reader(file)
        while (keyword := reader.keyword()) is not None:
            name, options = keyword
            deck.keywords[name] += 1
            if name in _ELSEWHERE:
                raise reader.fault(f"*{name} is not followed", remedy=_ELSEWHERE[name])
            if name == "NODE":
                _read_nodes(reader, options, deck)
            elif name == "ELEMENT":
                _read_elements(reader, options, deck)
            elif name in ("NSET", "ELSET"):
                _read_set(reader, name, options, deck)
    return _mesh(deck, str(path))


class _Reader:
    """Keyword lines and data lines of a deck; comments (``**``) and blank lines left out."""

    def __init__(self, file: TextFile) -> None:
        self.file, self._line = file, 0
        self._waiting, self._at = self._next()

    def _next(self) -> tuple[str | None, int]:
        while (line := self.file.line()) is not None:
            line = line.strip()
            if line and not line.startswith("**"):
                return line, self.file.number
        return None, self.file.number

    def _take(self) -> str:
        line, self._line = self._waiting or "", self._at
        self._waiting, self._at = self._next()
        return line

    def data(self) -> list[str] | None:
        """Fields of the next data line, None before the next keyword or at the end."""
        if self._waiting is None or self._waiting.startswith("*"):
            return None
        fields = [f.strip() for f in self._take().split(",")]
        return fields[:-1] if len(fields) > 1 and not fields[-1] else fields

    def keyword(self) -> tuple[str, dict[str, str]] | None:
        """Name and options (capitals) of the next keyword; data lines before it are skipped."""
        while self.data() is not None:
            pass
        if self._waiting is None:
            return None
        line = self._take()
        while line.endswith(",") and self._waiting is not None and not self._waiting.startswith("*"):
            line += self._take()
        name, *fields = line[1:].split(",")
        options = {}
        for given in fields:
            key, _, value = given.partition("=")
            options["".join(key.split()).upper()] = value.strip().strip('"').upper()
        return " ".join(name.split()).upper(), options

    def fault(self, message: str, value: str | None = None, remedy: str = "write the deck again") -> FEImportError:
        """An error at the line that was read last."""
        return self.file.failure(message, line=self._line, value=value, remedy=remedy)

    def integer(self, text: str) -> int:
        """A whole number."""
        if not _INTEGER.match(text):
            raise self.fault("expected a whole number", shortened(text))
        return int(text)

    def real(self, text: str) -> float:
        """A finite number, 0 for an empty field."""
        try:
            value = float(text.upper().replace("D", "E") or 0.0)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or "_" in text:
            raise self.fault("expected a finite number", shortened(text))
        return value


def _read_nodes(reader: _Reader, options: dict[str, str], deck: _Deck) -> None:
    if options.get("SYSTEM", "R") != "R":
        raise reader.fault("*NODE in other than rectangular coordinates", options["SYSTEM"], "write them in x, y, z")
    members = deck.node_sets.setdefault(options["NSET"], set()) if "NSET" in options else None
    while (fields := reader.data()) is not None:
        label = reader.integer(fields[0])
        position = tuple(reader.real(f) for f in (*fields[1:4], "", "", "")[:3])
        if deck.positions.setdefault(label, position) != position:
            raise reader.fault("this node stands twice, at different positions", str(label))
        if members is not None:
            members.add(label)


def _read_elements(reader: _Reader, options: dict[str, str], deck: _Deck) -> None:
    kind = options.get("TYPE", "")
    if (count := node_count(kind)) is None:
        deck.unread[kind] += 1
        return
    rows = deck.elements.setdefault(kind, [])
    while (fields := reader.data()) is not None:
        while len(fields) < count + 1 and (more := reader.data()) is not None:
            fields += more
        if len(fields) != count + 1:
            raise reader.fault(f"an element of type {kind} has {count} nodes", f"{len(fields) - 1} nodes")
        label, *nodes = map(reader.integer, fields)
        if deck.element_nodes.setdefault(label, nodes) is not nodes:
            raise reader.fault("this element stands twice", str(label))
        rows.append(nodes)
        if "ELSET" in options:
            deck.element_sets.setdefault(options["ELSET"], set()).add(label)


def _read_set(reader: _Reader, keyword: str, options: dict[str, str], deck: _Deck) -> None:
    sets = deck.node_sets if keyword == "NSET" else deck.element_sets
    if keyword not in options:
        raise reader.fault(f"*{keyword} without {keyword}=NAME")
    members = sets.setdefault(options[keyword], set())
    if keyword == "NSET" and "ELSET" in options:
        chosen = _known(options["ELSET"], deck.element_sets, reader)
        members.update(node for e in chosen for node in deck.element_nodes.get(e, ()))
    while (fields := reader.data()) is not None:
        if "GENERATE" in options:
            first, last, *step = map(reader.integer, (*fields, "0")[: max(len(fields), 2)])
            found = range(first, last + 1, max(step[0], 1) if step else 1)
            deck.spend(len(found), reader)
            members.update(found)
            continue
        for text in filter(None, fields):
            if _INTEGER.match(text):
                members.add(int(text))
            else:
                others = _known(text.strip('"').upper(), sets, reader)
                deck.spend(len(others), reader)
                members |= others


def _known(name: str, sets: dict[str, set[int]], reader: _Reader) -> set[int]:
    if name not in sets:
        raise reader.fault("no set of this name stands above this line", shortened(name), "define it first")
    return sets[name]


def _mesh(deck: _Deck, where: str) -> InpMesh:
    if not deck.positions:
        raise FEImportError(Cause.EXPORT, "no nodes in this deck", where=where, remedy="name the file with *NODE")
    labels = np.fromiter(deck.positions, dtype=np.int64)
    labels.sort()
    place = {int(label): k for k, label in enumerate(labels)}
    nodes = np.array([deck.positions[int(label)] for label in labels])

    def indices(numbers: set[int] | list[int], what: str) -> list[int]:
        missing = next((n for n in numbers if n not in place), None)
        if missing is not None:
            raise FEImportError(
                Cause.EXPORT,
                f"{what} names a node that is not in the deck",
                where=where,
                value=missing,
                remedy="name the file that holds all nodes",
            )
        return [place[n] for n in numbers]

    elements = {
        kind: np.array([indices(row, f"an element of type {kind}") for row in rows], dtype=np.int64)
        for kind, rows in deck.elements.items()
        if rows
    }
    node_sets = {
        name: np.array(sorted(indices(members, f"set {name!r}")), dtype=np.int64)
        for name, members in deck.node_sets.items()
    }
    return InpMesh(nodes, labels, elements, node_sets, deck.keywords, deck.unread, where)
