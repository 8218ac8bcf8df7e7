"""Nastran DMIG entries in bulk data: grid points and both matrices, fields of sixteen columns.

Sixteen columns leave ten digits of a value.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import scipy.sparse as sp

from fe_import.model import IntArray
from fe_import.writers.base import MARK, MatrixFormat, Written, WrittenLink, lower_columns

_NAMES = {"stiffness": "KAAX", "mass": "MAAX"}


def write_nastran_dmig(link: WrittenLink, folder: Path, stem: str) -> Written:
    """``STEM.pch`` with GRID, SPOINT, KAAX and MAAX."""
    name, points = f"{stem}.pch", link.points()
    with (folder / name).open("w", encoding="ascii") as file:
        file.write(f"$ {MARK}\n")
        for label, (x, y, z) in zip(link.labels.tolist(), link.positions.tolist(), strict=True):
            file.write(f"GRID*   {label:16d}{'':16s}{_real(x)}{_real(y)}\n*       {_real(z)}\n")
        file.writelines(f"SPOINT  {number:8d}\n" for number, component in points.tolist() if not component)
        for role, matrix in (("stiffness", link.stiffness), ("mass", link.mass)):
            file.writelines(_cards(_NAMES[role], matrix, points))
    return Written({"stiffness": name}, _NAMES)


def _real(value: float) -> str:
    """Sixteen columns with a D for the exponent."""
    text = f"{value:16.9E}".replace("E", "D")
    return text if len(text) <= 16 else f"{value:16.8E}".replace("E", "D")


def _cards(name: str, matrix: sp.csc_array, points: IntArray) -> Iterator[str]:
    yield f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}\n"
    for column, rows, values in lower_columns(matrix):
        number, component = points[column]
        yield f"DMIG*   {name:16s}{number:16d}{component:16d}\n"
        for row, value in zip(rows.tolist(), values.tolist(), strict=True):
            yield f"*       {points[row, 0]:16d}{points[row, 1]:16d}{_real(value)}\n"


NASTRAN_DMIG = MatrixFormat(".pch", write_nastran_dmig)
