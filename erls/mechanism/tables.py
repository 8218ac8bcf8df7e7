"""Tables of samples over time: CSV files beside the scene, or lists inside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from erls.errors import Cause, SceneError
from erls.files.input import text_of
from erls.mechanism.place import LARGEST, LATEST, SHORTEST, Place

MAX_BYTES = 50_000_000


def read_csv(path: Path, where: str) -> NDArray[np.float64]:
    """Read a table of numbers.

    Columns are separated by semicolons, commas or blanks; where semicolons separate them, a comma is a
    decimal comma. One header line may precede the numbers; blank lines and comments after ``#`` are skipped.

    Parameters
    ----------
    path : Path
        The file, UTF-8.
    where : str
        File and field that name it, for messages.

    Returns
    -------
    (rows, columns) array
        Finite numbers; column 0, the time in s, rises strictly.

    Raises
    ------
    SceneError
        File missing, not readable or too large, or a faulty line, which is named.
    """
    return read_titled_csv(path, where)[1]


def read_titled_csv(path: Path, where: str) -> tuple[list[str], NDArray[np.float64]]:
    """The same with the header line, one title for each column; empty without one. Commas or semicolons separate titles
    with blanks in them.
    """
    rows: list[list[float]] = []
    titles: list[str] = []
    text = text_of(path, "a table", MAX_BYTES, where, "leave out samples or columns")
    for number, raw in enumerate(text.split("\n"), start=1):
        line, mark, _ = raw.partition("#")
        if mark and line and not line[-1].isspace():
            remedy = "put a blank before a comment"
            raise _fault(path, f"line {number}", "a comment begins within a number", raw.strip()[:40], remedy=remedy)
        line = line.strip()
        if not line:
            continue
        fields = _split(line)
        if not rows and not titles and all(_number(f) is None for f in fields):
            titles = [field.strip('"') for field in fields]
            continue
        rows.append(_row(path, number, fields, rows[-1] if rows else None))
    if not rows:
        raise _fault(path, "", "no numbers in it", remedy="give lines of time and value")
    return titles, np.array(rows)


def _row(path: Path, number: int, fields: list[str], before: list[float] | None) -> list[float]:
    """The numbers of a line, held against the line before."""
    if before is not None and len(fields) != len(before):
        remedy = f"give {len(before)} columns in every line, separated alike"
        raise _fault(
            path, f"line {number}", "number of columns changes", len(fields), len(before), remedy=remedy
        )
    row: list[float] = []
    for column, text in enumerate(fields):
        value = _number(text)
        if value is None or not abs(value) <= (LARGEST if column else LATEST):
            remedy = "write numbers like -1.5e-3, one header line at most"
            spot = f"line {number}, column {column}"
            raise _fault(path, spot, "not a finite number of plausible size", text[:40], remedy=remedy)
        row.append(value)
    if before is not None and row[0] - before[0] < SHORTEST:
        remedy = f"let times rise strictly, by at least {SHORTEST:g} s; the one before is {before[0]}"
        raise _fault(path, f"line {number}, column 0", "times do not rise", row[0], remedy=remedy)
    return row


def samples(
    place: Place,
    file: str | None,
    column: int,
    times: Sequence[float] | None,
    values: NDArray[np.float64] | None,
    least: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times and values of a table record, from its file or from its lists.

    Parameters
    ----------
    place : Place
        Of the record.
    file, column
        The file and the column of its values; column 0 is the time.
    times, values
        The lists, which exclude a file.
    least : int
        Rows that the interpolation needs.
    """
    if file is None:
        if times is None or values is None:
            missing = "times" if times is None else "values"
            raise place.error(missing, "missing", remedy="give 'file', or 'times' and values")
        rising = place.rising("times", times, least)
        if len(values) != len(rising):
            remedy = f"give as many values as times, {len(rising)}"
            raise place.error(
                "times", "times and values differ in number", len(values), len(rising), remedy=remedy
            )
        return rising, values
    if times is not None or values is not None:
        raise place.error(
            "file", "samples given twice, in a file and as lists", file, remedy="keep one of them"
        )
    path = place.folder / file
    table = read_csv(path, place.field("file"))
    if len(table) < least:
        raise _fault(path, "", "too few rows", len(table), least, remedy=f"give at least {least} rows")
    if not 1 <= column < table.shape[1]:
        limit = f"1 to {table.shape[1] - 1}"
        raise place.error(
            "column",
            f"no such column in {path}",
            column,
            limit,
            remedy="column 0 is the time, values start at column 1",
        )
    return table[:, 0], table[:, column]


def _split(line: str) -> list[str]:
    if ";" in line:
        return [f.strip().replace(",", ".") for f in line.split(";")]
    return [f.strip() for f in line.split(",")] if "," in line else line.split()


def _number(text: str) -> float | None:
    """The number, if it is one; underscores, which Python would skip, are not part of a number."""
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def _fault(
    path: Path, spot: str, message: str, value: Any = None, limit: Any = None, *, remedy: str
) -> SceneError:
    where = f"{path}: {spot}" if spot else str(path)
    return SceneError(Cause.TABLE, message, where=where, value=value, limit=limit, remedy=remedy)
