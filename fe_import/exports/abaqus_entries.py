"""Abaqus ``*MATRIX GENERATE`` text output: one entry per line, rows and columns by node and dof, or by number.

FORMAT=MATRIX INPUT and LABELS: ``node, dof, node, dof, value``; symmetric matrices hold one of each pair.
FORMAT=COORDINATE: ``row, column, value``, all entries; which node a row belongs to is not in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.exports.entries import matrix_of_entries
from fe_import.files.text import Rows, TextFile
from fe_import.model import IntArray

_HIGHEST_LABEL = 999_999_999  # of a user's node; what lies outside Abaqus made itself
_FIXED = 1e30  # Abaqus writes 1e36 on the diagonal of a fixed dof


@dataclass(frozen=True)
class Entries:
    """Entries of one file: row and column codes (8 · node + dof, or the number of the row) and values."""

    path: str
    rows: IntArray
    columns: IntArray
    table: Rows
    labelled: bool

    def place(self, entry: int) -> str:
        """File and line of an entry."""
        return f"{self.path}: line {self.table.lines[entry]}"

    def matrix(self, codes: IntArray) -> sp.csc_array:
        """The matrix over rows with the given rising codes; one triangle when no pair stands twice."""
        if self.labelled:
            i, j = np.searchsorted(codes, self.rows), np.searchsorted(codes, self.columns)
        else:
            i, j = self.rows - 1, self.columns - 1
        off = i != j
        low, high = np.minimum(i, j)[off], np.maximum(i, j)[off]
        triangle = len(np.unique(low * len(codes) + high)) == off.sum()
        return matrix_of_entries(i, j, self.table.values[:, -1], len(codes), self.place, triangle=triangle)


def read_entries(path: Path) -> Entries:
    """Entries of a file in any of the three formats.

    Raises
    ------
    FEImportError
        ``EXPORT``: not such a file, rows of nodes that Abaqus made itself, a dof that is no displacement or rotation;
        ``GROUNDED``: a fixed dof.
    """
    with TextFile(path) as text:
        line = text.line()
        while line is not None and (not line.strip() or line.lstrip().startswith("*")):
            line = text.line()
    columns = 0 if line is None else len(line.replace(",", " ").split())
    if columns not in (3, 5):
        raise FEImportError(
            Cause.EXPORT,
            "not a matrix of *MATRIX OUTPUT",
            where=str(path),
            value=f"{columns} numbers in a line",
            limit="node, dof, node, dof, value or row, column, value",
            remedy="write it with *MATRIX OUTPUT, FORMAT=MATRIX INPUT, or name the file of the right role",
        )
    with TextFile(path) as text:
        table = text.rows(columns, comment="*", separators=",")
    indices = [table.integers(k, "a node, dof, row or column", str(path)) for k in range(columns - 1)]
    if columns == 3:
        found = Entries(str(path), indices[0], indices[1], table, False)
    else:
        for node, dof in (indices[:2], indices[2:]):
            _check_labels(node, dof, str(path))
        found = Entries(str(path), 8 * indices[0] + indices[1], 8 * indices[2] + indices[3], table, True)
    _refuse_fixed(found)
    return found


def _check_labels(node: IntArray, dof: IntArray, path: str) -> None:
    own = (node <= 0) | (node > _HIGHEST_LABEL)
    if own.any():
        raise FEImportError(
            Cause.EXPORT,
            f"{len(np.unique(node[own]))} nodes of the matrix are internal to Abaqus (Lagrange multipliers, internal "
            "dofs of elements), so they have no position",
            where=path,
            value=np.unique(node[own])[:5].tolist(),
            remedy="use elements and couplings without internal dofs (B31, C3D10, *MPC BEAM), or export a substructure",
        )
    other = (dof < 1) | (dof > 6)
    if other.any():
        raise FEImportError(
            Cause.EXPORT,
            f"node {node[int(other.argmax())]} has a dof that is no displacement or rotation",
            where=path,
            value=np.unique(dof[other])[:5].tolist(),
            limit="1 to 6",
            remedy="export a structural model: no warping (7), pressure (8) or temperature (11)",
        )


def _refuse_fixed(entries: Entries) -> None:
    fixed = (entries.rows == entries.columns) & (entries.table.values[:, -1] >= _FIXED)
    if fixed.any():
        first = int(fixed.argmax())
        code = int(entries.rows[first])
        dof = f"node {code // 8}, dof {code % 8}" if entries.labelled else f"row {code}"
        raise FEImportError(
            Cause.GROUNDED,
            f"{fixed.sum()} dofs are fixed: Abaqus marks them by a huge number on the diagonal",
            where=entries.place(first),
            value=f"{entries.table.values[first, -1]:g} at {dof}",
            remedy="remove *BOUNDARY from the model before *MATRIX GENERATE: a link must be free",
        )
