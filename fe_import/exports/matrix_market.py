"""Matrix Market files (``.mtx``) of stiffness and mass, with text files that name their rows and nodes.

Coordinate and array format, real or integer, general or symmetric. A symmetric file gives each pair (i, j) once, on
whichever side of the diagonal. See `fe_import.exports.row_files` for the other files.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.exports.base import Export, ExportFormat, NoOptions
from fe_import.exports.entries import matrix_of_entries
from fe_import.exports.row_files import export_of_rows
from fe_import.files.text import Rows, TextFile

_CHOICES = (("matrix",), ("coordinate", "array"), ("real", "integer", "double"), ("general", "symmetric"))
_REMEDY = "write a real matrix, coordinate or array, general or symmetric"


def read_matrix_market(files: Mapping[str, Path], options: Any, where: str) -> Export:
    """Read stiffness, mass, dofs, and nodes or a mesh.

    Raises
    ------
    FEImportError
        ``EXPORT``, ``NOT_READABLE``: faulty files, or files that do not belong together; ``BAD_FIELD``: no nodes.
    """
    return export_of_rows(files, where, read_matrix, "Matrix Market")


def read_matrix(path: Path, size: int) -> sp.csc_array:
    """A (size, size) matrix with both triangles.

    Raises
    ------
    FEImportError
        ``EXPORT``: another size, kind or number of entries than declared, duplicates, numbers that are not finite.
    """
    with TextFile(path) as file:
        layout, symmetry = _header(file)
        declared = _sizes(file, 3 if layout == "coordinate" else 2)
        if declared[0] != declared[1] or declared[0] != size:
            raise file.failure(
                "the matrix does not fit the dofs",
                line=file.number,
                value=f"{declared[0]} x {declared[1]}",
                limit=f"{size} rows of dofs",
                remedy="take matrices and dofs of one export",
            )
        triangle = symmetry == "symmetric"
        if layout == "coordinate":
            table = file.rows(3, count=declared[2])
        else:
            table = file.rows(1, count=size * (size + 1) // 2 if triangle else size * size)
        _refuse_more(file)
    if layout == "coordinate":
        rows, columns = (table.integers(k, "a row or column", str(path)) - 1 for k in (0, 1))
    else:  # column by column, symmetric ones from the diagonal down
        columns, rows = np.triu_indices(size) if triangle else np.divmod(np.arange(size * size), size)
    return matrix_of_entries(rows, columns, table.values[:, -1], size, _line(path, table), triangle=triangle)


def _line(path: Path, table: Rows) -> Any:
    return lambda k: f"{path}: line {table.lines[k]}"


def _header(file: TextFile) -> tuple[str, str]:
    """Layout (coordinate, array) and symmetry."""
    words = (file.line() or "").lower().split()
    if not words or words[0] != "%%matrixmarket" or len(words) != 5:
        message = "expected '%%MatrixMarket matrix LAYOUT FIELD SYMMETRY'"
        raise file.failure(message, line=1, remedy="give a Matrix Market file; " + _REMEDY)
    for word, known in zip(words[1:], _CHOICES, strict=True):
        if word not in known:
            message = "this kind of matrix cannot be mass or stiffness"
            raise file.failure(message, line=1, value=word, limit=", ".join(known), remedy=_REMEDY)
    return words[2], words[4]


def _sizes(file: TextFile, count: int) -> list[int]:
    """The line of declared sizes behind the comments."""
    while (line := file.line()) is not None and (not line.strip() or line.startswith("%")):
        pass
    words = (line or "").split()
    if len(words) != count or not all(w.isascii() and w.isdigit() and len(w) < 16 for w in words):
        message = f"expected {count} whole numbers: " + ("rows, columns, entries" if count == 3 else "rows, columns")
        raise file.failure(message, line=max(file.number, 1), value=(line or "").strip()[:60], remedy=_REMEDY)
    return [int(w) for w in words]


def _refuse_more(file: TextFile) -> None:
    while (line := file.line()) is not None:
        if line.strip():
            raise file.failure("more entries than declared", line=file.number, remedy="export the matrix again")


MATRIX_MARKET = ExportFormat(
    required=("stiffness", "mass", "dofs"),
    optional=("nodes", "mesh", "sets"),
    options=NoOptions,
    read=read_matrix_market,
)
