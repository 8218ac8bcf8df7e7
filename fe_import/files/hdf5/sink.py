"""The file object that HDF5 writes through.

HDF5 cannot close a file after a failed write (disk full): it raises again and again and may crash the process
at its end. So the first failure stays here, later writes go nowhere, HDF5 closes in peace, and the caller
raises it then.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Self


class Sink:
    """A new file for ``h5py.File(sink, "w")``.

    Attributes
    ----------
    problem : BaseException or None
        The first failed write (or the interrupt that came during one).
    """

    def __init__(self, path: Path) -> None:
        self._file = open(path, "x+b", buffering=0)  # noqa: SIM115
        self.problem: BaseException | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._file.close()

    def sync(self) -> None:
        """Wait until everything is on the disk."""
        os.fsync(self._file.fileno())

    def write(self, data: memoryview) -> int:
        """Write all of ``data``."""
        rest = memoryview(data).cast("B")
        try:
            while self.problem is None and len(rest):
                rest = rest[self._file.write(rest) :]
        except BaseException as problem:
            self.problem = problem
        return len(data)

    def truncate(self, size: int) -> int:
        """Cut or extend the file."""
        try:
            if self.problem is None:
                self._file.truncate(size)
        except BaseException as problem:
            self.problem = problem
        return size

    def readinto(self, buffer: memoryview) -> int:
        """Fill ``buffer`` with what was written, zeros where it is lost."""
        rest = memoryview(buffer).cast("B")
        while len(rest):
            count = self._file.readinto(rest) or 0
            if not count:
                rest[:] = bytes(len(rest))
                break
            rest = rest[count:]
        return len(buffer)

    def read(self, size: int = -1) -> bytes:
        """Some bytes; h5py takes what has ``read`` and ``seek`` for a file."""
        return self._file.read(size) or b""

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """The current place."""
        return self._file.tell()

    def flush(self) -> None:
        """Nothing is buffered here."""
