"""Text files that say which row of a matrix is which, and where the nodes are, for formats that hold numbers only.

Fields are separated by blanks, commas or semicolons; ``#`` starts a comment; header lines of words are skipped.

- dofs: one line per row of the matrices, in order: ``node component`` with the component ``ux uy uz rx ry rz`` (or
  ``1`` ... ``6``, or ``rotx roty rotz``), or ``modal``. Or the mapping file of Ansys: ``row node component``, in any
  order.
- nodes: ``node x y z``, or with the three angles of Ansys' NWRITE in degrees, ``node x y z thxy thyz thzx``, when the
  displacements of a node are counted in a frame of its own. Zeros at the end may be left out, as NWRITE does.
- sets: ``NAME node node ...``; a repeated name goes on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError, shortened
from fe_import.exports.base import Export
from fe_import.exports.dofs import COMPONENTS, MODAL, dof_map_of_rows
from fe_import.exports.inp_elements import picture
from fe_import.exports.inp_mesh import read_inp
from fe_import.files.text import TextFile
from fe_import.model import Array, IntArray

_INTEGER = re.compile(r"\d{1,15}\Z")
_NAMES = {name: k for k, name in enumerate(COMPONENTS)}
_NAMES |= {str(k + 1): k for k in range(6)} | {"rotx": 3, "roty": 4, "rotz": 5}


@dataclass(frozen=True)
class Place:
    """Nodes by number, as an `Export` wants them: positions, frames, sets, lines, triangles."""

    labels: IntArray
    nodes: Array
    orientations: Array | None
    node_sets: dict[str, IntArray]
    lines: IntArray
    triangles: IntArray


def _records(file: TextFile) -> Iterator[list[str]]:
    """Fields of every line that holds some."""
    while (line := file.line()) is not None:
        text = line.partition("#")[0].strip(" \t\r\f\v,;")
        separator = next((mark for mark in ",;" if mark in text), None)
        if fields := [f.strip() for f in text.split(separator)] if text else []:
            yield fields


def _real(text: str) -> float:
    try:
        return math.nan if "_" in text else float(text.upper().replace("D", "E"))
    except ValueError:
        return math.nan


def _is_header(fields: list[str]) -> bool:
    """Words only: a line with a number in it is a row, faulty or not."""
    return all(math.isnan(_real(f)) for f in fields) and not _INTEGER.match(fields[0])


def read_dofs(path: Path) -> tuple[IntArray, IntArray]:
    """Node number and component of each row.

    Returns
    -------
    nodes : (d,) int array
    components : (d,) int array
        0 ... 5, or `MODAL`.

    Raises
    ------
    FEImportError
        ``EXPORT``: a line that is none of the three kinds, or rows of a mapping file that are missing or stand twice.
    """
    nodes: list[int] = []
    components: list[int] = []
    rows: list[int] = []
    with TextFile(path) as file:
        for fields in _records(file):
            if not nodes and fields[0] != "modal" and _is_header(fields):
                continue
            if fields == ["modal"]:
                fields = ["0", "modal"]
            numbers, component = fields[:-1], fields[-1].lower()
            known = MODAL if component == "modal" else _NAMES.get(component)
            fits = len(numbers) == (2 if rows else 1) or (not nodes and len(numbers) == 2)
            if known is None or not fits or not all(_INTEGER.match(f) for f in numbers):
                raise file.failure(
                    "expected a node and a component, like '12 ux'",
                    line=file.number,
                    value=shortened(" ".join(fields)),
                    limit="components: " + ", ".join(COMPONENTS),
                    remedy="one line per row of the matrices: 'node component' or 'modal', or Ansys' 'row node "
                    "component'; other dofs than displacements and rotations cannot be imported",
                )
            nodes.append(int(numbers[-1]))
            components.append(known)
            rows += [int(numbers[0])] if len(numbers) == 2 else []
        if not nodes:
            raise file.failure("no rows", remedy="write one line per row of the matrices")
    order = np.arange(len(nodes))
    if rows:
        if sorted(rows) != list(range(1, len(rows) + 1)):
            raise FEImportError(
                Cause.EXPORT,
                "row numbers must be 1, 2, ... each once",
                where=str(path),
                value=f"{len(rows)} rows, the largest number {max(rows)}",
                remedy="export the mapping again",
            )
        order = np.argsort(rows)
    return np.array(nodes, dtype=np.int64)[order], np.array(components, dtype=np.int64)[order]


def read_place(files: Mapping[str, Path], where: str) -> Place:
    """Nodes from the file ``nodes`` or ``mesh`` (a deck), with the sets of ``sets`` added.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: not exactly one of the two files; ``EXPORT``: faulty lines, or sets of unknown nodes.
    """
    if ("nodes" in files) == ("mesh" in files):
        raise FEImportError(
            Cause.BAD_FIELD,
            "give exactly one of the files 'nodes' and 'mesh'",
            where=f"{where}: matrices.files",
            remedy='add nodes = "FILE" (node x y z) or mesh = "FILE.inp" (with elements and sets)',
        )
    if "mesh" in files:
        if files["mesh"].name.removesuffix(".gz").rpartition(".")[2].lower() not in ("inp", "deck", "dat"):
            raise FEImportError(
                Cause.EXPORT,
                "the mesh must be an input deck (.inp), which keeps the numbers of nodes",
                where=f"{where}: matrices.files.mesh",
                value=files["mesh"].name,
                remedy="write the mesh as .inp, or give the file 'nodes'",
            )
        mesh = read_inp(files["mesh"])
        lines, triangles = picture(mesh.elements)
        place = Place(mesh.labels, mesh.nodes, None, dict(mesh.node_sets), lines, triangles)
    else:
        place = _read_nodes(files["nodes"])
    if "sets" in files:
        place.node_sets.update(read_sets(files["sets"], place.labels))
    return place


def export_of_rows(
    files: Mapping[str, Path], where: str, read_matrix: Callable[[Path, int], sp.csc_array], program: str
) -> Export:
    """Matrices that hold numbers only, with rows and nodes from the files ``dofs`` and ``nodes`` or ``mesh``.

    Parameters
    ----------
    files : mapping of Path
        By role.
    where : str
        Name of the link description.
    read_matrix : callable
        Reads the square matrix of a path and a number of rows.
    program : str
        Note of who wrote the matrices.
    """
    nodes, components = read_dofs(files["dofs"])
    place = read_place(files, where)
    dof_map = dof_map_of_rows(nodes, components, place.labels, str(files["dofs"]))
    return Export(
        mass=read_matrix(files["mass"], len(nodes)),
        stiffness=read_matrix(files["stiffness"], len(nodes)),
        nodes=place.nodes,
        labels=place.labels,
        dof_map=dof_map,
        modal_rows=np.flatnonzero(components == MODAL),
        orientations=place.orientations,
        node_sets=place.node_sets,
        lines=place.lines,
        triangles=place.triangles,
        notes={"program": program},
    )


def _read_nodes(path: Path) -> Place:
    rows: list[list[float]] = []
    seen: dict[int, int] = {}
    with TextFile(path) as file:
        for fields in _records(file):
            if not rows and _is_header(fields):
                continue
            values = [_real(f) for f in fields[1:]]
            if not _INTEGER.match(fields[0]) or len(values) > 6 or not all(map(math.isfinite, values)):
                raise file.failure(
                    "expected a node and three coordinates, or also three angles",
                    line=file.number,
                    value=shortened(" ".join(fields)),
                    remedy="write 'node x y z' or 'node x y z thxy thyz thzx'",
                )
            label = int(fields[0])
            if label in seen:
                message = f"this node stands in line {seen[label]} already"
                raise file.failure(message, line=file.number, value=label, remedy="remove one")
            seen[label] = file.number
            rows.append(values + [0.0] * (6 - len(values)))
        if not rows:
            raise file.failure("no nodes", remedy="write 'node x y z' lines")
    table = np.array(rows)
    orientations = node_frames(table[:, 3:]) if table[:, 3:].any() else None
    nothing = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 3), dtype=np.int64)
    return Place(np.fromiter(seen, dtype=np.int64), table[:, :3], orientations, {}, *nothing)


def node_frames(angles: Array) -> Array:
    """(n, 3, 3) axes (columns) of nodal frames from Ansys' angles [deg].

    ``thxy`` turns about z, ``thyz`` about the new x, ``thzx`` about the new y axis.
    """
    (cz, cx, cy), (sz, sx, sy) = np.cos(np.deg2rad(angles)).T, np.sin(np.deg2rad(angles)).T
    zero, one = np.zeros_like(cz), np.ones_like(cz)

    def stacked(*entries: Array) -> Array:
        return np.stack(entries, axis=1).reshape(-1, 3, 3)

    about_z = stacked(cz, -sz, zero, sz, cz, zero, zero, zero, one)
    about_x = stacked(one, zero, zero, zero, cx, -sx, zero, sx, cx)
    about_y = stacked(cy, zero, sy, zero, one, zero, -sy, zero, cy)
    return np.asarray(about_z @ about_x @ about_y)


def read_sets(path: Path, labels: IntArray) -> dict[str, IntArray]:
    """Node sets, a line ``NAME node node ...`` each; indices into ``labels``.

    Raises
    ------
    FEImportError
        ``EXPORT``, ``NOT_READABLE``: not such a file, or a set of what is no node.
    """
    place = {int(label): k for k, label in enumerate(labels)}
    sets: dict[str, set[int]] = {}
    with TextFile(path) as file:
        for name, *members in _records(file):
            if not members:
                message = "a name and its nodes belong into one line"
                remedy = "write 'NAME node node ...'"
                raise file.failure(message, line=file.number, value=shortened(name), remedy=remedy)
            for text in members:
                node = place.get(int(text)) if _INTEGER.match(text) else None
                if node is None:
                    raise file.failure(
                        f"set {shortened(name)!r} names what is no node",
                        line=file.number,
                        value=shortened(text),
                        remedy="write 'NAME node node ...'",
                    )
                sets.setdefault(name, set()).add(node)
    return {name: np.array(sorted(members), dtype=np.int64) for name, members in sets.items()}
