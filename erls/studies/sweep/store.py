"""The file of a sweep: a row for each point that is finished, kept as it comes.

SQLite, which comes with Python: rows are added to a file of any size in transactions that hold through kill -9, which
HDF5 does not promise, Parquet has no rows to add to, and Zarr makes a file of each chunk. A million points of ten
numbers take some 150 MB.
"""

from __future__ import annotations

import contextlib
import json
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from erls.errors import Cause, SceneError
from erls.files.results import MARK
from erls.maths.so3 import Array

SUFFIX = ".sweep"
VERSION = 1
_TABLES = {
    "about": "CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID",
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


class Store:
    """An open store; without a path it is in memory.

    Parameters
    ----------
    path : Path or None
    """

    def __init__(self, path: Path | None) -> None:
        self.where = "memory" if path is None else str(path)
        try:
            self._base = sqlite3.connect(":memory:" if path is None else path, isolation_level=None)
            self._base.execute("PRAGMA trusted_schema = OFF")
            self._base.execute("PRAGMA synchronous = NORMAL")
        except sqlite3.Error as problem:
            raise self._failed(problem) from None

    def begin(self, about: dict[str, Any]) -> None:
        """Make the tables of a new store."""
        told = {"written_by": "erls", "mark": MARK, "version": VERSION, **about}
        with self._saving():
            for words in _TABLES.values():
                self._base.execute(words)
            rows = [(name, json.dumps(value)) for name, value in told.items()]
            self._base.executemany("INSERT INTO about VALUES (?, ?)", rows)

    @property
    def empty(self) -> bool:
        """Whether nothing was begun in it."""
        with self._reading():
            return not self._base.execute("SELECT name FROM sqlite_master").fetchall()

    def tell(self, name: str, value: object) -> None:
        """Add to what `begin` was told."""
        with self._saving():
            self._base.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, json.dumps(value)))

    def about(self) -> dict[str, Any]:
        """What `begin` was told.

        Raises
        ------
        SceneError
            RUN_FILE: this is no such store, or damaged.
        """
        with self._reading():
            tables = dict(self._base.execute("SELECT name, sql FROM sqlite_master WHERE type <> 'index'"))
            if tables != _TABLES:
                raise sqlite3.DatabaseError("other tables")
            found = {name: json.loads(value) for name, value in self._base.execute("SELECT * FROM about")}
            if found.get("version") != VERSION:
                raise sqlite3.DatabaseError("another version")
            return found

    def add(self, rows: Iterable[Row]) -> None:
        """Keep rows, all or none."""
        with self._saving():
            self._base.executemany("INSERT OR REPLACE INTO points VALUES (?, ?, ?, ?, ?, ?, ?)", map(_packed, rows))

    def finished(self, failed: bool = True) -> Iterator[int]:
        """Numbers of the points that are there."""
        where = "" if failed else " WHERE numbers IS NOT NULL"
        with self._reading():
            yield from (number for (number,) in self._base.execute(f"SELECT number FROM points{where} ORDER BY number"))

    def rows(self) -> Iterator[Row]:
        """All that are there, by number; a page of them in memory at a time."""
        last = -1
        with self._reading():
            while page := self._base.execute(
                "SELECT * FROM points WHERE number > ? ORDER BY number LIMIT ?", (last, _PAGE)
            ).fetchall():
                yield from map(_unpacked, page)
                last = page[-1][0]

    def close(self) -> None:
        """Done with it."""
        self._base.close()

    @contextlib.contextmanager
    def _saving(self) -> Iterator[None]:
        try:
            self._base.execute("BEGIN IMMEDIATE")
            yield
            self._base.execute("COMMIT")
        except sqlite3.Error as problem:
            with contextlib.suppress(sqlite3.Error):
                self._base.execute("ROLLBACK")
            raise self._failed(problem) from None

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, ValueError, TypeError) as problem:
            message, remedy = f"no store of a sweep, or damaged: {problem}", "run the sweep anew, with another -o"
            raise SceneError(Cause.RUN_FILE, message, where=self.where, remedy=remedy) from None

    def _failed(self, problem: sqlite3.Error) -> SceneError:
        locked = "locked" in str(problem)
        remedy = "wait for the other process that is at it" if locked else "free disk space, or name another file"
        return SceneError(Cause.NOT_WRITABLE, f"cannot be written: {problem}", where=self.where, remedy=remedy)


def _packed(row: Row) -> tuple[Any, ...]:
    numbers = None if row.numbers is None else np.asarray(row.numbers, dtype="<f8").tobytes()
    warnings = json.dumps(row.warnings) if row.warnings else None
    return row.number, json.dumps(row.parameters), numbers, row.cause, row.message, warnings, row.wall_s


def _unpacked(row: Sequence[Any]) -> Row:
    number, parameters, numbers, cause, message, warnings, wall_s = row
    values = None if numbers is None else np.frombuffer(numbers, dtype="<f8").astype(float)
    return Row(number, json.loads(parameters), values, cause, message, tuple(json.loads(warnings or "[]")), wall_s)
