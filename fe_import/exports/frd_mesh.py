"""Nodes and elements of CalculiX results (``.frd``), for matrices whose deck is not at hand; sets come from a file.

Positions have six digits there; `fe_import.models.export_positions` finds the others.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np

from fe_import.errors import shortened
from fe_import.exports.inp_mesh import InpMesh
from fe_import.files.text import TextFile
from fe_import.model import IntArray

POSITIONS = "six digits, of an .frd file"  # note of an export

# number of the type -> name and places of its nodes in the order of decks
_TYPES: dict[int, tuple[str, tuple[int, ...]]] = {
    1: ("C3D8", tuple(range(8))),
    2: ("C3D6", tuple(range(6))),
    3: ("C3D4", tuple(range(4))),
    4: ("C3D20", (*range(12), *range(16, 20), *range(12, 16))),
    5: ("C3D15", (*range(9), *range(12, 15), *range(9, 12))),
    6: ("C3D10", tuple(range(10))),
    7: ("S3", tuple(range(3))),
    8: ("S6", tuple(range(6))),
    9: ("S4", tuple(range(4))),
    10: ("S8", tuple(range(8))),
}
_HEAD = re.compile(r" +[23]C +(\d{1,12}) +([01]) *", re.ASCII)
_LABEL = re.compile(r" *\d+", re.ASCII)
_POSITION = re.compile(3 * r" *([+-]?\d\.\d{5}E[+-]\d{2,3})", re.ASCII)  # exponents of 3 digits leave no blank between
_INTEGERS = re.compile(r"( +\d{1,12})+", re.ASCII)
_REMEDY = "write the results again as text (*NODE FILE), or name the deck as 'mesh'"


def is_frd(path: Path) -> bool:
    """Whether a name ends in ``.frd`` or ``.frd.gz``."""
    return path.name.lower().removesuffix(".gz").endswith(".frd")


def read_frd(path: Path) -> InpMesh:
    """Read nodes and elements, plain or gzip, up to the results.

    Raises
    ------
    FEImportError
        ``EXPORT``, ``NOT_READABLE``: not such a file, cut off, doubled or missing nodes.
    """
    points: dict[int, tuple[float, ...]] = {}
    cells: list[tuple[int, list[int]]] = []
    with TextFile(path) as file:
        _read_nodes(file, points)
        _read_elements(file, cells)
        labels = np.sort(np.fromiter(points, dtype=np.int64))
        place = {int(label): k for k, label in enumerate(labels)}
        lost = next((n for _, nodes in cells for n in nodes if n not in place), None)
        if lost is not None:
            raise file.failure("an element names a node that is not there", value=lost, remedy=_REMEDY)
    return InpMesh(
        np.array([points[int(label)] for label in labels]),
        labels,
        _elements(cells, place),
        {},
        Counter(),
        tuple(sorted({f"of .frd type {kind}" for kind, _ in cells if kind not in _TYPES})),
        str(path),
    )


def _head(file: TextFile, block: str, what: str) -> tuple[int, int]:
    """Go to a block; the number of its entries, and the digits of a node's number."""
    while (line := file.line()) is not None:
        if line[:6].strip() == block:
            if not (match := _HEAD.fullmatch(line)):
                message = "not the head of a block in text form"
                raise file.failure(message, line=file.number, value=shortened(line.strip()), remedy=_REMEDY)
            return int(match[1]), 10 if match[2] == "1" else 5
    raise file.failure(f"no {what} in this file", remedy=_REMEDY)


def _read_nodes(file: TextFile, points: dict[int, tuple[float, ...]]) -> None:
    count, width = _head(file, "2C", "nodes")
    while (line := file.line()) is not None and line[:3] != " -3":
        label, position = line[3 : 3 + width], _POSITION.fullmatch(line[3 + width :].rstrip())
        if line[:3] != " -1" or not _LABEL.fullmatch(label) or not position:
            message = "not a node with three coordinates"
            raise file.failure(message, line=file.number, value=shortened(line.strip()), remedy=_REMEDY)
        if int(label) in points:
            raise file.failure("this node stands twice", line=file.number, value=int(label), remedy=_REMEDY)
        points[int(label)] = tuple(map(float, position.groups()))
    _refuse_cut(file, line, len(points), count)


def _read_elements(file: TextFile, cells: list[tuple[int, list[int]]]) -> None:
    count, _ = _head(file, "3C", "elements")
    while (line := file.line()) is not None and line[:3] != " -3":
        numbers = [int(field) for field in line[3:].split()] if _INTEGERS.fullmatch(line[3:].rstrip()) else []
        if line[:3] == " -1" and len(numbers) == 4:
            cells.append((numbers[1], []))
        elif line[:3] == " -2" and numbers and cells:
            cells[-1][1].extend(numbers)
        else:
            message = "neither an element nor its nodes"
            raise file.failure(message, line=file.number, value=shortened(line.strip()), remedy=_REMEDY)
    for kind, nodes in cells:
        if kind in _TYPES and len(nodes) != len(_TYPES[kind][1]):
            message = f"an element of type {kind} with another number of nodes"
            raise file.failure(message, line=file.number, value=len(nodes), limit=len(_TYPES[kind][1]), remedy=_REMEDY)
    _refuse_cut(file, line, len(cells), count)


def _refuse_cut(file: TextFile, line: str | None, found: int, count: int) -> None:
    if line is None or found != count:
        message = "the file is cut off" if line is None else "another number of entries than the block's head says"
        raise file.failure(message, line=file.number, value=found, limit=count, remedy=_REMEDY)


def _elements(cells: list[tuple[int, list[int]]], place: dict[int, int]) -> dict[str, IntArray]:
    found: dict[str, list[list[int]]] = {}
    for kind, nodes in cells:
        if kind in _TYPES:
            name, order = _TYPES[kind]
            found.setdefault(name, []).append([place[nodes[k]] for k in order])
    return {name: np.array(rows, dtype=np.int64) for name, rows in found.items()}
