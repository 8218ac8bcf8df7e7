"""Standard streams that are closed, full, or of a locale without letters: a command ends with its message all the same.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Any


class StdoutLost(OSError):
    """Stdout takes no more: full, or nobody reads it (``reader_left``). What waits for it went nowhere."""

    @property
    def reader_left(self) -> bool:
        """Whether whoever reads has enough, as in: erls info FILE | head."""
        return self.errno == errno.EPIPE


class _Stdout(io.FileIO):
    """The descriptor of stdout; whatever writes to it, a failure is known for what it is, and there is one."""

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except OSError as problem:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            raise StdoutLost(problem.errno, problem.strerror) from None


def prepare_streams() -> None:
    """Have all three standard streams there, and stdout and stderr take any letter.

    A file that is opened while one of the first three descriptors is closed takes its place, and would get what
    libraries print.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    _of_any_letter("stderr", 2)
    stdout = _of_any_letter("stdout", 1)
    if sys.platform == "win32" and stdout.isatty():  # no file there
        return
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(_Stdout(stdout.fileno(), "w", closefd=False)),
        encoding=stdout.encoding,
        errors=stdout.errors,
        line_buffering=stdout.line_buffering,
        write_through=stdout.write_through,
    )


def _of_any_letter(name: str, number: int) -> io.TextIOWrapper:
    stream: io.TextIOWrapper | None = getattr(sys, name)
    if stream is None:  # it was closed
        stream = open(number, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        setattr(sys, name, stream)
    if stream.encoding.lower() in ("ascii", "us-ascii", "ansi_x3.4-1968"):
        stream.reconfigure(encoding="utf-8", errors="surrogateescape")  # names of files come out as they went in
    elif stream.errors == "strict":
        stream.reconfigure(errors="backslashreplace")
    return stream
