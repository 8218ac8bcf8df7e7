"""Results of a study's runs, kept as they come and found again by content: files, settings, program.

What a run depends on is its key, so that a file may hold runs of several studies, and none is taken for another.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.files.results import claim
from erls.scene.inputs import files_of
from erls.scene.read import load_scene
from erls.studies.database import Database
from erls.studies.pool import Finished
from fe_import.errors import Cause as FECause
from fe_import.errors import FEImportError, ReportedError
from fe_import.files.versions import package_version

SUFFIX = ".study"
_PASSING = (Cause.INTERRUPTED, Cause.OUT_OF_MEMORY, Cause.BUDGET)  # another time it may go well
_ERRORS: dict[str, tuple[type[ReportedError], Any]] = {
    "scene": (SceneError, Cause),
    "simulation": (SimulationError, Cause),
    "model": (FEImportError, FECause),
}


_TABLES = {
    "about": Database.about_table,
    "results": "CREATE TABLE results (key BLOB PRIMARY KEY, value BLOB NOT NULL) WITHOUT ROWID",
}


class _Results(Database):
    """The file."""

    tables, version, kind, content = _TABLES, 1, "file of a study", "finished runs"

    def get(self, key: bytes) -> bytes | None:
        """What is kept."""
        with self._reading():
            found = self._base.execute("SELECT value FROM results WHERE key = ?", (key,)).fetchone()
        return None if found is None else bytes(found[0])

    def keep(self, key: bytes, value: bytes) -> None:
        """Until somebody asks again."""
        with self._saving():
            self._base.execute("INSERT OR REPLACE INTO results VALUES (?, ?)", (key, value))

    def held(self) -> int:
        """Results."""
        with self._reading():
            return int(self._base.execute("SELECT COUNT(*) FROM results").fetchone()[0])


@dataclass(frozen=True)
class Kept:
    """Where a study keeps the results of its runs.

    Attributes
    ----------
    results : _Results or None
        Nowhere, if None.
    content : str
        Of the files that its runs read.
    """

    results: _Results | None
    content: str

    def find(self, what: Any, kind: Any) -> tuple[Any, ReportedError | None] | None:
        """Result and error of a run, if it was kept.

        Parameters
        ----------
        what : object
            All that it depends on beside files and program.
        kind : type
            Of the result.
        """
        stored = None if self.results is None else self.results.get(self._key(what))
        if stored is None:
            return None
        try:
            found: tuple[Any, ReportedError | None] = msgspec.msgpack.decode(
                stored, type=tuple[kind | None, ReportedError | None], dec_hook=_decoded
            )
        except msgspec.MsgspecError:
            return None  # of a form that this program no longer has
        return found

    def keep(self, what: Any, result: Any, error: ReportedError | None = None) -> None:
        """A result, or why there is none; what another time may go well is not kept."""
        if self.results is not None and not (error is not None and error.cause in _PASSING):
            value = msgspec.msgpack.encode((result, error), enc_hook=_encoded)
            self.results.keep(self._key(what), value)

    def once(self, what: Any, kind: Any, find: Callable[[], Any]) -> Any:
        """A result that was kept, or found now."""
        known = self.find(what, kind)
        if known is not None and known[1] is None:
            return known[0]
        found = find()
        self.keep(what, found)
        return found

    def _key(self, what: Any) -> bytes:
        told = (package_version("erls"), self.content, what)
        return hashlib.sha256(msgspec.msgpack.encode(told, enc_hook=_encoded)).digest()


@dataclass(frozen=True)
class KeptRuns:
    """Results of the tasks of a study, as `erls.studies.pool.run_all` takes them.

    Attributes
    ----------
    kept : Kept
    tasks : sequence
        What each depends on beside files and program.
    kind : type
        Of a result.
    lasting : callable
        Whether a result would be the same another time.
    """

    kept: Kept
    tasks: Sequence[Any]
    kind: Any
    lasting: Callable[[Any], bool] = lambda result: True

    def found(self) -> list[Finished]:
        """Those from before."""
        known = [(number, self.kept.find(task, self.kind)) for number, task in enumerate(self.tasks)]
        return [Finished(number, *one) for number, one in known if one is not None]

    def keep(self, one: Finished) -> None:
        """One of now."""
        if one.error is not None or self.lasting(one.result):
            self.kept.keep(self.tasks[one.number], one.result, one.error)


@dataclass(frozen=True)
class State:
    """Where the results of a study are to be kept.

    Attributes
    ----------
    path : Path
        ``.study``
    resume : bool
        Go on with the file.
    force : bool
        Replace one that holds results, which is refused otherwise.
    """

    path: Path
    resume: bool = False
    force: bool = False


@contextmanager
def keeping(state: State | None, scene: Path, overrides: Sequence[str]) -> Iterator[Kept]:
    """Results of runs of a scene, in a file, if any.

    Parameters
    ----------
    state : State or None
    scene : Path
    overrides : sequence of str
        Of all runs.

    Raises
    ------
    SceneError, FEImportError
        NOT_WRITABLE, or a bad scene.
    """
    if state is None:
        yield Kept(None, "")
        return
    path, loaded = state.path, load_scene(scene, overrides)
    claim(path, SUFFIX, files_of(loaded), state.force and not state.resume)
    if not state.resume:
        _Results.make_room(path, state.force)
    with closing(_Results(path)) as base:
        if base.empty:
            base.begin({})
        base.about()
        yield Kept(base, content_of(scene, overrides))


def content_of(scene: Path, overrides: Sequence[str]) -> str:
    """What tells the files of a scene from what they were before."""
    files = hashlib.sha256()
    for file in files_of(load_scene(scene, overrides)):
        files.update(file.read_bytes() if file.is_file() else b"")
    return files.hexdigest()


def _encoded(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, np.ascontiguousarray(value).tobytes()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, ReportedError):
        kind = next(name for name, (own, _) in _ERRORS.items() if isinstance(value, own))
        plain = str, int, float, list, type(None)
        shown = [x if isinstance(x, plain) else str(x) for x in (value.value, value.limit)]
        return kind, str(value.cause), value.message, value.where, shown, value.remedy
    raise TypeError(f"results of studies hold no {type(value).__name__}")


def _decoded(kind: Any, told: Any) -> Any:
    if kind is ReportedError:
        name, cause, message, where, (value, limit), remedy = told
        own, causes = _ERRORS[name]
        return own(causes(cause), message, where=where, value=value, limit=limit, remedy=remedy)
    dtype, shape, content = told
    return np.frombuffer(content, dtype=dtype).reshape(shape).copy()
