"""Nodes, elements and node sets of the deck (``.inp``) that belongs to exported matrices."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_import.abaqus.deck import Deck
from fe_import.abaqus.parse import read_deck
from fe_import.abaqus.sets import LostSet, indices
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class InpMesh:
    """What a deck says about its mesh.

    Attributes
    ----------
    nodes : (n, 3) array
    labels : (n,) int array
        Their numbers in the deck, rising.
    elements : dict of (m, k) int arrays
        Type -> indices of the nodes of its elements.
    node_sets : dict of int arrays
        Name (capitals, as the programs read it) -> indices of nodes, rising.
    keywords : Counter of str
        All keywords, in capitals.
    unread : tuple of str
        Element types whose number of nodes is not known; these elements are left out.
    source : str
    """

    nodes: Array
    labels: IntArray
    elements: dict[str, IntArray]
    node_sets: dict[str, IntArray]
    keywords: Counter[str]
    unread: tuple[str, ...]
    source: str

    def element_nodes(self) -> IntArray:
        """Nodes that belong to an element, rising."""
        parts = [np.unique(e) for e in self.elements.values()]
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *parts]))


def read_inp(path: Path) -> InpMesh:
    """Read a deck, plain or gzip.

    Raises
    ------
    FEImportError
        ``EXPORT``: what `fe_import.abaqus.parse` refuses, parts and assemblies, sets of what is not there.
    """
    deck = read_deck(path, str(path), Cause.EXPORT)
    for keyword in ("PART", "INSTANCE"):
        if deck.keywords[keyword]:
            remedy = "write a flat deck without parts and assemblies"
            raise _fault(path, f"*{keyword}: the matrices count nodes in another way", remedy=remedy)
    if not deck.points:
        raise _fault(path, "no nodes in this deck", remedy="name the file with *NODE")
    labels = np.sort(np.fromiter(deck.points, dtype=np.int64))
    place = {int(label): k for k, label in enumerate(labels)}
    elements = {
        kind: np.array([[place[n] for n in nodes] for nodes in cells.values()], dtype=np.int64)
        for kind, cells in deck.elements.items()
        if cells and deck.types[kind].nodes
    }
    return InpMesh(
        np.array([deck.points[int(label)] for label in labels]),
        labels,
        elements,
        _node_sets(deck, place, path),
        deck.keywords,
        tuple(sorted(kind for kind, known in deck.types.items() if not known.nodes)),
        str(path),
    )


def _node_sets(deck: Deck, place: dict[int, int], path: Path) -> dict[str, IntArray]:
    sets = {}
    for key in deck.node_sets.names:
        try:
            sets[key] = indices(deck.node_sets.members(key), place, "node")
        except LostSet as reason:
            raise _fault(path, f"set {key!r}: {reason}", remedy="name the file that holds all nodes") from None
    return sets


def _fault(path: Path, message: str, *, remedy: str) -> FEImportError:
    return FEImportError(Cause.EXPORT, message, where=str(path), remedy=remedy)
