"""Tables (CSV) of names and numbers: those that are written are what a spreadsheet takes for nothing else."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from erls.errors import Cause, SceneError
from erls.files.input import text_of
from erls.files.output import replacing

_MOST_BYTES = 500_000_000

_EXECUTED = ("=", "+", "-", "@", "\t", "\r")


def write_table(file: IO[str], head: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a head and rows; cells that a spreadsheet would execute get an apostrophe before them.

    Those are texts that begin with ``=``, ``+``, ``-``, ``@`` or a tab and are no numbers: names of points, links and
    files come from whoever wrote the scene (OWASP, CSV injection).
    """
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([_harmless(cell) for cell in head])
    writer.writerows([_harmless(cell) for cell in row] for row in rows)


def write_columns(path: Path, columns: Mapping[str, Sequence[float]]) -> None:
    """Write columns of numbers by their heads, completely or not at all.

    Raises
    ------
    SceneError
        NOT_WRITABLE.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        write_table(file, columns, zip(*columns.values(), strict=True))


def _harmless(cell: Any) -> Any:
    if not isinstance(cell, str) or not cell.startswith(_EXECUTED):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def read_rows(path: Path) -> tuple[tuple[str, ...], list[list[str]]]:
    """A head, and rows of as many cells, as texts; commas separate, quotes surround.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND, NOT_READABLE; TABLE: no head, a name twice, or a row of another length, which is named.
    """
    text = text_of(path, "a table (CSV)", _MOST_BYTES, remedy="split the table")
    try:
        lines = csv.reader(io.StringIO(text, newline=""), strict=True)
        found = [(number, row) for number, row in enumerate(lines, 1) if any(row)]
    except csv.Error as problem:
        raise _faulty(path, str(problem), None, "give a CSV table") from None
    head = tuple(cell.strip() for cell in found[0][1]) if found else ()
    if not all(head) or len(set(head)) != len(head) or not head:
        raise _faulty(path, "the head must hold a name for each column, each once", list(head), "mend the first line")
    for number, row in found[1:]:
        if len(row) != len(head):
            raise _faulty(path, f"line {number} has {len(row)} cells", len(head), "give as many as the head has")
    return head, [[cell.strip() for cell in row] for _, row in found[1:]]


def _faulty(path: Path, message: str, limit: object, remedy: str) -> SceneError:
    return SceneError(Cause.TABLE, message, where=str(path), limit=limit, remedy=remedy)
