"""The skeleton of a Nastran OUTPUT4 file: headers, column records and strings, checked against the size of the file.

Values are not read here. What passes has records that end where they say, columns that rise, rows inside the matrix:
a reader that trusts the file neither loops nor takes memory for what is not there.

Layouts (MSC Nastran, DMAP module OUTPUT4): full columns (first row > 0), strings of a sparse column behind one packed
integer (first row 0), or behind two integers (first row 0, rows negative: BIGMAT). In a binary file each record stands
between two copies of its length.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, NoReturn

import numpy as np

from fe_import.errors import Cause, FEImportError

_MOST = 2**31  # rows or columns
_CLOSING = (0, 4, 8, 16)  # bytes of the number in the record behind the last column, whatever its count of words says
_BIG_ROWS = 65536  # from here on sparse columns are BIGMAT whatever the sign of the rows
_LONGEST_LINE = 1000
_DIGITS = 9  # of an integer in a header
_CLOSING_NUMBER = re.compile(r"[+-]?\d\.\d+(?:[ED][+-]?\d{2,3}|[+-]\d{3})", re.IGNORECASE)


@dataclass(frozen=True)
class Op4Header:
    """Name (small letters), size, form (1 square, 2 rectangular, 6 symmetric) and type (1, 2 real, 3, 4 complex)."""

    name: str
    rows: int
    columns: int
    form: int
    kind: int
    values: int


def op4_layout(path: Path, where: str) -> list[Op4Header]:
    """Headers of all matrices of a file, text or binary, after a walk through all of its records.

    Raises
    ------
    FEImportError
        ``EXPORT``: truncated, or not consistent.
    """
    size = os.path.getsize(path)
    with path.open("rb") as file:
        first = file.read(16)
        if len(first) < 16:
            _fail("the file is empty", where)
        file.seek(0)
        if min(first[:4]) == 0:
            return list(_Binary(file, size, where, first[:4]).matrices())
        return list(_Text(file, size, where).matrices())


def _fail(message: str, where: str, value: object = None, limit: object = None) -> NoReturn:
    raise FEImportError(
        Cause.EXPORT, message, where=where, value=value, limit=limit, remedy="export again; the file may be cut off"
    )


class _Walk:
    """What the two kinds of file share."""

    def __init__(self, file: IO[bytes], size: int, where: str) -> None:
        self.file, self.size, self.where = file, size, where

    def fail(self, message: str, value: object = None, limit: object = None) -> NoReturn:
        _fail(f"{message} (byte {self.file.tell()})", self.where, value, limit)

    def check_header(self, rows: int, columns: int) -> None:
        """A matrix of zeros may be larger than its file; whether one that is wanted fits, its reader checks."""
        if not (0 <= columns < _MOST and 0 <= abs(rows) < _MOST):
            self.fail("a header states a matrix of an absurd size", f"{rows} x {columns}", _MOST)

    def check_column(self, column: int, last: int, columns: int) -> None:
        if not last < column <= columns + 1:
            self.fail("the columns of a matrix must rise", column, f"{last + 1} to {columns + 1}")

    def column_layout(self, row: int, rows: int, before: str | None) -> str:
        """How a column that starts at ``row`` is laid out: as those before it."""
        found = "full" if row > 0 else "wide" if rows < 0 or rows >= _BIG_ROWS else "packed"
        if row < 0 or before not in (None, found):
            self.fail("full and sparse columns in one matrix", f"first row {row}")
        return found

    def check_string(self, row: int, count: int, rows: int, kind: int) -> None:
        """``count`` real numbers from ``row`` on, two for each complex one."""
        if kind > 2:
            count //= 2
        if not (row >= 1 and count >= 1 and row + count - 1 <= rows):
            self.fail("values outside of the matrix", f"rows {row} to {row + count - 1}", rows)


class _Binary(_Walk):
    def __init__(self, file: IO[bytes], size: int, where: str, mark: bytes) -> None:
        super().__init__(file, size, where)
        for order in "<>":
            length = struct.unpack(order + "i", mark)[0]
            if length in (24, 48):
                self.order, self.wide = order, length == 48
                break
        else:
            self.fail("not an OUTPUT4 file", mark.hex(), "a header record of 24 or 48 bytes")
        self.integer = 8 if self.wide else 4

    def integers(self, count: int) -> tuple[int, ...]:
        raw = self.file.read(count * self.integer)
        if len(raw) < count * self.integer:
            self.fail("the file ends within a record")
        return struct.unpack(f"{self.order}{count}{'q' if self.wide else 'i'}", raw)

    def mark(self) -> int:
        raw = self.file.read(4)
        if len(raw) < 4:
            self.fail("the file ends within a record")
        return int(struct.unpack(self.order + "i", raw)[0])

    def matrices(self) -> Iterator[Op4Header]:
        while self.file.tell() < self.size:
            if self.mark() != 6 * self.integer:
                self.fail("a header record has another length")
            columns, rows, form, kind = self.integers(4)
            name = self.file.read(2 * self.integer).decode("ascii", errors="replace")
            if self.mark() != 6 * self.integer:
                self.fail("a header record does not end where it says")
            self.check_header(rows, columns)
            values = self.columns(rows, columns, kind)
            yield Op4Header(name.strip(" \0").lower(), abs(rows), columns, form, kind, values)

    def columns(self, rows: int, columns: int, kind: int) -> int:
        """Walk to the record of column ``columns + 1``; the number of values before it."""
        words = 1 if self.wide or kind % 2 else 2
        last, total = 0, 0
        layout: str | None = None
        while last <= columns:
            length = self.mark()
            begin = self.file.tell()
            column, row, count = self.integers(3)
            unit = self.integer if kind % 2 else 8
            expected = 3 * self.integer + count * (unit // words)
            closing = column > columns and length - 3 * self.integer in _CLOSING
            if count < 0 or not (length == expected or closing) or begin + length + 4 > self.size:
                self.fail("a record does not fit its length or the file", length, expected)
            self.check_column(column, last, columns)
            if column > columns:
                self.file.seek(begin + length)
            else:
                layout = self.column_layout(row, rows, layout)
                total += self.strings(layout, row, count, words, unit, abs(rows), kind)
            if self.file.tell() != begin + length or self.mark() != length:
                self.fail("a record does not end where it says", f"column {column}")
            last = column
        return total

    def strings(self, layout: str, row: int, count: int, words: int, unit: int, rows: int, kind: int) -> int:
        """Walk through one column; the number of its values."""
        if layout == "full":
            if count % words:
                self.fail("half a number", f"{count} words")
            self.check_string(row, count // words, rows, kind)
            self.file.seek(count // words * unit, os.SEEK_CUR)
            return count // words
        total = 0
        while count > 0:
            if layout == "wide":
                length, row = self.integers(2)
                head, held = 2, length - 1
            else:
                (packed,) = self.integers(1)
                head, held = 1, (packed >> 16) - 1
                row = packed & 0xFFFF
            if held % words or held + head > count:
                self.fail("a string of values does not fit its column", held, count)
            self.check_string(row, held // words, rows, kind)
            self.file.seek(held // words * unit, os.SEEK_CUR)
            count -= head + held
            total += held // words
        return total


class _Text(_Walk):
    def line(self) -> str:
        raw = self.file.readline(_LONGEST_LINE + 1)
        if not raw:
            self.fail("the file ends within a matrix")
        if len(raw) > _LONGEST_LINE or not raw.isascii():
            self.fail("not a line of an OUTPUT4 file")
        return raw.decode("ascii").rstrip()

    def integers(self, line: str, widths: tuple[int, ...]) -> list[int]:
        ends = np.cumsum(widths).tolist()
        texts = [line[end - width : end].strip() for end, width in zip(ends, widths, strict=True)]
        if not all(t.removeprefix("-").isdigit() and len(t) <= _DIGITS for t in texts):
            self.fail(f"whole numbers in columns of {' and '.join(map(str, sorted(set(widths))))} expected", line[:40])
        return [int(t) for t in texts]

    def record(self, count: int, wide: bool) -> list[int]:
        """Whole numbers of a line; behind a header with ``|I16`` their columns may be wide."""
        line = self.line()
        return self.integers(line, (16 if wide and len(line) > 8 * count else 8,) * count)

    def matrices(self) -> Iterator[Op4Header]:
        while self.file.tell() < self.size:
            line = self.line()
            if not line:
                if self.file.read().strip():
                    self.fail("an empty line between matrices")
                return
            wide = line.endswith("|I16")
            columns, rows, form, kind = self.integers(line, (16, 16, 8, 8) if wide else (8, 8, 8, 8))
            name, text = (line[48:56], line[56:-4]) if wide else (line[32:40], line[40:])
            self.check_header(rows, columns)
            per_line, width = self.number_format(text)
            values = self.columns(rows, columns, kind, per_line, width, wide)
            yield Op4Header(name.strip().lower(), abs(rows), columns, form, kind, values)

    def number_format(self, text: str) -> tuple[int, int]:
        """Numbers per line and their width, from ``1P,3E23.16``; 5E16.9 where the header ends with the name."""
        body = (text.strip() or "5E16.9").upper().removeprefix("1P,").replace("D", "E")
        count, _, rest = body.partition("E")
        width = rest.partition(".")[0]
        if not (count.isdigit() and width.isdigit() and 0 < int(count) * int(width) <= _LONGEST_LINE):
            self.fail("the format of the numbers is not understood", text, "such as 1P,5E16.9")
        return int(count), int(width)

    def columns(self, rows: int, columns: int, kind: int, per_line: int, width: int, wide: bool) -> int:
        words = 1 if kind % 2 else 2
        last, total = 0, 0
        layout: str | None = None
        while last <= columns:
            column, row, count = self.record(3, wide)
            self.check_column(column, last, columns)
            last = column
            if column > columns:
                closing = self.line().strip()  # one number, whatever its count of words and its width say
                if not _CLOSING_NUMBER.fullmatch(closing):
                    self.fail("the record behind the last column is not one number", closing[:40])
                return total
            layout = self.column_layout(row, rows, layout)
            if layout == "full":
                self.check_string(row, count, abs(rows), kind)
                self.numbers(count, per_line, width)
                total += count
                continue
            while count > 0:
                if layout == "wide":
                    length, row = self.record(2, wide)
                    head, held = 2, length - 1
                else:
                    packed = self.packed(self.line())
                    head, held, row = 1, (packed >> 16) - 1, packed & 0xFFFF
                if held % words or held + head > count:
                    self.fail("a string of values does not fit its column", held, count)
                self.check_string(row, held // words, abs(rows), kind)
                self.numbers(held // words, per_line, width)
                total += held // words
                count -= head + held
        return total

    def packed(self, line: str) -> int:
        text = line.strip()
        if not (text.isdigit() and len(text) <= 12):
            self.fail("a packed integer expected", line[:40])
        return int(text)

    def numbers(self, count: int, per_line: int, width: int) -> None:
        """Skip lines of numbers, each as long as the format says."""
        while count > 0:
            here = min(count, per_line)
            line = self.line()
            if len(line) != here * width:
                self.fail("a line of numbers has another length", len(line), here * width)
            count -= here
