"""What a command may write over: an earlier result of the same kind, told by its content, and nothing that it reads.

Results carry a mark: HDF5 files their schema, tables (CSV), which have no place for one, the head that this program
gives them, all others the words of `MARK`, where their format keeps remarks. ``--force`` replaces any other file, too,
but never one that the command reads.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable
from pathlib import Path

from erls.errors import SceneError
from erls.files.output import check_writable, not_writable

MARK = "written by erls"
RUN, MODAL, FAMILY = "erls run", "erls modal model", "erls parametric model"  # schemas of HDF5 files

_MARKED = re.compile(rb"written[ _]by\W{1,8}erls\b")
_BEGINS = {
    ".html": b"<!DOCTYPE html>",
    ".json": b"{",
    ".toml": b"#",
    ".stl": b"written by erls",
    ".pvd": b"<?xml",
    ".png": b"\x89PNG",
    ".jpg": b"\xff\xd8",
    ".jpeg": b"\xff\xd8",
    ".gif": b"GIF8",
    ".mp4": b"",
    ".npz": b"PK",
    ".fmu": b"PK",
    ".hdf5": b"\x89HDF",
    ".mat": b"MATLAB",
    ".sweep": b"SQLite format 3",
    ".study": b"SQLite format 3",
    ".mtx": b"",
    ".txt": b"#",
    ".pch": b"$",
    ".inp": b"**",
    ".sid_fem": b" ",
    ".op4": b"\x18",  # has no place for a mark
}
_TABLE = re.compile(
    rb'"?(t \[s\]|load \[1\]),.*(energy\.\w+ \[J\]|: energy \[J\])"?\r?\n'  # of a run, or of several
    rb'|t \[s\],"?[^\r\n]*\.inverse_effort \[N( m)?\]'  # of an inversion
    rb'|t \[s\],"?[^\r\n]*\.planned_effort \[N( m)?\]'  # of a planned motion
    rb'|phase \[1\],(.*\.z \[m\]"?)?\r?\n'  # of a mode
    rb"|formulation,elastic_modes,integrator,effects,"
    rb"|scene,formulation,deflection \[m\],"
    rb"|point,[^\r\n]*,cause,message\r?\n"  # of a sweep
)
_END = 4_000_000  # bytes at either end of a file where its mark may be; films have it behind their index


def claim(path: Path, kind: str, inputs: Iterable[Path], force: bool = False) -> None:
    """Refuse an output, before any work is done, that cannot be written or would replace what it must not.

    Parameters
    ----------
    path : Path
    kind : str
        `RUN`, `MODAL`, `FAMILY`, or the ending of the name, which says what is written.
    inputs : iterable of Path
        Files that the command reads.
    force : bool
        Replace any other file.

    Raises
    ------
    SceneError
        NOT_WRITABLE.
    """
    target = check_writable(path)
    for each in inputs:
        if _same(target, each):
            raise _replaces(path, f"it is a file that is read: {each}", "give the output another name")
    if not force and target.exists() and not _is_earlier(target, kind):
        what = {RUN: "run file", MODAL: "modal file", FAMILY: "file of a family of links"}.get(kind, f"{kind} file")
        message = f"there is a file of that name, which is no {what} that erls wrote"
        raise _replaces(path, message, "give another name, move it away, or replace it with --force")


def _replaces(path: Path, problem: str, remedy: str) -> SceneError:
    return not_writable(path, problem, remedy)


def _same(target: Path, other: Path) -> bool:
    """Whether both are one file, through links of either kind, or would be."""
    with contextlib.suppress(OSError, ValueError):
        if os.path.samefile(target, other):
            return True
    return os.path.realpath(other) == str(target)


def _is_earlier(target: Path, kind: str) -> bool:
    """Whether a file is a result of this kind."""
    with contextlib.suppress(OSError):
        if kind in (RUN, MODAL, FAMILY):
            return schema_of(target) == kind
        with target.open("rb") as file:
            begin = file.read(_END)
            file.seek(max(0, target.stat().st_size - _END))
            end = file.read(_END)
        if kind == ".csv":
            return _TABLE.match(begin) is not None
        return begin.startswith(_BEGINS[kind]) and any(_MARKED.search(part) for part in (begin, end))
    return False


def schema_of(target: Path) -> str:
    """Of an HDF5 file; empty of all others."""
    import h5py

    with contextlib.suppress(Exception), h5py.File(target, "r", locking="best-effort") as file:  # whatever it is
        schema = file.attrs["schema"]
        return schema.decode() if isinstance(schema, bytes) else str(schema)
    return ""
