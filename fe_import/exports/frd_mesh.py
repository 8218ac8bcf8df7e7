"""Nodes and elements of CalculiX results (``.frd``), for matrices whose deck is not at hand; sets come from a file.

Positions have six digits there. That is enough for meshes with round coordinates; of others the check that a turned
link feels no force says what they lack.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from fe_import.errors import shortened
from fe_import.exports.inp_mesh import InpMesh
from fe_import.model import IntArray
from fe_import.text_file import TextFile

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
_REMEDY = "write the results again as text (*NODE FILE), or name the deck as 'mesh'"


def is_frd(path: Path) -> bool:
    """Whether a name ends in ``.frd`` or ``.frd.gz``."""
    return path.name.lower().removesuffix(".gz").endswith(".frd")


def read_frd(path: Path) -> InpMesh:
    """Read nodes and elements, plain or gzip.

    Raises
    ------
    FEImportError
        ``EXPORT``, ``NOT_READABLE``: not such a file, cut off, doubled or missing nodes.
    """
    points: dict[int, tuple[float, ...]] = {}
    cells: list[tuple[int, list[int]]] = []
    with TextFile(path) as file:
        while (line := file.line()) is not None:
            block = line[:6].strip()
            if block in ("2C", "3C"):
                count = _count(file, line)
                if block == "2C":
                    _read_nodes(file, count, points)
                else:
                    _read_elements(file, count, cells)
        if not points:
            raise file.failure("no nodes in this file", remedy=_REMEDY)
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


def _count(file: TextFile, line: str) -> int:
    fields = line[6:].split()
    if len(fields) != 2 or not fields[0].isdecimal() or fields[1] not in ("0", "1"):
        raise file.failure("not the head of a block in text form", line=file.number, value=line.strip(), remedy=_REMEDY)
    return int(fields[0])


def _read_nodes(file: TextFile, count: int, points: dict[int, tuple[float, ...]]) -> None:
    before = len(points)
    while (line := file.line()) is not None and line[:3] != " -3":
        try:
            if line[:3] != " -1":
                raise ValueError
            label = int(line[3:-36])
            position = tuple(float(line[k : k + 12]) for k in range(len(line) - 36, len(line), 12))
            if label in points or not np.isfinite(position).all():
                raise ValueError
        except ValueError:
            message = "not a node, or one that stands twice"
            raise file.failure(message, line=file.number, value=shortened(line.strip()), remedy=_REMEDY) from None
        points[label] = position
    _refuse_cut(file, line, len(points) - before, count)


def _read_elements(file: TextFile, count: int, cells: list[tuple[int, list[int]]]) -> None:
    before = len(cells)
    while (line := file.line()) is not None and line[:3] != " -3":
        try:
            numbers = [int(field) for field in line[3:].split()]
            if line[:3] == " -1" and len(numbers) == 4:
                cells.append((numbers[1], []))
            elif line[:3] == " -2" and len(cells) > before:
                cells[-1][1].extend(numbers)
            else:
                raise ValueError
        except ValueError:
            message = "not an element"
            raise file.failure(message, line=file.number, value=shortened(line.strip()), remedy=_REMEDY) from None
    for kind, nodes in cells[before:]:
        if kind in _TYPES and len(nodes) != len(_TYPES[kind][1]):
            message = f"an element of type {kind} with another number of nodes"
            raise file.failure(message, line=file.number, value=len(nodes), limit=len(_TYPES[kind][1]), remedy=_REMEDY)
    _refuse_cut(file, line, len(cells) - before, count)


def _refuse_cut(file: TextFile, line: str | None, found: int, count: int) -> None:
    if line is None or found != count:
        raise file.failure("the file is cut off", line=file.number, value=found, limit=count, remedy=_REMEDY)


def _elements(cells: list[tuple[int, list[int]]], place: dict[int, int]) -> dict[str, IntArray]:
    found: dict[str, list[list[int]]] = {}
    for kind, nodes in cells:
        if kind in _TYPES:
            name, order = _TYPES[kind]
            found.setdefault(name, []).append([place[nodes[k]] for k in order])
    return {name: np.array(rows, dtype=np.int64) for name, rows in found.items()}
