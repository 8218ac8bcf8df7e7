"""Element types of Abaqus and CalculiX decks: how many nodes they have, and their shape."""

from __future__ import annotations

import re
from dataclasses import dataclass

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
        known = number in _SOLIDS
        return ElementType(number if known else 0, _SOLIDS.get(number, kind), 3)
    if family in ("SC", "CSS"):
        return ElementType(number, kind, 3)
    if family == "B3":
        count = _BEAMS.get(number, 0)
        return ElementType(count, _LINES.get(count, ""), 1, spare=1)
    table, dimension = (_LINES, 1) if family == "T3D" else (_FACES, 2)
    count = 6 if family == "STRI" and number == 65 else number
    return ElementType(count, table[count], dimension) if count in table else ElementType(0)
