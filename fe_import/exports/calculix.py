"""CalculiX: matrices of ``*FREQUENCY, SOLVER=MATRIXSTORAGE`` with the deck that made them.

``.sti`` and ``.mas`` hold the upper triangle column by column, one ``i j value`` per line, down to the last diagonal
entry; ``.dof`` names each row by ``node.direction``. Rows are displacements along the global axes: *TRANSFORM turns
loads and constraints only. Dofs held by *BOUNDARY, and the dependent ones of equations, have no rows.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError, shortened
from fe_import.exports.base import Export, ExportFormat, NoOptions
from fe_import.exports.dofs import COMPONENTS, dof_map_of_rows
from fe_import.exports.entries import matrix_of_entries
from fe_import.exports.frd_mesh import POSITIONS, is_frd, read_frd
from fe_import.exports.inp_elements import picture
from fe_import.exports.inp_mesh import InpMesh, read_inp
from fe_import.exports.row_files import read_sets
from fe_import.files.text import TextFile
from fe_import.model import IntArray

_ROW = re.compile(r"(\d{1,15})\.(\d{1,4})")  # as text: 4.10 is not 4.1
_EQUATIONS = ("EQUATION", "MPC", "RIGID BODY", "TIE", "COUPLING", "KINEMATIC", "DISTRIBUTING", "DISTRIBUTING COUPLING")


def read_calculix(files: Mapping[str, Path], options: Any, where: str) -> Export:
    """Read stiffness, mass, dofs and the deck with nodes, elements and sets (or the results, and sets beside them).

    Raises
    ------
    FEImportError
        ``EXPORT``, ``NOT_READABLE``: faulty files, or files of different runs; ``GROUNDED``: nodes without rows.
    """
    mesh = _read_mesh(files, where)
    nodes, components = _read_dofs(files["dofs"])
    dof_map = dof_map_of_rows(nodes, components, mesh.labels, str(files["dofs"]))
    _refuse_held(mesh, dof_map, files)
    stiffness, entries = _read_matrix(files["stiffness"], len(nodes))
    mass, others = _read_matrix(files["mass"], len(nodes))
    if entries != others:  # CalculiX writes both with one pattern
        raise FEImportError(
            Cause.EXPORT,
            "stiffness and mass have different numbers of entries",
            where=str(files["mass"]),
            value=others,
            limit=entries,
            remedy="one is cut off, or they come from different runs: export both again",
        )
    lines, triangles = picture(mesh.elements)
    notes = {"program": "CalculiX, SOLVER=MATRIXSTORAGE"}
    if is_frd(files["mesh"]):
        notes["positions"] = POSITIONS
    if mesh.keywords["TRANSFORM"]:
        notes["frames"] = "*TRANSFORM does not turn the rows of these matrices"
    if mesh.unread:
        notes["not drawn"] = ", ".join(f"elements {kind}" for kind in sorted(mesh.unread))
    return Export(
        mass,
        stiffness,
        mesh.nodes,
        mesh.labels,
        dof_map,
        node_sets=mesh.node_sets,
        lines=lines,
        triangles=triangles,
        notes=notes,
    )


def _read_mesh(files: Mapping[str, Path], where: str) -> InpMesh:
    """The deck, or nodes and elements of results with sets from a file."""
    if not is_frd(files["mesh"]):
        if "sets" in files:
            raise FEImportError(
                Cause.BAD_FIELD,
                "a deck holds its own sets",
                where=f"{where}: matrices.files.sets",
                value=files["sets"].name,
                remedy="remove it, or give an .frd file as 'mesh'",
            )
        return read_inp(files["mesh"])
    mesh = read_frd(files["mesh"])
    sets = read_sets(files["sets"], mesh.labels) if "sets" in files else {}
    return replace(mesh, node_sets=sets)


def _read_dofs(path: Path) -> tuple[IntArray, IntArray]:
    """Node number and component (0 ... 2) of each row."""
    nodes, components = [], []
    with TextFile(path) as file:
        while (line := file.line()) is not None:
            text = line.strip()
            match = _ROW.fullmatch(text)
            if not match or int(match[2]) not in (1, 2, 3):
                raise file.failure(
                    "expected node.direction, the direction from 1 to 3",
                    line=file.number,
                    value=shortened(text),
                    remedy="give the .dof file; only displacements can be imported, no temperatures",
                )
            nodes.append(int(match[1]))
            components.append(int(match[2]) - 1)
        if not nodes:
            raise file.failure("no rows", remedy="give the .dof file of the run")
    return np.array(nodes, dtype=np.int64), np.array(components, dtype=np.int64)


def _read_matrix(path: Path, size: int) -> tuple[sp.csc_array, int]:
    """Both triangles, and the number of entries of the one in the file."""
    with TextFile(path) as file:
        table = file.rows(3)
    rows, columns = (table.integers(k, "a row or column", str(path)) - 1 for k in (0, 1))
    last = (int(rows[-1]) + 1, int(columns[-1]) + 1) if len(rows) else (0, 0)
    matrix = matrix_of_entries(
        rows, columns, table.values[:, 2], size, lambda k: f"{path}: line {table.lines[k]}", triangle=True
    )
    if last != (size, size):
        raise FEImportError(
            Cause.EXPORT,
            "the last entry is not the last one on the diagonal: the file is cut off, or belongs to other dofs",
            where=str(path),
            value=f"row {last[0]}, column {last[1]}",
            limit=f"{size} dofs",
            remedy="take .sti, .mas and .dof of one run",
        )
    return matrix, len(rows)


def _refuse_held(mesh: InpMesh, dof_map: IntArray, files: Mapping[str, Path]) -> None:
    """Nodes of elements without all three displacements are held, or follow others by equations."""
    used = mesh.element_nodes()
    held = used[(dof_map[used, :3] < 0).any(axis=1)]
    if not len(held):
        return
    missing = [COMPONENTS[c] for c in np.flatnonzero(dof_map[held[0], :3] < 0)]
    equations = [f"*{name}" for name in _EQUATIONS if mesh.keywords[name]]
    follows = f"dependent in {' and '.join(equations)} of the deck" if equations else "dependent in an equation"
    raise FEImportError(
        Cause.GROUNDED,
        f"{len(held)} nodes of elements have dofs without rows: held by *BOUNDARY, or {follows}",
        where=str(files["dofs"]),
        value=f"node {mesh.labels[held[0]]} lacks {', '.join(missing)}; nodes "
        + ", ".join(str(mesh.labels[k]) for k in held[:10]),
        remedy="export the free link without supports and equations; interfaces couple faces here",
    )


CALCULIX = ExportFormat(
    required=("stiffness", "mass", "dofs", "mesh"), optional=("sets",), options=NoOptions, read=read_calculix
)
