"""Mesh of an Abaqus or CalculiX deck (.inp) with all its sets.

Read here and not with meshio, which loses generated sets of several lines, sets of sets, surfaces, and all but the
last *NODE block. Names are those of the deck; upper and lower case make no difference between them, as in Abaqus.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fe_import.errors import Cause, FEImportError, shortened
from fe_import.mesh_abaqus_sets import LostSet, SetTable, indices, set_items, surface_nodes
from fe_import.mesh_raw import Block, RawMesh
from fe_import.model import IntArray

_SOLIDS = {
    4: "tetra",
    10: "tetra10",
    8: "hexahedron",
    20: "hexahedron20",
    27: "hexahedron27",
    6: "wedge",
    15: "wedge15",
    5: "pyramid",
}
_FACES = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"}
_LINES = {2: "line", 3: "line3"}
_TYPE = re.compile(r"(C3D|SFM3D|M3D|R3D|STRI|CPS|CPE|CAX|SC|S|T3D|B3)(\d+)")


@dataclass
class _Part:
    """Elements of one type: label -> node labels."""

    shape: str
    dimension: int
    nodes: int
    cells: dict[int, list[int]] = field(default_factory=dict)


@dataclass
class _Deck:
    points: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    parts: dict[str, _Part] = field(default_factory=dict)
    kinds: dict[int, str] = field(default_factory=dict)  # type of each element
    node_sets: SetTable = field(default_factory=SetTable)
    element_sets: SetTable = field(default_factory=SetTable)
    from_elements: list[tuple[str, str]] = field(default_factory=list)  # node set, element set
    surfaces: dict[str, tuple[bool, list[list[str]]]] = field(default_factory=dict)
    instances: int = 0


Rows = list[tuple[int, list[str]]]


def read_abaqus(path: Path, name: str) -> RawMesh:
    """Read a deck.

    Parameters
    ----------
    path : Path
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: a line that is not what its keyword asks for, elements of nodes that are not there, *INCLUDE,
        several instances, one that is moved.
    """
    deck = _Deck()
    for line, keyword, options, rows in _sections(path, name):
        take = _KEYWORDS.get(keyword)
        if take is None:
            continue
        try:
            take(deck, options, rows)
        except KeyError as missing:
            raise _unreadable(name, f"*{keyword} in line {line} lacks {missing.args[0]}") from None
        except ValueError as problem:
            raise _unreadable(name, f"*{keyword} in line {line}: {problem}") from None
    return _mesh(deck, name)


def _unreadable(name: str, message: str) -> FEImportError:
    return FEImportError(
        Cause.NOT_READABLE,
        f"cannot be read as a mesh: {message}",
        where=name,
        remedy="write the mesh as one flat deck with *NODE, *ELEMENT, *NSET, *ELSET and *SURFACE",
    )


def _sections(path: Path, name: str) -> Iterator[tuple[int, str, dict[str, str], Rows]]:
    """Line number, keyword (capitals), options (names in capitals) and data lines of each keyword of a deck."""
    head: tuple[int, str] | None = None
    rows: Rows = []
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            for number, raw in enumerate(file, start=1):
                line = raw.strip()
                if not line or line.startswith("**"):
                    continue
                if head is not None and not rows and head[1].endswith(",") and not line.startswith("*"):
                    head = (head[0], head[1] + line)
                elif line.startswith("*"):
                    if head is not None:
                        yield head[0], *_keyword(head[1]), rows
                    head, rows = (number, line), []
                else:
                    rows.append((number, line.split(",")))
    except OSError as problem:
        raise _unreadable(name, str(problem)) from None
    if head is not None:
        yield head[0], *_keyword(head[1]), rows


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    keyword, *rest = line[1:].split(",")
    pairs = (word.partition("=") for word in rest)
    return " ".join(keyword.upper().split()), {k.strip().upper(): v.strip().strip('"') for k, _, v in pairs}


def _nodes(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    if options.get("SYSTEM", "R").upper() != "R":
        raise ValueError("nodes in cylindrical or spherical coordinates")
    for line, fields in rows:
        try:
            x, y, z = (float(f) if f.strip() else 0.0 for f in (*fields[1:4], "", "", "")[:3])
            label = int(fields[0])
        except ValueError as problem:
            raise _at(line, problem) from None
        if deck.points.setdefault(label, (x, y, z)) != (x, y, z):
            raise ValueError(f"node {label} stands twice, at different places")
    if "NSET" in options:
        deck.node_sets.add(options["NSET"], [int(fields[0]) for _, fields in rows])


def _at(line: int, problem: ValueError) -> ValueError:
    return ValueError(f"line {line} holds what is no number ({shortened(str(problem))})")


def _shape(kind: str) -> tuple[str, int, int]:
    """meshio's name, dimension and number of nodes of an element type; no nodes where it cannot be read.

    Solids of another shape keep their own name, to be named in messages; what is no solid then has none.
    """
    found = _TYPE.match(kind)
    family, count = (found[1], int(found[2])) if found else ("", 0)
    if family == "STRI":
        count = {65: 6}.get(count, count)
    if family in ("C3D", "SC"):
        known = _SOLIDS.get(count, "") if family == "C3D" else ""
        return known or kind, 3, count if known else 0
    table, dimension = (_LINES, 1) if family == "T3D" else (_FACES, 2)
    return ("", 0, 0) if family in ("", "B3") or count not in table else (table[count], dimension, count)


def _elements(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    kind = options["TYPE"].upper()
    part = deck.parts.setdefault(kind, _Part(*_shape(kind)))
    width = part.nodes + 1
    if part.nodes:
        numbers: list[int] = []
        for line, fields in rows:
            try:
                numbers += [int(f) for f in fields if f.strip()]
            except ValueError as problem:
                raise _at(line, problem) from None
        if len(numbers) % width:
            raise ValueError(f"{len(numbers)} numbers are no whole elements of {part.nodes} nodes")
    else:
        numbers = [int(fields[0]) for _, fields in rows if fields[0].strip().isdigit()]
    labels = numbers[::width]
    for k, label in enumerate(labels):
        nodes = numbers[k * width + 1 : (k + 1) * width]
        if part.cells.setdefault(label, nodes) != nodes or deck.kinds.setdefault(label, kind) != kind:
            raise ValueError(f"element {label} stands twice, with different nodes or types")
    if "ELSET" in options:
        deck.element_sets.add(options["ELSET"], labels)


def _node_set(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    items = [i for _, fields in rows for i in set_items(fields, "GENERATE" in options)]
    deck.node_sets.add(options["NSET"], items)
    if "ELSET" in options:
        deck.from_elements.append((options["NSET"], options["ELSET"]))


def _element_set(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    items = [i for _, fields in rows for i in set_items(fields, "GENERATE" in options)]
    deck.element_sets.add(options["ELSET"], items)


def _surface(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    by_nodes = options.get("TYPE", "ELEMENT").upper() == "NODE"
    deck.surfaces[options["NAME"]] = (by_nodes, [fields for _, fields in rows])


def _instance(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    deck.instances += 1
    if deck.instances > 1:
        raise ValueError("several instances; a link is one part")
    if any(float(f or 0.0) for _, fields in rows[:1] for f in map(str.strip, fields)):
        raise ValueError("the instance is moved; write the mesh where it belongs")


def _include(deck: _Deck, options: dict[str, str], rows: Rows) -> None:
    raise ValueError("other files are not followed; join them")


_KEYWORDS: dict[str, Callable[[_Deck, dict[str, str], Rows], None]] = {
    "NODE": _nodes,
    "ELEMENT": _elements,
    "NSET": _node_set,
    "ELSET": _element_set,
    "SURFACE": _surface,
    "INSTANCE": _instance,
    "INCLUDE": _include,
}


def _mesh(deck: _Deck, name: str) -> RawMesh:
    place = {label: k for k, label in enumerate(deck.points)}
    blocks, numbers = [], []
    for part in deck.parts.values():
        if part.shape:
            blocks.append(Block(part.shape, part.dimension, _cells(part, place, name)))
            numbers.append({label: k for k, label in enumerate(part.cells)})
    mesh = RawMesh(np.array(list(deck.points.values()), dtype=float).reshape(-1, 3), blocks)
    cells = {label: nodes for part in deck.parts.values() for label, nodes in part.cells.items()}
    for key, shown in deck.element_sets.names.items():
        try:
            members = deck.element_sets.members(key)
            indices(members - deck.kinds.keys(), {}, "element")
            mesh.cell_sets[shown] = [
                np.array(sorted(own[label] for label in members & own.keys()), dtype=np.int64) for own in numbers
            ]
        except LostSet as reason:
            mesh.lost[shown] = str(reason)
    for target, source in deck.from_elements:
        try:
            corners = {node for e in deck.element_sets.members(source) for node in cells.get(e, ())}
            deck.node_sets.add(target, sorted(corners))
        except LostSet as reason:
            deck.node_sets.drop(target)
            mesh.lost[target] = str(reason)
    for key, shown in deck.node_sets.names.items():
        try:
            mesh.point_sets[shown] = indices(deck.node_sets.members(key), place, "node")
        except LostSet as reason:
            mesh.lost[shown] = str(reason)
    for shown, (by_nodes, rows) in deck.surfaces.items():
        try:
            members = surface_nodes(rows, deck.element_sets, cells, deck.node_sets, by_nodes)
            found = indices(members, place, "node")
        except LostSet as reason:
            mesh.lost.setdefault(shown, str(reason))
            continue
        if not np.array_equal(mesh.point_sets.setdefault(shown, found), found):
            mesh.lost[shown] = "a node set and a surface with other nodes have this name"
            del mesh.point_sets[shown]
    return mesh


def _cells(part: _Part, place: dict[int, int], name: str) -> IntArray:
    try:
        rows = [[place[node] for node in nodes] for nodes in part.cells.values()]
    except KeyError as missing:
        raise _unreadable(name, f"an element needs node {missing}, which the deck does not define") from None
    return np.array(rows, dtype=np.int64).reshape(len(rows), part.nodes)
