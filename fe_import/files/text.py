"""Text files from strangers: plain or gzip, read in blocks, with limits before memory is taken.

One `TextFile` serves every reader: `TextFile.line` for headers and keywords, `TextFile.rows` for long tables.
"""

from __future__ import annotations

import gzip
import re
import stat
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np

from fe_import.errors import Cause, FEImportError, shortened
from fe_import.model import Array, IntArray

LONGEST_LINE = 10_000  # characters; decks have 80 to 256
MOST_BYTES = 20_000_000_000  # of text; the matrices of a million dofs in 3-D have 4e9
_MOST_RATIO = 200  # text over its gzip file: matrices have 3 to 20, a bomb 1000
_FREE_BYTES = 20_000_000  # text that any gzip file may hold
_BLOCK = 4_000_000
_TEXT = bytes(b for b in range(256) if (b >= ord(" ") and b != 127) or b in b"\t\n\r\f\v")
_GZIP = b"\x1f\x8b"
_EXPONENTS = bytes.maketrans(b"Dd", b"Ee")
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[Ee][+-]?\d+)?\Z")
_NO_LETTER = re.compile(rb"([+-]?(?:\d+\.\d*|\.\d+))([+-]\d{3})\Z")  # Fortran drops the E of 1.0E-100
_WORDS = re.compile(rb"[+-]?(?:nan(?:\([^)]*\))?|inf(?:inity)?)\Z", re.IGNORECASE)


@dataclass(frozen=True)
class Rows:
    """A table of numbers.

    Attributes
    ----------
    values : (n, columns) array
        Finite.
    lines : (n,) int array
        Numbers of their lines in the file, from 1.
    """

    values: Array
    lines: IntArray

    def integers(self, column: int, what: str, where: str) -> IntArray:
        """A column of whole numbers.

        Raises
        ------
        FEImportError
            ``EXPORT``: a fraction, or a number beyond 2^53; ``what`` says what it should be.
        """
        values = self.values[:, column]
        bad = (values != np.floor(values)) | (np.abs(values) > 2**53)
        if bad.any():
            first = int(bad.argmax())
            raise FEImportError(
                Cause.EXPORT,
                f"{what} must be a whole number",
                where=f"{where}: line {self.lines[first]}",
                value=float(values[first]),
                remedy="check the format and the columns of the file",
            )
        return values.astype(np.int64)


class TextFile:
    """A text file, plain or gzip (told by its first bytes, whatever its name), read forward once.

    Use as a context manager. Every method raises `FEImportError` only, with file and line.

    Parameters
    ----------
    path : Path
    where : str, optional
        To name in messages in place of the path.
    cause : Cause
        Of faulty content.

    Attributes
    ----------
    where : str
    number : int
        Number of the last line that was read, from 1.
    """

    def __init__(self, path: Path, where: str = "", cause: Cause = Cause.EXPORT) -> None:
        self.path, self.where, self.number, self.cause = path, where or str(path), 0, cause
        self._whole = True  # the line read last had an end
        self._text = b""  # whole lines that wait to be read; the last line of the file may lack its end
        self._tail = b""  # the beginning of the line after them
        self._at = self._total = 0
        self._raw, self._file, self._packed = self._opened()

    def _opened(self) -> tuple[IO[bytes], IO[bytes], int]:
        try:
            status = self.path.stat()
            if not stat.S_ISREG(status.st_mode):  # a pipe would never end
                raise self.failure("not a file", cause=Cause.NOT_READABLE)
            raw = self.path.open("rb")
            packed = raw.read(2) == _GZIP
            raw.seek(0)
        except FileNotFoundError:
            raise self.failure("no such file", cause=Cause.FILE_NOT_FOUND, remedy="check the path") from None
        except (OSError, ValueError) as problem:
            raise self.failure(f"cannot be read: {problem}", cause=Cause.NOT_READABLE) from None
        if not packed:
            return raw, raw, 0
        unpacked: Any = gzip.GzipFile(fileobj=raw, mode="rb")
        return raw, unpacked, status.st_size

    def __enter__(self) -> TextFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        self._raw.close()

    def failure(
        self,
        message: str,
        *,
        line: int | None = None,
        value: Any = None,
        limit: Any = None,
        remedy: str = "export the file again",
        cause: Cause | None = None,
    ) -> FEImportError:
        """An error that names this file, and a line of it when ``line`` is given."""
        where = self.where if line is None else f"{self.where}: line {line}"
        return FEImportError(cause or self.cause, message, where=where, value=value, limit=limit, remedy=remedy)

    def line(self) -> str | None:
        """The next line without its end, None behind the last one."""
        if self._at == len(self._text) and not self._fill():
            return None
        end = self._text.find(b"\n", self._at)
        self._whole = end >= 0
        end = len(self._text) if end < 0 else end
        line, self._at = self._text[self._at : end], min(end + 1, len(self._text))
        self.number += 1
        if len(line) > LONGEST_LINE:
            raise self._too_long(self.number)
        return line.rstrip(b"\r").decode("utf-8", errors="replace")

    def lines(self) -> Iterator[str]:
        """The lines to the end of the file; the last one must end, as a number in it may be cut off."""
        while (line := self.line()) is not None:
            if not self._whole and line.strip():
                raise self.failure(
                    "the last line does not end: the file is cut off", line=self.number, remedy="export it again, whole"
                )
            yield line

    def rows(
        self, columns: int, *, count: int | None = None, stop: str = "", comment: str = "", separators: str = ""
    ) -> Rows:
        """The table of numbers that begins at the next line; blank lines are skipped.

        Exponents may be Fortran's (``1.0D-3``, ``1.0-100``).

        Parameters
        ----------
        columns : int
            Numbers in every row.
        count : int, optional
            Rows there must be; the line behind the last one is the next to be read. Otherwise to the end of the
            file, or to the line before the first one that starts with ``stop``.
        stop, comment : str
            First characters of the line that ends the table, and of lines to skip.
        separators : str
            Characters between numbers besides blanks.

        Raises
        ------
        FEImportError
            ``EXPORT``: too few or too many columns or rows, what is no number or not finite, a line that does not end.
        """
        tables: list[Rows] = []
        found, stopped = 0, False
        while not stopped and found != count and (self._at < len(self._text) or self._fill()):
            block, first = self._text[self._at :], self.number + 1
            if stop:
                cut = (b"\n" + block).find(b"\n" + stop.encode())
                stopped, block = cut >= 0, block[:cut] if cut >= 0 else block
            if count is not None:
                block = _first_lines(block, count - found)
            self._at += len(block)
            self.number += block.count(b"\n")
            if block.strip() and not block.endswith(b"\n"):
                raise self.failure(
                    "the last line does not end: the file is cut off",
                    line=self.number + 1,
                    remedy="export it again, whole",
                )
            tables.append(self._table(_without(block, comment.encode()), columns, first, separators.encode()))
            found += len(tables[-1].lines)
        if count is not None and found < count:
            raise self.failure(
                "the file ends early", line=self.number, value=f"{found} rows", limit=count, remedy="export it again"
            )
        if not tables:
            return Rows(np.zeros((0, columns)), np.zeros(0, dtype=np.int64))
        return Rows(np.concatenate([t.values for t in tables]), np.concatenate([t.lines for t in tables]))

    def _fill(self) -> bool:
        """Make whole lines wait; False at the end of the file."""
        while True:
            chunk = self._read()
            if not chunk:
                self._text, self._tail, self._at = self._tail, b"", 0
                return bool(self._text)
            cut = chunk.rfind(b"\n") + 1
            if cut:
                self._text, self._tail, self._at = self._tail + chunk[:cut], chunk[cut:], 0
                return True
            self._tail += chunk
            if len(self._tail) > LONGEST_LINE:
                raise self._too_long(self.number + 1)

    def _read(self) -> bytes:
        try:
            chunk = self._file.read(_BLOCK)
        except EOFError:
            raise self.failure("the gzip file is cut off", cause=Cause.NOT_READABLE) from None
        except (OSError, zlib.error, ValueError) as problem:
            raise self.failure(f"cannot be read: {problem}", cause=Cause.NOT_READABLE) from None
        if not self._total and chunk.startswith(b"\xef\xbb\xbf"):
            chunk = chunk[3:]
        self._total += len(chunk)
        if self._packed and self._total > max(_FREE_BYTES, _MOST_RATIO * self._packed):
            raise self.failure(
                "the gzip file unpacks to far more than matrices do",
                limit=f"{_MOST_RATIO} times its {self._packed} bytes",
                remedy="unpack it and look at it",
            )
        if self._total > MOST_BYTES:
            raise self.failure("the file is too large", limit=f"{MOST_BYTES} bytes", remedy="reduce the model first")
        if odd := chunk.translate(None, _TEXT):
            raise self.failure(
                "not a text file",
                value=f"byte {odd[0]:#04x}",
                remedy="export as text (ASCII); a spreadsheet, UTF-16 or binary file cannot be read",
            )
        return chunk

    def _too_long(self, line: int) -> FEImportError:
        return self.failure("too long a line for a matrix or a deck", line=line, limit=f"{LONGEST_LINE} characters")

    def _table(self, block: bytes, columns: int, first: int, separators: bytes) -> Rows:
        """Numbers of a block of lines, the first of which has number ``first``."""
        if separators:
            block = block.translate(bytes.maketrans(separators, b" " * len(separators)))
        codes = np.frombuffer(block, dtype=np.uint8)
        ends = np.flatnonzero(codes == ord("\n"))
        long = np.diff(ends, prepend=-1) > LONGEST_LINE
        if long.any():
            raise self._too_long(first + int(long.argmax()))
        blank = np.concatenate([[True], codes <= ord(" ")])
        begins = np.flatnonzero(blank[:-1] & ~blank[1:])
        words = np.diff(np.searchsorted(begins, ends), prepend=0)
        bad = (words != columns) & (words != 0)
        if bad.any():
            line = int(bad.argmax())
            raise self.failure(
                f"expected {columns} numbers in this line",
                line=first + line,
                value=shortened(block.split(b"\n", line + 1)[line].decode("utf-8", errors="replace").strip()),
                remedy="check the format; the file may be cut off or mended by hand",
            )
        lines = first + np.flatnonzero(words)
        values = self._numbers(block, int(words.sum()), columns, lines).reshape(-1, columns)
        if not np.isfinite(values).all():
            row = int((~np.isfinite(values)).any(axis=1).argmax())
            raise self._not_finite(int(lines[row]), values[row].tolist())
        return Rows(values, lines)

    def _not_finite(self, line: int, value: Any) -> FEImportError:
        return self.failure("a number is not finite", line=line, value=value, remedy="look for the fault in the model")

    def _numbers(self, block: bytes, count: int, columns: int, lines: IntArray) -> Array:
        block = block.translate(_EXPONENTS) if b"D" in block or b"d" in block else block
        try:
            values = np.fromstring(block, sep=" ") if count else np.zeros(0)
            if len(values) == count:
                return values
        except ValueError:
            pass  # one word by one, to say where
        values = np.empty(count)
        for k, word in enumerate(block.split()):
            if split := _NO_LETTER.match(word):
                word = split[1] + b"E" + split[2]
            if _WORDS.match(word):
                raise self._not_finite(int(lines[k // columns]), word.decode())
            if not _NUMBER.match(word):
                raise self.failure(
                    "not a number",
                    line=int(lines[k // columns]),
                    value=word.decode("utf-8", errors="replace"),
                    remedy="check the format of the file",
                )
            values[k] = float(word)
        return values


def _first_lines(block: bytes, count: int) -> bytes:
    ends = np.flatnonzero(np.frombuffer(block, dtype=np.uint8) == ord("\n"))
    return block if len(ends) <= count else block[: ends[count - 1] + 1]


def _without(block: bytes, comment: bytes) -> bytes:
    """The lines that start with ``comment`` made blank."""
    if not comment or comment not in block:
        return block
    return b"\n".join(b"" if line.lstrip().startswith(comment) else line for line in block.split(b"\n"))
