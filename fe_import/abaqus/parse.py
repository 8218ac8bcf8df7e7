"""Decks (.inp) of Abaqus and CalculiX: keywords, nodes, elements, sets, surfaces. One reader for meshes and exports.

Read here and not with meshio, which loses generated sets of several lines, sets of sets, surfaces, and all but the
last *NODE block. Only what says where nodes are is read; the names of all other keywords are kept, because some change
the matrices. Upper and lower case make no difference, as in these programs.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fe_import.abaqus.deck import Deck, Placement, Statement
from fe_import.abaqus.elements import element_type, in_mesh_order
from fe_import.abaqus.instances import put_together
from fe_import.abaqus.keywords import canonical
from fe_import.abaqus.lines import DeckReader
from fe_import.abaqus.sets import Item, NodesOf, set_items
from fe_import.errors import Cause, shortened
from fe_import.files.text import TextFile

_ELSEWHERE = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY")  # make or move nodes and elements
_ENDED = ("STEP", "PART", "ASSEMBLY", "INSTANCE")
_LARGEST_LABEL = 999_999_999
_OF_INSTANCE = re.compile(r"([A-Za-z_][^=*]*)\.(\d{1,9})\Z")


STATEMENTS = (
    *("MATERIAL", "ELASTIC", "DENSITY", "MASS", "ROTARY INERTIA", "SPRING", "BEAM SECTION", "BEAM GENERAL SECTION"),
    *("EQUATION", "MPC", "RIGID BODY", "COUPLING", "KINEMATIC", "DISTRIBUTING", "TIE", "TRANSFORM", "ORIENTATION"),
    *("NONSTRUCTURAL MASS", "SHELL SECTION"),
)


def read_deck(path: Path, where: str, cause: Cause) -> Deck:
    """Read a deck, plain or gzip.

    Parameters
    ----------
    path : Path
    where : str
        To name in messages; the names of included files start at its folder.
    cause : Cause
        Of a faulty deck.

    Raises
    ------
    FEImportError
        Of that cause: numbers that are none, a node or element that stands twice, elements of nodes that are not
        there, parameters that are not known, an end that is missing, what would have to be looked up elsewhere.
    """
    deck = own = Deck()
    with TextFile(path, where, cause) as file, contextlib.closing(DeckReader(file, Path(where))) as reader:
        while (keyword := reader.keyword()) is not None:
            name, options = canonical(keyword[0]), keyword[1]
            deck.keywords[name] += 1
            deck.places.setdefault(name, reader.place)
            if name in _ELSEWHERE:
                raise reader.fault(f"*{name} is not followed", remedy="write all nodes and elements out")
            try:
                if name in ("PART", "INSTANCE"):
                    own = (_part if name == "PART" else _instance)(reader, options, deck)
                elif name in ("END PART", "END INSTANCE"):
                    own = deck
                elif name in _KEYWORDS:
                    _KEYWORDS[name](reader, reader.known(name, options), own)
                elif name in STATEMENTS:
                    _statement(reader, name, options, own)
            except ValueError as problem:
                raise reader.fault(f"*{name}: {problem}") from None
            for kind in own.types.keys() - deck.places.keys():
                deck.places[kind] = reader.place
        for name in _ENDED:
            if deck.keywords[name] > deck.keywords[f"END {name}"]:
                raise reader.fault(f"*{name} without *END {name}: the deck is cut off")
        try:
            deck = put_together(deck)
        except ValueError as problem:
            raise file.failure(str(problem), remedy="write one flat deck") from None
        _check_elements(deck, file)
    return deck


def _named(options: dict[str, str], name: str) -> str:
    if not options.get(name):
        raise ValueError(f"lacks {name}")
    return options[name]


def _nodes(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    kind = options.get("SYSTEM", "R").upper()
    if kind not in ("R", "C"):
        raise ValueError("nodes in spherical coordinates")
    labels: list[int] = []
    while (fields := reader.data()) is not None:
        if not 2 <= len(fields) <= 7:  # with the direction of a normal; zeros at the end may be left out
            raise reader.fault("expected a node and three coordinates", shortened(", ".join(fields)))
        label = reader.integer(fields[0])
        if not 0 < label <= _LARGEST_LABEL:
            raise reader.fault("the number of a node is out of range", str(label))
        position = _placed(kind, [reader.real(f) for f in (*fields[1:4], "", "", "")[:3]], deck.system)
        if deck.points.setdefault(label, position) != position:
            raise reader.fault(f"node {label} stands twice, at different positions")
        if any(map(reader.real, fields[4:])):
            deck.normals.add(label)
        labels.append(label)
    if options.get("NSET"):
        deck.node_sets.add(options["NSET"], labels)


def _elements(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    kind = _named(options, "TYPE").upper()
    deck.types[kind] = known = element_type(kind)
    cells = deck.elements.setdefault(kind, {})
    labels: list[int] = []
    while (fields := reader.data()) is not None:
        while len(fields) < known.nodes + 1 and (more := reader.data()) is not None:
            fields += more
        if not known.nodes:
            fields = fields[:1] if fields[0].isascii() and fields[0].isdigit() else []
        elif not 0 <= len(fields) - known.nodes - 1 <= known.spare:
            raise reader.fault(f"an element of type {kind} has {known.nodes} nodes", f"{len(fields) - 1} nodes")
        if not fields:
            continue
        label, *nodes = (reader.integer(fields[0]), *(_node(reader, f, deck) for f in fields[1:]))
        if known.dimension == 1 and len(nodes) > known.nodes:
            deck.orientation_nodes[label] = nodes[-1]
        nodes = nodes[: known.nodes]
        if known.nodes == 27:
            nodes = in_mesh_order(nodes)
        if deck.kinds.setdefault(label, kind) != kind or cells.setdefault(label, nodes) != nodes:
            raise reader.fault(f"element {label} stands twice, with different nodes or types")
        labels.append(label)
    if options.get("ELSET"):
        deck.element_sets.add(options["ELSET"], labels)


def _node_set(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    items = _items(reader, options, deck)
    if "ELSET" in options:
        own = NodesOf(_named(options, "ELSET"))
        items.append(deck.coded(options["INSTANCE"], own) if options.get("INSTANCE") else own)
    deck.node_sets.add(_named(options, "NSET"), items)


def _element_set(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    deck.element_sets.add(_named(options, "ELSET"), _items(reader, options, deck))


def _items(reader: DeckReader, options: dict[str, str], deck: Deck) -> list[Item]:
    items: list[Item] = []
    instance = options.get("INSTANCE", "")
    while (fields := reader.data()) is not None:
        found = [_OF_INSTANCE.match(f) for f in fields]
        items += [deck.coded(m[1], int(m[2])) for m in found if m]
        plain = set_items([f for f, m in zip(fields, found, strict=True) if not m], "GENERATE" in options)
        items += [deck.coded(instance, item) for item in plain] if instance else plain
    return items


def _node(reader: DeckReader, text: str, deck: Deck) -> int:
    """Label of a node, which may be of an instance."""
    match = _OF_INSTANCE.match(text)
    if match is None:
        return reader.integer(text)
    found = deck.coded(match[1], int(match[2]))
    assert isinstance(found, int)
    return found


def _placed(kind: str, given: list[float], system: Placement) -> tuple[float, ...]:
    """Position of a point in rectangular or cylindrical (degrees) coordinates of a system."""
    x, y, z = given
    if kind == "C":
        x, y = x * math.cos(math.radians(y)), x * math.sin(math.radians(y))
    if not system.turned and not system.translation.any():
        return x, y, z
    return tuple(system.moved(np.array([x, y, z])).tolist())


def _system(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    rows: list[list[float]] = []
    while (fields := reader.data()) is not None:
        rows.append([reader.real(f) for f in fields])
    if not rows:
        deck.system = Placement()
        return
    given = [*rows[0], *[0.0] * 6][:6]
    origin, first = np.array(given[:3]), np.array(given[3:])
    second = np.array([*rows[1], 0.0, 0.0, 0.0][:3]) if len(rows) > 1 else None
    along = first - origin
    if second is None:
        if len(rows[0]) <= 3:  # shifted only
            deck.system = Placement(origin)
            return
        if along[2]:
            raise ValueError("a system that is turned needs a third point")
        second = origin + np.array([-along[1], along[0], 0.0])
    across = np.cross(along, second - origin)
    if not np.linalg.norm(across) > 1e-9 * np.linalg.norm(along) * np.linalg.norm(second - origin):
        raise ValueError("the three points of a system lie on one line")
    axes = np.stack([along, np.cross(across, along), across], axis=1)
    deck.system = Placement(origin, axes / np.linalg.norm(axes, axis=0))


def _surface(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    rows = []
    while (fields := reader.data()) is not None:
        rows.append(fields)
    deck.surfaces[_named(options, "NAME")] = (options.get("TYPE", "ELEMENT").upper() == "NODE", rows)


def _solid_section(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    _named(options, "ELSET")
    deck.solid_sections.append(options)


def _statement(reader: DeckReader, name: str, options: dict[str, str], deck: Deck) -> None:
    rows = []
    while (fields := reader.data()) is not None:
        rows.append(fields)
    found = Statement(name, options, rows)
    if name in ("KINEMATIC", "DISTRIBUTING") and deck.statements and deck.statements[-1].name == "COUPLING":
        deck.statements[-1].following, found.follows = found, True
    deck.statements.append(found)


def _part(reader: DeckReader, options: dict[str, str], deck: Deck) -> Deck:
    name = _named(options, "NAME").upper()
    if name in deck.parts:
        raise ValueError("a part of this name stands twice")
    deck.parts[name] = Deck()
    return deck.parts[name]


def _instance(reader: DeckReader, options: dict[str, str], deck: Deck) -> Deck:
    name = _named(options, "NAME").upper()
    if name in deck.instances:
        raise ValueError("an instance of this name stands twice")
    if options.keys() - {"NAME", "PART"}:
        raise ValueError("an instance of another analysis")
    rows: list[list[float]] = []
    while (fields := reader.data()) is not None:
        rows.append([reader.real(f) for f in fields])
    deck.placements[name] = _placement(rows)
    own = Deck()
    deck.instances[name] = options["NAME"], options.get("PART", "").upper(), own
    return own


def _placement(rows: list[list[float]]) -> Placement:
    """Of an instance: a translation, then a rotation by degrees about the line through two points, moved already."""
    if not rows:
        return Placement()
    shift = np.array([*rows[0], 0.0, 0.0, 0.0][:3])
    if len(rows) == 1:
        return Placement(shift)
    if len(rows[1]) != 7:
        raise ValueError("a rotation needs two points and an angle")
    first, second, angle = np.array(rows[1][:3]), np.array(rows[1][3:6]), math.radians(rows[1][6])
    if not (second - first).any():
        raise ValueError("the axis of a rotation needs two different points")
    x, y, z = (second - first) / np.linalg.norm(second - first)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
    return Placement(rotation @ (shift - first) + first, rotation)


_KEYWORDS: dict[str, Callable[[DeckReader, dict[str, str], Deck], None]] = {
    "NODE": _nodes,
    "ELEMENT": _elements,
    "NSET": _node_set,
    "ELSET": _element_set,
    "SURFACE": _surface,
    "SOLID SECTION": _solid_section,
    "SYSTEM": _system,
}


def _check_elements(deck: Deck, file: TextFile) -> None:
    for kind, cells in deck.elements.items():
        for nodes in cells.values():
            missing = next((n for n in nodes if n not in deck.points), None)
            if missing is not None:
                message = f"an element of type {kind} needs a node that is not in the deck"
                raise file.failure(message, value=missing, remedy="name the file that holds all nodes")
