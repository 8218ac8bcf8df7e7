"""The file of a sweep: a row for each point that is finished, kept as it comes.

Rows are added to a file of SQLite of any size in transactions that hold through kill -9, which HDF5 does not promise,
Parquet has no rows to add to, and Zarr makes a file of each chunk. A million points of ten numbers take some 150 MB.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from erls.maths.so3 import Array
from erls.studies.database import Database

SUFFIX = ".sweep"
VERSION = 1
_TABLES = {
    "about": Database.about_table,
    "points": "CREATE TABLE points (number INTEGER PRIMARY KEY, parameters TEXT NOT NULL, numbers BLOB, cause TEXT, "
    "message TEXT, warnings TEXT, wall_s REAL)",
}
_PAGE = 10_000  # rows that are read at a time


class Row(NamedTuple):
    """A finished point.

    Attributes
    ----------
    number : int
        Of the point, from 0.
    parameters : list
        A value for each key.
    numbers : (q,) array or None
        Of the quantities; None where the run failed.
    cause, message : str
        Why it failed.
    warnings : tuple of str
        What the run told.
    wall_s : float
        Time of the integration.
    """

    number: int
    parameters: list[Any]
    numbers: Array | None
    cause: str = ""
    message: str = ""
    warnings: tuple[str, ...] = ()
    wall_s: float = 0.0


class Store(Database):
    """An open store; without a path it is in memory.

    Parameters
    ----------
    path : Path or None
    """

    tables, version, kind, content = _TABLES, VERSION, "store of a sweep", "finished points"

    def add(self, rows: Iterable[Row]) -> None:
        """Keep rows, all or none."""
        with self._saving():
            self._base.executemany("INSERT OR REPLACE INTO points VALUES (?, ?, ?, ?, ?, ?, ?)", map(_packed, rows))

    def finished(self, failed: bool = True) -> Iterator[int]:
        """Numbers of the points that are there."""
        where = "" if failed else " WHERE numbers IS NOT NULL"
        with self._reading():
            yield from (number for (number,) in self._base.execute(f"SELECT number FROM points{where} ORDER BY number"))

    def held(self) -> int:
        """Finished points."""
        return sum(1 for _ in self.finished())

    def rows(self) -> Iterator[Row]:
        """All that are there, by number; a page of them in memory at a time."""
        last = -1
        with self._reading():
            while page := self._base.execute(
                "SELECT * FROM points WHERE number > ? ORDER BY number LIMIT ?", (last, _PAGE)
            ).fetchall():
                yield from map(_unpacked, page)
                last = page[-1][0]


def _packed(row: Row) -> tuple[Any, ...]:
    numbers = None if row.numbers is None else np.asarray(row.numbers, dtype="<f8").tobytes()
    warnings = json.dumps(row.warnings) if row.warnings else None
    return row.number, json.dumps(row.parameters), numbers, row.cause, row.message, warnings, row.wall_s


def _unpacked(row: Sequence[Any]) -> Row:
    number, parameters, numbers, cause, message, warnings, wall_s = row
    values = None if numbers is None else np.frombuffer(numbers, dtype="<f8").astype(float)
    return Row(number, json.loads(parameters), values, cause, message, tuple(json.loads(warnings or "[]")), wall_s)
