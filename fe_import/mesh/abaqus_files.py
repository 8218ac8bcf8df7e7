"""Mesh of an Abaqus or CalculiX deck (.inp) with all its sets. Names are those of the deck, as first written."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from fe_import.abaqus.attachments import Attached, attachments
from fe_import.abaqus.deck import Deck
from fe_import.abaqus.keywords import is_read, loss, loss_of_elements
from fe_import.abaqus.materials import USED, deck_materials
from fe_import.abaqus.parse import read_deck
from fe_import.abaqus.sets import LostSet, indices, surface_nodes
from fe_import.elements.attachments import renumbered
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.raw import Block, LeftOut, RawMesh


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
        ``NOT_READABLE``: what `fe_import.abaqus.parse` refuses.
    """
    try:
        deck = read_deck(path, name, Cause.NOT_READABLE)
    except FEImportError as problem:
        problem.message = f"cannot be read as a mesh: {problem.message}"
        raise
    place = {label: k for k, label in enumerate(deck.points)}
    blocks, numbers = [], []
    for kind, cells in deck.elements.items():
        known = deck.types[kind]
        if known.shape:
            rows = [[place[node] for node in nodes] for nodes in cells.values()]
            array = np.array(rows, dtype=np.int64).reshape(len(rows), known.nodes)
            blocks.append(Block(known.shape, known.dimension, array))
            numbers.append({label: k for k, label in enumerate(cells)})
    mesh = RawMesh(np.array(list(deck.points.values()), dtype=float).reshape(-1, 3), blocks)
    _add_element_sets(deck, numbers, mesh)
    _add_node_sets(deck, place, mesh)
    _add_surfaces(deck, place, mesh)
    attached = attachments(deck)
    mesh.materials = replace(deck_materials(deck), fillings=tuple(attached.fillings))
    mesh.left_out += _left_out(deck, attached)
    mesh.attachments += [renumbered(i, place.__getitem__) for i in attached.items if i.keyword not in attached.reasons]
    return mesh


def _left_out(deck: Deck, attached: Attached) -> list[LeftOut]:
    """Keywords, and elements that are no solids."""

    def entry(name: str, count: int, text: str) -> LeftOut:
        if name in attached.reasons:
            text += f" ({attached.reasons[name]})"
        used = name in attached.whole and name not in attached.reasons
        used |= name in USED[:3] and "BEAM SECTION" in attached.whole
        return LeftOut(name, count, deck.places[name], "" if used else text, used)

    found = [entry(name, count, loss(name)) for name, count in deck.keywords.items() if not is_read(name)]
    sectioned = _with_sections(deck)
    for kind, cells in deck.elements.items():
        if (dimension := deck.types[kind].dimension) != 3:
            text = loss_of_elements(kind, dimension, not sectioned.isdisjoint(cells))
            item = entry(kind, len(cells), text)
            found += [] if item.used else [item]  # its keyword is there
    order = list(deck.places)
    return sorted(found, key=lambda item: order.index(item.name))


def _with_sections(deck: Deck) -> set[int]:
    """Elements of solid sections; what is lost of their sets is told where a set is asked for."""
    found: set[int] = set()
    for options in deck.solid_sections:
        with contextlib.suppress(LostSet):
            found |= deck.element_sets.members(options["ELSET"])
    return found


def _add_element_sets(deck: Deck, numbers: list[dict[int, int]], mesh: RawMesh) -> None:
    for key, shown in deck.element_sets.names.items():
        try:
            members = deck.element_sets.members(key)
            indices(members - deck.kinds.keys(), {}, "element")
        except LostSet as reason:
            mesh.lost[shown] = str(reason)
            continue
        mesh.cell_sets[shown] = [
            np.array(sorted(own[label] for label in members & own.keys()), dtype=np.int64) for own in numbers
        ]


def _add_node_sets(deck: Deck, place: dict[int, int], mesh: RawMesh) -> None:
    for key, shown in deck.node_sets.names.items():
        try:
            mesh.point_sets[shown] = indices(deck.node_sets.members(key), place, "node")
        except LostSet as reason:
            mesh.lost[shown] = str(reason)


def _add_surfaces(deck: Deck, place: dict[int, int], mesh: RawMesh) -> None:
    connectivity = deck.connectivity
    for shown, (by_nodes, rows) in deck.surfaces.items():
        try:
            members = surface_nodes(rows, deck.element_sets, connectivity, deck.node_sets, by_nodes)
            found = indices(members, place, "node")
        except LostSet as reason:
            mesh.lost.setdefault(shown, str(reason))
            continue
        if not np.array_equal(mesh.point_sets.setdefault(shown, found), found):
            mesh.lost[shown] = "a node set and a surface with other nodes have this name"
            del mesh.point_sets[shown]
