"""Before a mesh file is read: gzip unpacked within limits, declared sizes held against the file, memory bounded."""

from __future__ import annotations

import contextlib
import gzip
import mmap
import re
import struct
import sys
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fe_import.errors import Cause, FEImportError

MOST_BYTES = 4_000_000_000  # of an unpacked mesh; one of a million nodes has 2e8
_MOST_RATIO = 200  # unpacked over packed: meshes have 3 to 20, a bomb 1000
_FREE_BYTES = 20_000_000  # that any gzip file may hold
_MEMORY_PER_BYTE = 64  # Python's lists of numbers over their text
_FREE_MEMORY = 1 << 30
_BLOCK = 1 << 20
_HEAD = 1 << 20  # of a .vtu file, where its counts stand
_VTU_COUNT = re.compile(rb'NumberOf(Points|Cells)\s*=\s*["\']\s*([^"\']*)')


@contextlib.contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The file itself, or a temporary one with the content of a ``.gz`` file.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: not gzip, cut off, or far larger than meshes are.
    """
    if path.suffix.lower() != ".gz":
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.stem
        limit = min(MOST_BYTES, max(_FREE_BYTES, _MOST_RATIO * path.stat().st_size))
        try:
            with gzip.open(path, "rb") as packed, copy.open("wb") as plain:
                total = 0
                while block := packed.read(_BLOCK):
                    total += len(block)
                    if total > limit:
                        raise _unreadable(path, "unpacks to far more than meshes do", f"{limit} bytes")
                    plain.write(block)
        except (EOFError, zlib.error, OSError) as problem:
            raise _unreadable(path, f"not a whole gzip file: {problem}") from None
        yield copy


def _unreadable(path: Path, message: str, limit: str | None = None) -> FEImportError:
    return FEImportError(
        Cause.NOT_READABLE,
        f"cannot be read as a mesh: {message}",
        where=str(path),
        limit=limit,
        remedy="unpack it and look at it",
    )


def check_declared(path: Path, name: str) -> None:
    """Hold what a file declares against what it holds, before a reader takes memory or time for it.

    Parameters
    ----------
    path : Path
        Of the unpacked file.
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``MESH``: a count of a .msh or .vtu file that is no number, or more than it can hold;
        ``NOT_READABLE``: a section of a .msh file without end.
    """
    size = path.stat().st_size
    if size == 0:
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
        if path.suffix.lower() == ".vtu":
            for what, count in _VTU_COUNT.findall(text[:_HEAD]):
                _check_count(f"NumberOf{what.decode()}", _number(count), 50 * size, name)  # zlib packs 1000 : 1
        elif path.suffix.lower() == ".msh":
            if text[:4] == b"$NOD":
                message, remedy = "cannot be read as a mesh: MSH 1 of 2005", "open it with gmsh, save as MSH 4.1"
                raise FEImportError(Cause.NOT_READABLE, message, where=name, remedy=remedy)
            for section in (b"$Nodes", b"$Elements"):
                for count in _msh_counts(text, section):
                    _check_count(section.decode(), count, size // 4, name)
            _check_sections(text, name)


def _number(word: bytes) -> float:
    try:
        return float(word)
    except ValueError:
        return float("nan")


def _msh_format(text: mmap.mmap) -> list[bytes]:
    """The words of a .msh file up to its version, type of file and size of numbers."""
    return text[: text.find(b"\n", text.find(b"$MeshFormat") + 12) + 1].split()


def _is_text(text: mmap.mmap) -> bool:
    return _msh_format(text)[2:3] == [b"0"]


def _msh_counts(text: mmap.mmap, section: bytes) -> list[float]:
    """Blocks and members of a section; of MSH 2 its members."""
    head = _msh_format(text)
    place = text.find(section + b"\n")
    if place < 0 or len(head) < 4:
        return []
    begin = place + len(section) + 1
    if head[1].startswith(b"4") and not _is_text(text):
        return [float(n) for n in struct.unpack("=QQ", text[begin : begin + 16].ljust(16, b"\0"))]
    end = text.find(b"\n", begin)
    return [_number(word) for word in text[begin : end if end >= 0 else None].split()[:2]]


def _check_sections(text: mmap.mmap, name: str) -> None:
    """Sections of a .msh file end, and there are as many physical names as it says."""
    for section in (b"Nodes", b"Elements", b"PhysicalNames", b"Entities"):
        begin, end = text.find(b"$" + section + b"\n"), text.find(b"$End" + section)
        if begin >= 0 and end < begin:
            raise _damaged(f"${section.decode()} does not end", name)
        if section == b"Elements" and begin >= 0:
            most = 1 + int(sum(_msh_counts(text, b"$Elements")))
            if _is_text(text) and (lines := text[begin:end].count(b"\n") - 1) > most:
                raise _damaged(f"$Elements has {lines} lines, {most} are declared", name)
        if section == b"Nodes" and begin >= 0 and _is_text(text):
            _check_node_fields(text[begin:end], _msh_counts(text, b"$Nodes"), _msh_format(text)[1], name)
        if section == b"PhysicalNames" and begin >= 0:
            count, *names = text[begin:end].decode("utf-8", "replace").splitlines()[1:] or [""]
            if count.strip() != str(len(names)):
                raise _damaged(f"$PhysicalNames declares another count than its {len(names)} lines", name)


def _check_node_fields(section: bytes, counts: list[float], version: bytes, name: str) -> None:
    """As many numbers as the nodes have; one more or less would shift all behind it."""
    blank = np.frombuffer(section, dtype=np.uint8) <= ord(" ")
    found = int((blank[:-1] & ~blank[1:]).sum())
    expected = found
    if version in (b"4", b"4.0"):
        expected = int(2 + 4 * sum(counts))
    elif version == b"4.1":
        expected = int(4 * (1 + sum(counts)))
    elif version.startswith(b"2"):
        expected = int(1 + 4 * sum(counts))
    if found != expected:
        raise _damaged(f"$Nodes has {found} numbers, {expected} are declared", name)


def _damaged(message: str, name: str) -> FEImportError:
    return FEImportError(
        Cause.NOT_READABLE,
        f"cannot be read as a mesh: {message}",
        where=name,
        remedy="the file is damaged or cut off; write the mesh again",
    )


def check_found(path: Path, name: str, points: int, cells: int) -> None:
    """Hold what was read of a .msh file against what it declares.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``.
    """
    if path.suffix.lower() != ".msh":
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
        for section, found in ((b"$Nodes", points), (b"$Elements", cells)):
            declared = _msh_counts(text, section)
            if declared and declared[-1] != found:
                raise _damaged(f"{section.decode()} declares {declared[-1]:.0f}, {found} were found", name)


def _check_count(what: str, count: float, limit: int, name: str) -> None:
    if not 0 <= count <= limit:
        raise FEImportError(
            Cause.MESH,
            f"{what} declares more than a file of this size can hold, or no number",
            where=name,
            value=count,
            limit=limit,
            remedy="the header is damaged; write the mesh again",
        )


@contextlib.contextmanager
def bounded_memory(path: Path) -> Iterator[None]:
    """Let a reader take memory in proportion to its file only (Linux; elsewhere no bound)."""
    if sys.platform != "linux":
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    bound = pages * resource.getpagesize() + _FREE_MEMORY + _MEMORY_PER_BYTE * path.stat().st_size
    for limit in (soft, hard):
        bound = bound if limit == resource.RLIM_INFINITY else min(bound, limit)
    resource.setrlimit(resource.RLIMIT_AS, (bound, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
