"""Tables (CSV) of names and numbers that a spreadsheet takes for nothing else."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from typing import IO, Any

_EXECUTED = ("=", "+", "-", "@", "\t", "\r")


def write_table(file: IO[str], head: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a head and rows; cells that a spreadsheet would execute get an apostrophe before them.

    Those are texts that begin with ``=``, ``+``, ``-``, ``@`` or a tab and are no numbers: names of points, links and
    files come from whoever wrote the scene (OWASP, CSV injection).
    """
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([_harmless(cell) for cell in head])
    writer.writerows([_harmless(cell) for cell in row] for row in rows)


def _harmless(cell: Any) -> Any:
    if not isinstance(cell, str) or not cell.startswith(_EXECUTED):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell
