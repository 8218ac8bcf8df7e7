"""Decks (.inp) of Abaqus and CalculiX: keywords, nodes, elements, sets, surfaces. One reader for meshes and exports.

Read here and not with meshio, which loses generated sets of several lines, sets of sets, surfaces, and all but the
last *NODE block. Only what says where nodes are is read; the names of all other keywords are kept, because some change
the matrices. Upper and lower case make no difference, as in these programs.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from fe_import.abaqus.elements import ElementType, element_type, in_mesh_order
from fe_import.abaqus.keywords import canonical
from fe_import.abaqus.lines import DeckReader
from fe_import.abaqus.sets import Item, NodesOf, SetTable, set_items
from fe_import.errors import Cause, shortened
from fe_import.files.text import TextFile

_ELSEWHERE = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")  # make or move nodes and elements
_ENDED = ("STEP", "PART", "ASSEMBLY", "INSTANCE")
_LARGEST_LABEL = 999_999_999


STATEMENTS = (
    *("MATERIAL", "ELASTIC", "DENSITY", "MASS", "ROTARY INERTIA", "SPRING"),
    *("EQUATION", "RIGID BODY", "COUPLING", "KINEMATIC", "DISTRIBUTING"),
)


@dataclass
class Statement:
    """A keyword that `fe_import.abaqus.attachments` or `fe_import.abaqus.materials` interprets at the end of the deck.

    Attributes
    ----------
    name : str
    options : dict of str
        Parameters, without blanks in their names.
    rows : list of lists of str
        Data lines.
    following : Statement or None
        *KINEMATIC or *DISTRIBUTING of a *COUPLING.
    follows : bool
        Whether it is one of these.
    """

    name: str
    options: dict[str, str]
    rows: list[list[str]]
    following: Statement | None = None
    follows: bool = False


@dataclass
class Deck:
    """What a deck says about its mesh.

    Attributes
    ----------
    points : dict
        Label -> position.
    elements : dict
        Type -> label -> labels of its nodes in meshio's order, none for types that are not known.
    types : dict of ElementType
    kinds : dict of str
        Label of an element -> its type.
    node_sets, element_sets : SetTable
    surfaces : dict
        Name -> whether it is made of nodes, and its data lines.
    solid_sections : list of dict
        Parameters of each *SOLID SECTION.
    statements : list of Statement
    keywords : Counter of str
        All keywords, in capitals.
    places : dict of str
        Where keywords and types of elements stand first.
    """

    points: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    types: dict[str, ElementType] = field(default_factory=dict)
    kinds: dict[int, str] = field(default_factory=dict)
    node_sets: SetTable = field(default_factory=SetTable)
    element_sets: SetTable = field(default_factory=SetTable)
    surfaces: dict[str, tuple[bool, list[list[str]]]] = field(default_factory=dict)
    solid_sections: list[dict[str, str]] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    keywords: Counter[str] = field(default_factory=Counter)
    places: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.node_sets.nodes_of = self.nodes_of

    def nodes_of(self, element_set: str) -> set[int]:
        """Labels of the nodes of an element set."""
        chosen = self.element_sets.members(element_set)
        return {node for e in chosen if e in self.kinds for node in self.elements[self.kinds[e]][e]}


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
    deck = Deck()
    with TextFile(path, where, cause) as file, contextlib.closing(DeckReader(file, Path(where))) as reader:
        while (keyword := reader.keyword()) is not None:
            name, options = canonical(keyword[0]), keyword[1]
            deck.keywords[name] += 1
            deck.places.setdefault(name, reader.place)
            if name in _ELSEWHERE:
                raise reader.fault(f"*{name} is not followed", remedy="write all nodes and elements out")
            if name in _KEYWORDS:
                try:
                    _KEYWORDS[name](reader, reader.known(name, options), deck)
                except ValueError as problem:
                    raise reader.fault(f"*{name}: {problem}") from None
            elif name in STATEMENTS:
                _statement(reader, name, options, deck)
        for name in _ENDED:
            if deck.keywords[name] > deck.keywords[f"END {name}"]:
                raise reader.fault(f"*{name} without *END {name}: the deck is cut off")
        _check_elements(deck, file)
    return deck


def _named(options: dict[str, str], name: str) -> str:
    if not options.get(name):
        raise ValueError(f"lacks {name}")
    return options[name]


def _nodes(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    if options.get("SYSTEM", "R").upper() != "R":
        raise ValueError("nodes in cylindrical or spherical coordinates")
    labels: list[int] = []
    while (fields := reader.data()) is not None:
        if not 2 <= len(fields) <= 7:  # with the direction of a normal; zeros at the end may be left out
            raise reader.fault("expected a node and three coordinates", shortened(", ".join(fields)))
        label = reader.integer(fields[0])
        if not 0 < label <= _LARGEST_LABEL:
            raise reader.fault("the number of a node is out of range", str(label))
        position = tuple(reader.real(f) for f in (*fields[1:4], "", "", "")[:3])
        if deck.points.setdefault(label, position) != position:
            raise reader.fault(f"node {label} stands twice, at different positions")
        labels.append(label)
    if options.get("NSET"):
        deck.node_sets.add(options["NSET"], labels)


def _elements(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    kind = _named(options, "TYPE").upper()
    deck.types[kind] = known = element_type(kind)
    deck.places.setdefault(kind, reader.place)
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
        label, *nodes = map(reader.integer, fields)
        nodes = nodes[: known.nodes]
        if known.nodes == 27:
            nodes = in_mesh_order(nodes)
        if deck.kinds.setdefault(label, kind) != kind or cells.setdefault(label, nodes) != nodes:
            raise reader.fault(f"element {label} stands twice, with different nodes or types")
        labels.append(label)
    if options.get("ELSET"):
        deck.element_sets.add(options["ELSET"], labels)


def _node_set(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    items = _items(reader, "GENERATE" in options)
    if "ELSET" in options:
        items.append(NodesOf(_named(options, "ELSET")))
    deck.node_sets.add(_named(options, "NSET"), items)


def _element_set(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    deck.element_sets.add(_named(options, "ELSET"), _items(reader, "GENERATE" in options))


def _items(reader: DeckReader, generate: bool) -> list[Item]:
    items: list[Item] = []
    while (fields := reader.data()) is not None:
        items += set_items(fields, generate)
    return items


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


def _instance(reader: DeckReader, options: dict[str, str], deck: Deck) -> None:
    if deck.keywords["INSTANCE"] > 1:
        raise ValueError("several instances; a link is one part")
    while (fields := reader.data()) is not None:
        if any(map(reader.real, fields)):
            raise ValueError("the instance is moved; write the mesh where it belongs")


_KEYWORDS: dict[str, Callable[[DeckReader, dict[str, str], Deck], None]] = {
    "NODE": _nodes,
    "ELEMENT": _elements,
    "NSET": _node_set,
    "ELSET": _element_set,
    "SURFACE": _surface,
    "SOLID SECTION": _solid_section,
    "INSTANCE": _instance,
}


def _check_elements(deck: Deck, file: TextFile) -> None:
    for kind, cells in deck.elements.items():
        for nodes in cells.values():
            missing = next((n for n in nodes if n not in deck.points), None)
            if missing is not None:
                message = f"an element of type {kind} needs a node that is not in the deck"
                raise file.failure(message, value=missing, remedy="name the file that holds all nodes")
