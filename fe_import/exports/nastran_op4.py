"""Nastran OUTPUT4 files, text or binary: matrices by name, their rows by a list of grid points or a file of dofs.

pyyeti reads the values (an optional dependency), after `fe_import.exports.nastran_op4_layout` has found the file whole.
An OUTPUT4 file says nothing about its rows.
"""

from __future__ import annotations

import gzip
import importlib
import tempfile
import warnings
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import scipy.sparse as sp

from fe_import.description.base import Vector
from fe_import.errors import Cause, FEImportError
from fe_import.exports.base import Export, ExportFormat
from fe_import.exports.nastran_dmig import nastran_points
from fe_import.exports.nastran_op4_layout import Op4Header, op4_layout
from fe_import.exports.points import MODAL, rows_of
from fe_import.exports.superelement import assembled
from fe_import.model import IntArray

_BLOCK = 1_000_000
_MOST_RATIO = 200  # of a gzip file; matrices have 2 to 20
_SYMMETRIC = 6
_ROUNDING = 1e-9  # relative: both triangles of a symmetric matrix are written from one


class Op4Options(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What OUTPUT4 matrices of Nastran leave open.

    Attributes
    ----------
    stiffness, mass : str
        Names of the matrices.
    boundary : list of int
        Grid points of the first rows, six each, before rows of modal coordinates.
    positions : dict of (3,) floats
        Of grid points by number [m], when no file holds them.
    """

    stiffness: str = "KAAX"
    mass: str = "MAAX"
    boundary: list[int] = []
    positions: dict[str, Vector] = {}


def read_op4(files: Mapping[str, Path], options: Op4Options, where: str) -> Export:
    """Read the two matrices and say what their rows are. See `ExportFormat.read`."""
    wanted = {"stiffness": options.stiffness.lower(), "mass": options.mass.lower()}
    with tempfile.TemporaryDirectory() as folder:
        whole: dict[str, Path] = {}
        headers: dict[str, Op4Header] = {}
        for role, name in wanted.items():
            source = files.get(role, files["stiffness"])
            whole[role] = _unpacked(source, Path(folder) / role)
            headers[role] = _header(op4_layout(whole[role], str(source)), name, role, str(source))
            if headers[role].columns >= whole[role].stat().st_size:  # every column of a link's matrix has an entry
                message = "a header states a matrix that the file has no room for"
                raise _fault(message, str(source), headers[role].columns, whole[role].stat().st_size)
        size = headers["stiffness"].columns
        if headers["mass"].columns != size:
            raise _fault("mass and stiffness differ in size", str(files["stiffness"]), headers["mass"].columns, size)
        rows = _rows(files, options, size, where)
        matrices = {
            role: _values(whole[role], headers[role], str(files.get(role, files["stiffness"]))) for role in wanted
        }
    points = nastran_points(files, options.positions, where)
    notes = {"program": "Nastran, OUTPUT4", "matrices": ", ".join(wanted.values()).upper()}
    return assembled(matrices["mass"], matrices["stiffness"], rows, points, str(files["stiffness"]), notes)


def _fault(message: str, where: str, value: Any = None, limit: Any = None, remedy: str = "") -> FEImportError:
    return FEImportError(Cause.EXPORT, message, where=where, value=value, limit=limit, remedy=remedy or "export again")


def _unpacked(path: Path, copy: Path) -> Path:
    """The file, or a copy of what a gzip file holds."""
    try:
        with path.open("rb") as file:
            if file.read(2) != b"\x1f\x8b":
                return path
        limit = max(20_000_000, _MOST_RATIO * path.stat().st_size)
        with gzip.open(path) as packed, copy.open("wb") as plain:
            while block := packed.read(_BLOCK):
                plain.write(block)
                if plain.tell() > limit:
                    raise _fault("the gzip file unpacks to far more than matrices do", str(path), None, limit)
    except (OSError, EOFError, zlib.error) as problem:
        raise FEImportError(
            Cause.NOT_READABLE, f"cannot be read: {problem}", where=str(path), remedy="export again, pack it again"
        ) from None
    return copy


def _header(headers: list[Op4Header], name: str, role: str, where: str) -> Op4Header:
    found = [h for h in headers if h.name == name]
    if len(found) != 1:
        raise _fault(
            f"{'no' if not found else 'more than one'} matrix {name.upper()} for the {role}",
            where,
            limit=", ".join(h.name.upper() for h in headers[:20]) or "no matrices",
            remedy=f"set matrices.options.{role} to the name of the matrix in the file",
        )
    header = found[0]
    if header.rows != header.columns or header.kind not in (1, 2):
        kind = "complex" if header.kind in (3, 4) else "not square"
        raise _fault(f"matrix {name.upper()} is {kind}", where, f"{header.rows} x {header.columns}")
    return header


def _rows(files: Mapping[str, Path], options: Op4Options, size: int, where: str) -> IntArray:
    if "dofs" not in files:
        return _boundary_rows(options.boundary, size, where)
    rows = rows_of(files["dofs"])
    if len(rows) != size or options.boundary:
        message = "dofs and option 'boundary' both" if options.boundary else "the dofs do not fit the matrices"
        raise _fault(message, str(files["dofs"]), f"{len(rows)} dofs", f"{size} rows", "take those of one export")
    return rows


def _boundary_rows(boundary: list[int], size: int, where: str) -> IntArray:
    """Node and component of each row: six for each grid point, then modal coordinates."""
    place = f"{where}: matrices.options.boundary"
    modal = size - 6 * len(boundary)
    if not boundary or modal < 0 or min(boundary) < 1 or max(boundary) >= 2**53:
        raise FEImportError(
            Cause.BAD_FIELD,
            "the rows of an OUTPUT4 matrix need the grid points they belong to",
            where=place,
            value=boundary[:10],
            limit=f"{size} rows",
            remedy="list those of the first rows, six each, before the modal coordinates; or give the file 'dofs'",
        )
    nodal = np.stack([np.repeat(boundary, 6), np.tile(np.arange(1, 7), len(boundary))], axis=1)
    return np.concatenate([nodal, np.stack([np.arange(1, modal + 1), np.full(modal, MODAL)], axis=1)])


def _values(path: Path, header: Op4Header, where: str) -> sp.csc_array:
    """The matrix that a header announces, read by pyyeti, against what the walk has counted."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = _pyyeti().OP4().dctload(str(path), [header.name], justmatrix=True, sparse=True)[header.name]
        matrix = sp.coo_array(found)
    except FEImportError:
        raise
    except Exception as problem:  # whatever stands in the numbers
        raise _fault(f"matrix {header.name.upper()} cannot be read: {problem}", where) from None
    if matrix.shape != (header.rows, header.columns) or matrix.nnz != header.values:
        raise _fault(f"matrix {header.name.upper()} is not whole", where, matrix.nnz, f"{header.values} values")
    if not np.isfinite(matrix.data).all():
        raise _fault(f"a number of matrix {header.name.upper()} is not finite", where)
    matrix = matrix.tocsc()
    if header.form == _SYMMETRIC and matrix.nnz:
        off = abs(matrix - matrix.T).max()
        limit = _ROUNDING * float(abs(matrix).max())
        if off > limit:
            raise _fault(f"matrix {header.name.upper()} is declared symmetric, but is not", where, float(off), limit)
    return matrix


def _pyyeti() -> Any:
    try:
        return importlib.import_module("pyyeti.nastran.op4")
    except ImportError:
        raise FEImportError(
            Cause.NOT_READABLE,
            "OUTPUT4 files are read with the package pyyeti, which is not installed",
            where="format 'nastran-op4'",
            remedy="pip install 'erls[nastran]', or export DMIG entries (format 'nastran-dmig')",
        ) from None


NASTRAN_OP4 = ExportFormat(
    required=("stiffness",), optional=("mass", "dofs", "mesh", "nodes", "sets"), options=Op4Options, read=read_op4
)
