"""Nastran OUTPUT4 files, binary: both matrices, sparse columns (BIGMAT), with text files of rows and nodes.

Records stand between two copies of their length; a column is a list of strings of consecutive values, each behind its
length in words plus one and its first row; the number of rows is negative for this layout (MSC Nastran, DMAP module
OUTPUT4).
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import IO

import numpy as np
import scipy.sparse as sp

from fe_import.writers.base import MatrixFormat, Written, WrittenLink
from fe_import.writers.row_files import write_rows

_NAMES = {"stiffness": "KAAX", "mass": "MAAX"}
_SYMMETRIC, _DOUBLE = 6, 2


def write_nastran_op4(link: WrittenLink, folder: Path, stem: str) -> Written:
    """``STEM.op4`` with KAAX and MAAX, rows and nodes."""
    name = f"{stem}.op4"
    with (folder / name).open("wb") as file:
        for role, matrix in (("stiffness", link.stiffness), ("mass", link.mass)):
            _matrix(file, _NAMES[role], matrix)
    return Written({"stiffness": name, **write_rows(link, folder, stem)}, _NAMES)


def _record(file: IO[bytes], *parts: bytes) -> None:
    body = b"".join(parts)
    mark = struct.pack("<i", len(body))
    file.write(mark + body + mark)


def _matrix(file: IO[bytes], name: str, matrix: sp.csc_array) -> None:
    matrix = sp.csc_array(matrix)
    matrix.sort_indices()
    size = matrix.shape[0]
    _record(file, struct.pack("<4i", size, -size, _SYMMETRIC, _DOUBLE), name.ljust(8).encode("ascii"))
    for column in range(size):
        rows = matrix.indices[matrix.indptr[column] : matrix.indptr[column + 1]]
        values = matrix.data[matrix.indptr[column] : matrix.indptr[column + 1]].astype("<f8")
        if not len(rows):
            continue
        strings = []
        for part in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) > 1) + 1):
            strings.append(struct.pack("<2i", 2 * len(part) + 1, int(rows[part[0]]) + 1) + values[part].tobytes())
        body = b"".join(strings)
        _record(file, struct.pack("<3i", column + 1, 0, len(body) // 4), body)
    _record(file, struct.pack("<3i", size + 1, 1, 2), struct.pack("<d", 1.0))


NASTRAN_OP4 = MatrixFormat(".op4", write_nastran_op4)
