"""Element types of Abaqus and CalculiX decks: how many nodes they have, and their shape."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fe_import.elements.reference_cells import HEXAHEDRON
from fe_import.elements.solid_elements import MESH_ELEMENTS, SolidElement

_SOLIDS = {element.size: element for element in MESH_ELEMENTS.values()}
_FACES = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"}
_LINES = {2: "line", 3: "line3"}
_BEAMS = {1: 2, 3: 2, 2: 3}  # B31, B33, B32
_POINTS = {"MASS": 1, "ROTARYI": 1, "SPRING1": 1, "SPRING2": 2, "SPRINGA": 2}
_TYPE = re.compile(r"(C3D|CSS|SFM3D|M3D|R3D|STRI|CPS|CPE|CAX|SC|S|T3D|B3)(\d+)(?:[A-Z]\w*)?\Z")


@dataclass(frozen=True)
class ElementType:
    """An element type of a deck.

    Attributes
    ----------
    nodes : int
        0 when not known: such elements are not read.
    shape : str
        meshio's name; that of the type for solids of another shape, empty where there is nothing to show.
    dimension : int
    spare : int
        Nodes that may follow (the orientation node of a beam).
    """

    nodes: int
    shape: str = ""
    dimension: int = 0
    spare: int = 0


def element_type(kind: str) -> ElementType:
    """What the name of a type (capitals) says."""
    if kind in _POINTS:
        return ElementType(_POINTS[kind])
    found = _TYPE.match(kind)
    if not found:
        return ElementType(0)
    family, number = found[1], int(found[2])
    if family == "C3D":
        solid = _SOLIDS.get(number)
        return ElementType(0, kind, 3) if solid is None else ElementType(number, solid.meshio_name, 3)
    if family in ("SC", "CSS"):
        return ElementType(number, kind, 3)
    if family == "B3":
        count = _BEAMS.get(number, 0)
        return ElementType(count, _LINES.get(count, ""), 1, spare=1)
    table, dimension = (_LINES, 1) if family == "T3D" else (_FACES, 2)
    count = 6 if family == "STRI" and number == 65 else number
    return ElementType(count, table[count], dimension) if count in table else ElementType(0)


def solid_type(kind: str) -> SolidElement | None:
    """The solid element that the name of a type (capitals) means; None for all others."""
    found = _TYPE.match(kind)
    return _SOLIDS.get(int(found[2])) if found and found[1] == "C3D" else None


def in_mesh_order(nodes: list[int]) -> list[int]:
    """Nodes of a C3D27 in meshio's order; decks begin the further ones with the centre, then those of S1, S2 ..."""
    places = [21 + HEXAHEDRON.deck_faces.index(face) for face in range(6)]
    return [*nodes[:20], *(nodes[k] for k in places), nodes[20]]


def face_nodes(kind: str, number: int) -> list[int]:
    """Places, in meshio's order, of the nodes of face S1, S2 ... of a solid; none where there is no such face."""
    solid = solid_type(kind)
    if solid is None or not 1 <= number <= len(solid.faces):
        return []
    return [int(k) for k in solid.faces[solid.cell.deck_faces[number - 1]]]
