"""What a deck of Abaqus or CalculiX says: data only."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fe_import.abaqus.elements import ElementType
from fe_import.abaqus.sets import Item, NodesOf, SetTable
from fe_import.model import Array

CODED = 10**12  # beyond all labels


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
    scope : str
        The instance that it stands in (capitals), empty outside of instances.
    """

    name: str
    options: dict[str, str]
    rows: list[list[str]]
    following: Statement | None = None
    follows: bool = False
    scope: str = ""


@dataclass(frozen=True)
class Placement:
    """Where an instance stands: a point x of its part is at ``rotation`` x + ``translation``."""

    translation: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))

    @property
    def turned(self) -> bool:
        """Whether the instance is turned."""
        return not np.array_equal(self.rotation, np.eye(3))

    def moved(self, point: Array) -> Array:
        """(3,) where a point of the part is."""
        return np.asarray(self.rotation @ point + self.translation)

    def in_part(self, points: Array) -> Array:
        """(..., 3) points as the part has them."""
        return np.asarray((points - self.translation) @ self.rotation)


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
    orientation_nodes : dict of int
        Label of a beam -> the further node that its direction 1 points at, where it has one.
    normals : set of int
        Labels of nodes that are given a normal.
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
    parts : dict of Deck
        What stands between *PART and *END PART, by name in capitals.
    instances : dict of tuples
        Name in capitals -> as first written, name of the part, and what the instance itself holds; empty once they are
        put together.
    placements : dict of Placement
        Of instances, by name in capitals.
    codes : dict of int
        Of instances that labels are prefixed with, by name in capitals; see `coded`.
    system : Placement
        Of the points of *NODE, as *SYSTEM states it.
    """

    points: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    types: dict[str, ElementType] = field(default_factory=dict)
    kinds: dict[int, str] = field(default_factory=dict)
    orientation_nodes: dict[int, int] = field(default_factory=dict)
    normals: set[int] = field(default_factory=set)
    node_sets: SetTable = field(default_factory=SetTable)
    element_sets: SetTable = field(default_factory=SetTable)
    surfaces: dict[str, tuple[bool, list[list[str]]]] = field(default_factory=dict)
    solid_sections: list[dict[str, str]] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    keywords: Counter[str] = field(default_factory=Counter)
    places: dict[str, str] = field(default_factory=dict)

    parts: dict[str, Deck] = field(default_factory=dict)
    instances: dict[str, tuple[str, str, Deck]] = field(default_factory=dict)
    placements: dict[str, Placement] = field(default_factory=dict)
    codes: dict[str, int] = field(default_factory=dict)
    system: Placement = Placement()

    def __post_init__(self) -> None:
        self.node_sets.nodes_of = self.nodes_of

    def coded(self, instance: str, item: Item) -> Item:
        """A member of a set as one of an instance: a name with its name, a label plus a multiple of ``CODED``."""
        if isinstance(item, str):
            return f"{instance}.{item}"
        if isinstance(item, NodesOf):
            return NodesOf(f"{instance}.{item.element_set}")
        shift = CODED * self.codes.setdefault(instance.upper(), len(self.codes) + 1)
        return item + shift if isinstance(item, int) else range(item.start + shift, item.stop + shift, item.step)

    def placement(self, statement: Statement) -> Placement:
        """Of the instance that a statement stands in."""
        return self.placements.get(statement.scope, Placement())

    @cached_property
    def connectivity(self) -> dict[int, tuple[str, list[int]]]:
        """Type and nodes of each element, once the deck is read."""
        return {label: (kind, nodes) for kind, cells in self.elements.items() for label, nodes in cells.items()}

    def nodes_of(self, element_set: str) -> set[int]:
        """Labels of the nodes of an element set."""
        chosen = self.element_sets.members(element_set)
        return {node for e in chosen if e in self.kinds for node in self.elements[self.kinds[e]][e]}
