"""A file that takes what studies finish as it comes, and holds it through kill -9: SQLite, which comes with Python."""

from __future__ import annotations

import contextlib
import json
import sqlite3
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

from erls.errors import Cause, SceneError
from erls.files.output import not_writable
from erls.files.results import MARK


class Database(ABC):
    """An open file; without a path it is in memory.

    Parameters
    ----------
    path : Path or None

    Attributes
    ----------
    tables : dict of str
        What makes each table, ``about`` among them.
    version : int
    kind, content : str
        What the file is, and what it holds, for messages.
    """

    tables: ClassVar[Mapping[str, str]]
    version: ClassVar[int]
    kind: ClassVar[str]
    content: ClassVar[str]
    about_table: ClassVar[str] = "CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID"

    def __init__(self, path: Path | None) -> None:
        self.where = "memory" if path is None else str(path)
        try:
            self._base = sqlite3.connect(":memory:" if path is None else path, isolation_level=None)
            self._base.execute("PRAGMA trusted_schema = OFF")
            self._base.execute("PRAGMA synchronous = NORMAL")
        except sqlite3.Error as problem:
            raise self._failed(problem) from None

    def begin(self, about: Mapping[str, Any]) -> None:
        """Make the tables of a new file."""
        told = {"written_by": "erls", "mark": MARK, "version": self.version, **about}
        with self._saving():
            for words in self.tables.values():
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
            RUN_FILE: this is no such file, or damaged.
        """
        with self._reading():
            tables = dict(self._base.execute("SELECT name, sql FROM sqlite_master WHERE type <> 'index'"))
            if tables != self.tables:
                raise sqlite3.DatabaseError("other tables")
            found = {name: json.loads(value) for name, value in self._base.execute("SELECT * FROM about")}
            if found.get("version") != self.version:
                raise sqlite3.DatabaseError("another version")
            return found

    @abstractmethod
    def held(self) -> int:
        """How many finished things it holds."""

    @classmethod
    def make_room(cls, path: Path, force: bool) -> None:
        """Take a file away that was there, unless it holds what may have taken long.

        Raises
        ------
        SceneError
            NOT_WRITABLE: it does, and ``force`` is not given. RUN_FILE: it is no such file.
        """
        if path.exists() and not force:
            with contextlib.closing(cls(path)) as base:
                held = 0 if base.empty else base.held()
            if held:
                remedy = "go on with it (--resume), name another, or replace it (--force)"
                raise not_writable(path, f"it holds {held} {cls.content}", remedy)
        path.unlink(missing_ok=True)

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
            message, remedy = f"no {self.kind}, or damaged: {problem}", "run it anew, into another file"
            raise SceneError(Cause.RUN_FILE, message, where=self.where, remedy=remedy) from None

    def _failed(self, problem: sqlite3.Error) -> SceneError:
        locked = "locked" in str(problem)
        remedy = "wait for the other process that is at it" if locked else "free disk space, or name another file"
        return SceneError(Cause.NOT_WRITABLE, f"cannot be written: {problem}", where=self.where, remedy=remedy)
