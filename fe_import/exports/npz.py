"""Matrices of ``scipy.sparse.save_npz``, with text files that name their rows and nodes.

Nothing is unpickled, and every array's declared size is held against that of its entry in the file before it is read.
"""

from __future__ import annotations

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError, shortened
from fe_import.exports.base import Export, ExportFormat, NoOptions
from fe_import.exports.entries import matrix_of_entries
from fe_import.exports.row_files import export_of_rows

_MOST_RATIO = 1000  # an entry over its compressed size; mass matrices are full of zeros
_FREE_BYTES = 50_000_000
_MOST_BYTES = 20_000_000_000
_FAULTS = (OSError, ValueError, KeyError, RuntimeError, EOFError, zipfile.BadZipFile, zlib.error, tokenize.TokenError)
_FORMATS = {"csc": ("indices", "indptr"), "csr": ("indices", "indptr"), "coo": ("row", "col")}


def read_npz(files: Mapping[str, Path], options: Any, where: str) -> Export:
    """Read stiffness, mass, dofs, and nodes or a mesh.

    Raises
    ------
    FEImportError
        ``EXPORT``, ``NOT_READABLE``: faulty files, or files that do not belong together; ``BAD_FIELD``: no nodes.
    """
    return export_of_rows(files, where, read_sparse, "scipy.sparse.save_npz")


def read_sparse(path: Path, size: int) -> sp.csc_array:
    """A (size, size) matrix, all its entries in the file.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: not such a file; ``EXPORT``: another size or format, faulty indices, values not finite.
    """
    where = str(path)
    try:
        with zipfile.ZipFile(path) as archive:
            form = str(_array(archive, "format", where).astype("U").reshape(-1)[0])
            if form not in _FORMATS:
                raise _fault("this sparse format is not read", where, shortened(form), "save matrix.tocsc()")
            shape = _array(archive, "shape", where).reshape(-1).tolist()
            if shape != [size, size]:
                remedy = "take matrices and dofs of one export"
                raise _fault("the matrix does not fit the dofs", where, shape, remedy, size)
            first, second = (_indices(_array(archive, name, where), name, where) for name in _FORMATS[form])
            values = _array(archive, "data", where)
    except _FAULTS as problem:
        raise FEImportError(
            Cause.NOT_READABLE,
            f"cannot be read as a sparse matrix: {shortened(str(problem))}",
            where=where,
            remedy="write it with scipy.sparse.save_npz",
        ) from None
    if values.ndim != 1 or values.dtype.kind not in "fiu" or not np.isfinite(values).all():
        raise _fault("values must be finite real numbers", where, str(values.dtype), "save real matrices")
    if form != "coo":
        grows = len(second) == size + 1 and second[0] == 0 and (np.diff(second) >= 0).all()
        if not grows or second[-1] != len(values):
            raise _fault("faulty index pointer", where, None, "save the matrix again")
        second = np.repeat(np.arange(size), np.diff(second))
    if not len(first) == len(second) == len(values):
        raise _fault("indices and values differ in number", where, None, "save the matrix again")
    rows, columns = (first, second) if form != "csr" else (second, first)
    return matrix_of_entries(
        rows, columns, values.astype(float), size, lambda k: f"{where}: entry {k + 1}", triangle=False
    )


def _array(archive: zipfile.ZipFile, name: str, where: str) -> Any:
    entry = archive.getinfo(f"{name}.npy")
    if entry.file_size > min(max(_FREE_BYTES, _MOST_RATIO * entry.compress_size), _MOST_BYTES):
        message = f"array {name!r} unpacks to far more than matrices do"
        raise _fault(message, where, f"{entry.file_size} bytes", "save the matrix again")
    with archive.open(entry) as stream:
        data = stream.read(entry.file_size + 1)
    buffer = io.BytesIO(data)
    version = np.lib.format.read_magic(buffer)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read_header(buffer)
    if dtype.hasobject or math.prod(shape) * dtype.itemsize != len(data) - buffer.tell():
        message = f"array {name!r} holds objects, or is not as long as it says"
        raise _fault(message, where, f"{shape} {shortened(str(dtype))}", "save the matrix again")
    return np.frombuffer(data, dtype=dtype, offset=buffer.tell(), count=math.prod(shape)).reshape(
        shape, order="F" if fortran else "C"
    )


def _indices(values: Any, name: str, where: str) -> Any:
    if values.ndim != 1 or values.dtype.kind not in "iu":
        raise _fault(f"array {name!r} must hold whole numbers", where, str(values.dtype), "save the matrix again")
    return values.astype(np.int64)


def _fault(message: str, where: str, value: Any, remedy: str, limit: Any = None) -> FEImportError:
    return FEImportError(Cause.EXPORT, message, where=where, value=value, limit=limit, remedy=remedy)


NPZ = ExportFormat(
    required=("stiffness", "mass", "dofs"), optional=("nodes", "mesh", "sets"), options=NoOptions, read=read_npz
)
