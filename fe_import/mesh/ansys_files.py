"""Meshes of Ansys archives (.cdb), as CDWRITE and other programs write them: blocks of nodes, elements, components.

Components become sets; numbers of materials and of types element sets ``MAT:1``, ``TYPE:1``. What other elements and
commands mean is in `fe_import.mesh.ansys_types`.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.errors import Cause, FEImportError, shortened
from fe_import.files.text import TextFile
from fe_import.mesh.ansys_types import MESHING, MESHING_SOLIDS, SOLIDS, command_loss, solid_nodes, type_loss
from fe_import.mesh.labelled import LabelledMesh
from fe_import.mesh.raw import LeftOut, RawMesh

_FORMAT = re.compile(  # such as (3i9,6e21.13e3), (1i7,2i9,6e21.13), (19i9), (2i9,19a9)
    r"\(\s*(\d*)i(\d+)(?:,\s*(\d*)i(\d+))?(?:,\s*\d*[eg](\d+)\.\d+(?:e\d+)?)?(?:,\s*\d*a\d+)?\s*\)", re.IGNORECASE
)
_COMMAND = re.compile(r"\s*([A-Za-z/*_][\w/*:]*)")
_ASSIGNMENT = re.compile(r"\s*\w+\s*=")
_IN_COLUMNS = re.compile(r"(.{72})([SGT]) *(\d+)\s*")  # begin of an archive, as IGES has it: title, commands, sizes
_HEADER = 11  # numbers before the nodes of an element: material, type, ... , count of nodes, -, number
_MOST_NODES = 30
_DIGITS = 15
_MOST_MEMBERS = 20_000_000  # of a component; a file of a few lines must not fill the memory
_PLAIN = "write it with CDWRITE,DB and blocks (not UNBLOCKED)"


def read_ansys(path: Path, name: str) -> RawMesh:
    """Read an archive.

    Parameters
    ----------
    path : Path
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: faulty or missing blocks.
    """
    with TextFile(path, name, Cause.NOT_READABLE) as file:
        return _Reader(file).mesh()


class _Reader:
    def __init__(self, file: TextFile) -> None:
        self._file = file
        self._mesh = LabelledMesh()
        self._types: dict[int, int] = {}
        self._first_option: dict[int, int] = {}
        self._elements: list[tuple[int, int, int, list[int]]] = []  # number, type, material, nodes
        self._left: Counter[str] = Counter()
        self._where: dict[str, int] = {}

    def mesh(self) -> RawMesh:
        blocks = {"NBLO": self._nodes, "EBLO": self._block, "CMBL": self._component}
        command = ""
        while (line := self._file.line()) is not None:
            if (marked := _IN_COLUMNS.fullmatch(line)) is not None:
                line = marked[1] if marked[2] == "S" and marked[3] != "1" else "!"
            match = _COMMAND.match(line.partition("!")[0])
            if match is None:
                if command[:4] in blocks and line.partition("!")[0].strip():
                    raise self._fault("numbers behind the end of a block", line)
                continue
            command = "*SET" if _ASSIGNMENT.match(line) else match[1].upper()
            fields = [f.strip() for f in line.partition("!")[0].split(",")]
            if command[:4] in blocks:
                blocks[command[:4]](fields)
            elif command == "ETBLOCK":
                self._type_block()
            elif command == "ET":
                self._type(fields)
            elif command[:4] == "KEYO" and len(fields) > 3 and fields[2] == "1":
                self._first_option[self._integer(fields[1])] = self._integer(fields[3])
            elif command in ("N", "E", "EN") and "-1" not in fields:
                raise self._fault(f"nodes and elements one by one ({command}) are not read", line, _PLAIN)
            else:
                self._left[command] += 1
                self._where.setdefault(command, self._file.number)
        if not self._mesh.points:
            raise self._fault("it has no block of nodes (NBLOCK)")
        return self._raw()

    def _fault(self, message: str, value: str | None = None, remedy: str = "write the archive again") -> FEImportError:
        file, text = self._file, f"cannot be read as a mesh: {message}"
        return file.failure(text, line=file.number, value=shortened(value) if value else None, remedy=remedy)

    def _line(self) -> str:
        line = self._file.line()
        if line is None:
            raise self._fault("the file ends within a block: it is cut off")
        return line

    def _integer(self, text: str) -> int:
        text = text.strip()
        if not (text.lstrip("-").isdigit() and len(text) <= _DIGITS):
            raise self._fault("a whole number expected", text)
        return int(text)

    def _format(self) -> tuple[list[int], int]:
        """Widths of the integers and of the reals of a block, from the format in front of it."""
        line = self._line()
        match = _FORMAT.match(line.strip())
        if match is None:
            raise self._fault("the format of a block is not understood", line)
        widths = [int(match[2])] * min(int(match[1] or 1), 100)
        widths += [int(match[4])] * min(int(match[3] or 1), 100) if match[4] else []
        if not widths or min(widths) < 1:
            raise self._fault("the format of a block has no whole numbers", line)
        return widths, int(match[5] or 0)

    def _integers(self, line: str, width: int) -> list[int]:
        text = line.rstrip()
        return [self._integer(text[at : at + width]) for at in range(0, len(text), width)]

    def _type(self, fields: list[str]) -> None:
        number = re.sub(r"^[A-Za-z]+", "", fields[2]) if len(fields) > 2 else ""  # SOLID186 or 186
        if number:
            self._types[self._integer(fields[1])] = self._integer(number)
        if len(fields) > 3 and fields[3]:
            self._first_option[self._integer(fields[1])] = self._integer(fields[3])

    def _type_block(self) -> None:
        widths, _ = self._format()
        while (line := self._line()).strip() != "-1":
            number, kind, *options = (*self._integers(line[: 3 * widths[0]], widths[0]), 0, 0)[:3]
            self._types[number] = kind
            self._first_option[number] = options[0] if options else 0

    def _nodes(self, fields: list[str]) -> None:
        """NBLOCK: number, two more integers (or none), coordinates, of which zeros at the end are left out."""
        widths, real = self._format()
        before = sum(widths)
        if not real:
            raise self._fault("the format of a block of nodes has no reals")
        while True:
            line = self._line().rstrip()
            if line.lstrip().startswith(("N,", "-1")):
                break
            texts = [line[at : at + real].strip() for at in range(before, before + 3 * real, real)]
            try:
                position = tuple(float(t.upper().replace("D", "E")) if t else 0.0 for t in texts)
            except ValueError:
                position = (math.nan,)
            if not all(map(math.isfinite, position)) or "_" in line:
                raise self._fault("three coordinates expected", line)
            try:
                self._mesh.add_point(self._integer(line[: widths[0]]), position)
            except ValueError as problem:
                raise self._fault(str(problem)) from None
        stated = [f for f in fields[3:] if f]
        if len(stated) == 2 and self._integer(stated[1]) not in (0, len(self._mesh.points)):
            raise self._fault("NBLOCK states another count of nodes", f"{len(self._mesh.points)}, stated {stated[1]}")

    def _block(self, fields: list[str]) -> None:
        """EBLOCK of the form SOLID: eleven numbers, then the nodes, on further lines where they are many."""
        if len(fields) < 3 or fields[2].upper() != "SOLID":
            raise self._fault("an EBLOCK that is not of the form SOLID", ",".join(fields), _PLAIN)
        widths, _ = self._format()
        found = 0
        while (line := self._line()).strip() != "-1":
            record = self._integers(line, widths[0])
            if len(record) < _HEADER + 1 or not 0 < record[8] <= _MOST_NODES:
                raise self._fault("the record of an element is too short, or has too many nodes", line)
            nodes = record[_HEADER:]
            while len(nodes) < record[8]:
                nodes += self._integers(self._line(), widths[0])
            if len(nodes) != record[8]:
                raise self._fault(f"an element has more nodes than its {record[8]}", line)
            self._elements.append((record[10], record[1], record[0], nodes))
            found += 1
        stated = [f for f in fields[3:] if f]
        if len(stated) == 2 and self._integer(stated[1]) not in (0, found):
            raise self._fault("EBLOCK states another count of elements", f"{found}, stated {stated[1]}")

    def _component(self, fields: list[str]) -> None:
        """CMBLOCK: numbers of nodes or elements; a negative one ends a range."""
        if len(fields) < 4:
            raise self._fault("CMBLOCK needs a name, NODE or ELEM, and a count", ",".join(fields))
        widths, _ = self._format()
        count = self._integer(fields[3])
        found: list[int] = []
        while len(found) < count:
            found += self._integers(self._line(), widths[0])
        members: list[int] = []
        for number in found:
            if number < 0 and members and members[-1] <= -number <= members[-1] + 10_000_000:
                members += range(members[-1] + 1, -number + 1)
                if len(members) > _MOST_MEMBERS:
                    raise self._fault("a component has more members than a mesh", str(len(members)))
            elif number > 0:
                members.append(number)
            else:
                raise self._fault("a range of a component does not rise", str(number))
        if len(found) != count:
            raise self._fault("a component has another count than it states", ",".join(fields))
        sets = {"NODE": self._mesh.node_sets, "ELEM": self._mesh.element_sets}.get(fields[2][:4].upper())
        if sets is not None:  # others are of points, lines, areas of a geometry
            sets.setdefault(fields[1], []).extend(members)

    def _raw(self) -> RawMesh:
        real_solids = any(self._types.get(kind) in SOLIDS for _, kind, _, _ in self._elements)
        others: Counter[int] = Counter()
        for label, kind, material, nodes in self._elements:
            ansys = self._types.get(kind)
            if ansys is None:
                raise self._fault(f"element {label} is of type {kind}, which no ET defines")
            most = SOLIDS.get(ansys, 0)
            if ansys == MESHING and not real_solids:
                most = MESHING_SOLIDS.get(self._first_option.get(kind, 0), 0)
            if not most:
                others[ansys] += 1
                continue
            shape = solid_nodes(nodes, most)
            if shape is None:
                raise self._fault(
                    f"element {label} (type {ansys}) lacks corners or some of its middle nodes",
                    " ".join(map(str, nodes)),
                    "keep the middle nodes of all edges, or of none (EMID)",
                )
            try:
                self._mesh.add_cell(MESH_ELEMENTS[shape[0]].meshio_name, 3, label, shape[1])
            except ValueError as problem:
                raise self._fault(str(problem)) from None
            self._mesh.element_sets.setdefault(f"MAT:{material}", []).append(label)
            self._mesh.element_sets.setdefault(f"TYPE:{kind}", []).append(label)
        try:
            raw = self._mesh.raw()
        except ValueError as problem:
            raise self._fault(str(problem)) from None
        for kind, count in others.items():
            text = "" if kind == MESHING else type_loss(kind)
            raw.left_out.append(LeftOut(f"elements of type {kind}", count, "EBLOCK", text))
        lost = [command for command in self._left if command_loss(command)]
        for command in lost:
            where, loss = f"line {self._where[command]}", command_loss(command)
            raw.left_out.append(LeftOut(command, self._left[command], where, loss))
        if rest := self._left.total() - sum(self._left[command] for command in lost):
            raw.left_out.append(LeftOut("commands of the analysis", rest, "all of the archive"))
        return raw
