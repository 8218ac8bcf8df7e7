"""Meshes of universal files (.unv) of I-DEAS, Salome, Femap and others: data sets of numbers between lines ``-1``.

Read are nodes (2411, 781), elements (2412, 780) and groups (2467, 2477, 2452, 2435, 2432, 2430, 2429). Elements of
surfaces and lines mark faces, unless the file states properties of theirs. After the descriptions of the data sets by
the Structural Dynamics Research Laboratory of the University of Cincinnati.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.errors import Cause, FEImportError, shortened
from fe_import.files.text import TextFile
from fe_import.mesh.labelled import LabelledMesh
from fe_import.mesh.orders import INTERLACED
from fe_import.mesh.raw import LeftOut, RawMesh

_SOLIDS = {111: "tet4", 118: "tet10", 112: "wedge6", 113: "wedge15", 115: "hex8", 116: "hex20"}
_FLAT = {1: ("triangle", 3), 2: ("triangle6", 6), 4: ("quad", 4), 5: ("quad8", 8)}  # last digit of 41 ... 95
_LINES = (11, 21, 22, 23, 24)  # records of these have a line of orientation
_FURTHER = {  # elements that are not read
    **dict.fromkeys((121, 122), "constraints between nodes"),
    **dict.fromkeys((*range(136, 143), 151, 152), "springs, dampers or connectors"),
    161: "point masses",
    **dict.fromkeys((31, 32), "beams"),
}
_GROUPS = {2467: 2, 2477: 2, 2452: 2, 2435: 2, 2432: 4, 2430: 4, 2429: 4}  # members in a line
_NODES, _ELEMENTS = (2411, 781), {2412: (6, 1, 5), 780: (8, 1, 7)}  # fields, of type and of count of nodes
_OLDER = (15, 71)
_PROPERTIES = {772, 776, 788, 789, 2437, 2448, 2470}
_SUPPORTS = {754, 755, 756, 757, 791, 792}
_UNNEEDED = {
    *(151, 164, 2400, 2401, 2420, 1716, 1710, 773, 2426, 2438),  # header, units, coordinate systems, materials
    *(55, 56, 57, 58, 82, 2414, 1858, 247, 250, 252),  # results, functions, trace lines
    *(782, 783, 784, 785, 786, 787, 790, 2428, 2440),  # loads, temperatures
}
_ENTITY_NODE, _ENTITY_ELEMENT = 7, 8
_MOST_NODES = 30  # of an element


def read_universal(path: Path, name: str) -> RawMesh:
    """Read a universal file.

    Parameters
    ----------
    path : Path
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: faulty or missing data sets.
    """
    with TextFile(path, name, Cause.NOT_READABLE) as file:
        return _Reader(file).mesh()


class _Reader:
    def __init__(self, file: TextFile) -> None:
        self._file = file
        self._mesh = LabelledMesh()
        self._left: Counter[tuple[str, str]] = Counter()  # what, and what would be lost
        self._first: dict[str, int] = {}
        self._properties = False

    def mesh(self) -> RawMesh:
        try:
            for number in self._sets():
                self._read(number)
            if not self._mesh.points:
                raise self._fault("no nodes in it: data set 2411 or 781 is missing")
            raw = self._mesh.raw()
            raw.mirrored = frozenset(MESH_ELEMENTS)  # as Salome numbers elements that were drawn by hand
        except ValueError as problem:
            raise self._fault(str(problem)) from None
        for (what, text), count in self._left.items():
            loss = text if text not in ("shells", "beams or bars") or self._properties else ""
            raw.left_out.append(LeftOut(what, count, f"line {self._first[what]}", loss))
        return raw

    def _fault(self, message: str, value: str | None = None) -> FEImportError:
        file = self._file
        message, remedy = f"cannot be read as a mesh: {message}", "write the mesh again"
        return file.failure(message, line=file.number, value=value, remedy=remedy)

    def _sets(self) -> Iterator[int]:
        """Numbers of the data sets; of each the lines up to the closing -1 must have been read."""
        while (line := self._file.line()) is not None:
            if not line.strip():
                continue
            if line.strip() != "-1":
                raise self._fault("a data set must begin with -1", shortened(line))
            words = self._line().split()
            if not words or not words[0].rstrip("b").isdigit():
                raise self._fault("the number of a data set must follow -1", shortened(" ".join(words)))
            if words[0].endswith("b"):
                raise self._fault(f"data set {words[0]} is binary: export as text")
            yield int(words[0])

    def _line(self) -> str:
        line = self._file.line()
        if line is None:
            raise self._fault("the file ends within a data set: it is cut off")
        return line

    def _records(self) -> Iterator[str]:
        """Lines to the end of a data set."""
        while (line := self._line()).strip() != "-1":
            if line.strip():
                yield line

    def _read(self, number: int) -> None:
        if number in _NODES:
            for line in self._records():
                label = self._integers(line)[0]
                self._mesh.add_point(label, self._position(self._line()))
        elif number in _ELEMENTS:
            for line in self._records():
                self._element(self._integers(line), *_ELEMENTS[number])
        elif number in _GROUPS:
            for line in self._records():
                self._group(self._integers(line), _GROUPS[number])
        else:
            self._properties |= number in _PROPERTIES
            if number in _OLDER:
                raise self._fault(f"data set {number} is of an older form; export nodes as 2411, elements as 2412")
            text = "" if number in _UNNEEDED | _PROPERTIES else "what is not known here"
            text = "supports (a link is free, and joints hold it)" if number in _SUPPORTS else text
            self._count(f"data set {number}", text)
            for _ in self._records():
                pass

    def _count(self, what: str, text: str) -> None:
        self._left[what, text] += 1
        self._first.setdefault(what, self._file.number)

    def _integers(self, line: str) -> list[int]:
        words = line.split()
        if not words or not all(w.lstrip("-").isdigit() and len(w) < 19 for w in words):
            raise self._fault("whole numbers expected", shortened(line))
        return [int(w) for w in words]

    def _position(self, line: str) -> tuple[float, ...]:
        words = line.upper().replace("D", "E").split()
        try:
            position = tuple(map(float, words))
        except ValueError:
            position = ()
        if len(position) != 3 or "_" in line:
            raise self._fault("three coordinates expected", shortened(line))
        return position

    def _element(self, record: list[int], fields: int, kind_at: int, count_at: int) -> None:
        if len(record) != fields:
            raise self._fault(f"the record of an element has {fields} numbers", " ".join(map(str, record)))
        label, kind, count = record[0], record[kind_at], record[count_at]
        if not 0 < count <= _MOST_NODES:
            raise self._fault(f"element {label} cannot have {count} nodes")
        if kind in _LINES:
            self._line()  # orientation, ends
        nodes: list[int] = []
        while len(nodes) < count:
            nodes += self._integers(self._line())
        if len(nodes) != count:
            raise self._fault(f"element {label} has more nodes than its {count}")
        if kind in _SOLIDS:
            element = MESH_ELEMENTS[_SOLIDS[kind]]
            self._add(element.meshio_name, 3, label, nodes, element.size, _SOLIDS[kind])
        elif kind in _LINES:
            shape, size = ("line3", 3) if count == 3 else ("line", 2)  # Salome writes both as 22
            self._add(shape, 1, label, nodes, size, shape)
            self._count(f"elements of type {kind}", "beams or bars")
        elif 41 <= kind <= 99 and kind % 10 in _FLAT:
            shape, size = _FLAT[kind % 10]
            self._add(shape, 2, label, nodes, size, shape)
            self._count(f"elements of type {kind}", "shells")
        elif 111 <= kind <= 120:
            raise self._fault(f"elements of type {kind} (cubic, or unknown) cannot be assembled")
        else:
            self._count(f"elements of type {kind}", _FURTHER.get(kind, "what is not known here"))

    def _add(self, shape: str, dimension: int, label: int, nodes: list[int], size: int, order: str) -> None:
        if len(nodes) != size:
            raise self._fault(f"element {label} has {len(nodes)} nodes, its type has {size}")
        self._mesh.add_cell(shape, dimension, label, [nodes[k] for k in INTERLACED.get(order, range(size))])

    def _group(self, record: list[int], per_line: int) -> None:
        name, count = self._line().strip(), record[-1]
        if count < 0 or not name:
            raise self._fault(f"group {record[0]} has no name, or a count of members that is none")
        width = 8 // per_line
        nodes: list[int] = []
        elements: list[int] = []
        found = 0
        while found < count:
            fields = self._integers(self._line())
            if len(fields) % width or found + len(fields) // width > count:
                raise self._fault(f"group {name!r} does not have the {count} members that it states")
            for kind, label in zip(fields[::width], fields[1::width], strict=True):
                if kind in (_ENTITY_NODE, _ENTITY_ELEMENT):
                    (nodes if kind == _ENTITY_NODE else elements).append(label)
            found += len(fields) // width
        for sets, members in ((self._mesh.node_sets, nodes), (self._mesh.element_sets, elements)):
            if members or not (nodes or elements):
                sets.setdefault(name, []).extend(members)
