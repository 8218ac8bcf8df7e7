"""HDF5 files, read with suspicion and written in one piece: modal files here, run files in `erls`.

Every failure is an ``error(cause, message, where="FILE: /dataset", ...)``. The enumeration of ``cause`` must
also have FILE_NOT_FOUND and NOT_READABLE, for files that cannot be opened at all.
"""

from __future__ import annotations

import contextlib
import enum
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py

from fe_import.errors import ReportedError
from fe_import.files.hdf5.audit import Limits, audit
from fe_import.files.hdf5.seal import ATTRIBUTE, seal_of
from fe_import.files.hdf5.sink import Sink
from fe_import.files.hdf5.values import REMEDY, Reader, translated, write_array, write_attribute, write_strings
from fe_import.files.output import replacing

__all__ = [
    "Reader",
    "open_for_reading",
    "write_array",
    "write_atomically",
    "write_attribute",
    "write_strings",
]


@contextlib.contextmanager
def open_for_reading(
    path: Path | str, error: type[ReportedError], cause: enum.StrEnum, *, max_bytes: float = 8e9
) -> Iterator[Reader]:
    """Reader of the root group of a file that has passed `audit`.

    When the block ends without an error, the content is held against the seal that `write_atomically` left, if there is
    one: specific faults are named first.

    Parameters
    ----------
    path : path
    error : type
        Class of the error to raise.
    cause : enum.StrEnum
        Cause of a faulty file.
    max_bytes : float
        Limit of all arrays together, uncompressed.
    """
    where, causes = str(path), type(cause)
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        raise error(causes["FILE_NOT_FOUND"], "no such file", where=where, remedy="check the path") from None
    except (OSError, ValueError) as problem:
        raise error(
            causes["NOT_READABLE"], f"cannot be read: {problem}", where=where, remedy=REMEDY
        ) from None
    if not stat.S_ISREG(status.st_mode):
        raise error(causes["NOT_READABLE"], "not a file", where=where, remedy="give the path of an HDF5 file")
    with translated(where, error, causes["NOT_READABLE"]):
        if not os.access(path, os.R_OK):
            raise error(
                causes["NOT_READABLE"], "no permission to read", where=where, remedy="change its permissions"
            )
        if not h5py.is_hdf5(path):
            raise error(causes["NOT_READABLE"], "not an HDF5 file", where=where, remedy="give an HDF5 file")
        file = h5py.File(path, "r", locking="best-effort")

    def fail(item: str, message: str, value: Any = None, limit: Any = None) -> ReportedError:
        return error(cause, message, where=f"{where}: {item}", value=value, limit=limit, remedy=REMEDY)

    try:
        with translated(where, error, cause):
            audit(file, Limits(status.st_size, max_bytes), fail)
        yield Reader(file, where, error, cause)
        with translated(where, error, cause):
            if ATTRIBUTE in file.attrs and seal_of(file) != Reader(file, where, error, cause).attribute(ATTRIBUTE, str):
                raise fail("", "the content is not what was written: damaged, or changed by hand")
    finally:
        with contextlib.suppress(Exception):  # nothing was written; a damaged file may fail to close
            file.close()


def write_atomically(
    path: Path | str, write: Callable[[h5py.Group], None], error: type[ReportedError], cause: enum.StrEnum
) -> None:
    """Write a file completely or not at all; equal content gives equal bytes.

    The file is made beside its final place, synced to disk and renamed. Whatever ``write`` raises is passed
    on (an OSError as ``error``); an existing file then stays as it was.

    Parameters
    ----------
    path : path
    write : callable
        Fills the root group.
    error, cause
        Raised when the file cannot be written (missing folder, no permission, disk full).
    """
    with replacing(path, error, cause) as temporary, Sink(temporary) as sink:
        _fill(sink, write)
    with contextlib.suppress(OSError):  # not every system syncs folders
        _sync_folder(Path(os.path.realpath(path)).parent)


def _fill(sink: Sink, write: Callable[[h5py.Group], None]) -> None:
    try:
        # v108: the oldest format whose metadata carry checksums; MATLAB and Julia read it
        with h5py.File(sink, "w", libver=("v108", "v108")) as file:
            write(file)
            write_attribute(file, ATTRIBUTE, seal_of(file))
    finally:
        if sink.problem is not None:  # what h5py makes of lost bytes is of no interest
            raise sink.problem
    sink.sync()


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
