"""What is known of designs: arrays by design, kept in a file, so that an optimization can go on where it was stopped.

A method is deterministic: begun again, it asks for the same designs, and those that are known cost nothing. No pickles:
a file holds numbers and names alone, with the SHA-256 of the problem that they belong to.
"""

from __future__ import annotations

import contextlib
import copy
import hashlib
import json
import time
import zipfile
from pathlib import Path

import msgspec
import numpy as np

from erls.errors import Cause, SceneError
from erls.files.output import replacing
from erls.maths.so3 import Array
from erls.optimization.problem import Problem
from erls.scene.build import link_description
from fe_import.files.versions import package_version

_FORMAT = "erls optimization 1"
_MOST = 2_000_000_000  # bytes of all arrays
_SHARE = 0.02  # of the time that writing may take: a file of all analyses is written as a whole


class Memory:
    """Arrays by design.

    Parameters
    ----------
    problem : Problem
    path : Path, optional
        File that is written after analyses, as often as takes no more than a small share of the time, and by `flush`.
    resume : bool
        Read it first.

    Raises
    ------
    SceneError
        NOT_READABLE, RUN_FILE, CHANGED: the file is of another problem.
    """

    def __init__(self, problem: Problem, path: Path | None = None, resume: bool = False) -> None:
        self.path, self._key, self._label = path, key_of(problem), ""
        self._known: dict[str, Array] = {}
        self._due, self._unwritten = 0.0, False
        if path is not None and resume:
            self._read(path)

    def labelled(self, label: str) -> Memory:
        """The same file, for designs of an alternative."""
        found = copy.copy(self)
        found._label = label
        return found

    def get(self, x: Array, name: str) -> Array | None:
        """What is known of a design under a name."""
        return self._known.get(self._name(x, name))

    def put(self, x: Array, **arrays: Array) -> None:
        """Keep arrays of a design."""
        for name, array in arrays.items():
            self._known[self._name(x, name)] = np.asarray(array)
        self._unwritten = True
        if time.monotonic() >= self._due:
            self.flush()

    def flush(self) -> None:
        """Write what the file has not."""
        if self.path is None or not self._unwritten:
            return
        begun = time.monotonic()
        self._write(self.path)
        ended = time.monotonic()
        self._due, self._unwritten = ended + (ended - begun) / _SHARE, False

    def _name(self, x: Array, name: str) -> str:
        about = np.ascontiguousarray(x, dtype=float).tobytes() + self._label.encode()
        return hashlib.sha256(about).hexdigest()[:32] + "." + name

    def _write(self, path: Path) -> None:
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, about=np.array(json.dumps([_FORMAT, self._key])), **self._known)

    def _read(self, path: Path) -> None:
        where = str(path)
        found: dict[str, Array] = {}
        about = None
        try:
            with zipfile.ZipFile(path) as whole:
                if sum(entry.file_size for entry in whole.infolist()) > _MOST:
                    raise ValueError("too large")
            with path.open("rb") as data, np.load(data, allow_pickle=False) as file:
                for name in file.files:
                    found[name] = np.asarray(file[name])
            with contextlib.suppress(ValueError):
                about = json.loads(str(found.pop("about", "")))
        except FileNotFoundError:
            remedy = "give the file of an optimization that was stopped, or leave --resume out"
            raise SceneError(Cause.FILE_NOT_FOUND, "no such file", where=where, remedy=remedy) from None
        except Exception as problem:
            message, remedy = f"no record of an optimization: {problem}", "leave --resume out"
            raise SceneError(Cause.NOT_READABLE, message, where=where, remedy=remedy) from None
        if not isinstance(about, list) or len(about) != 2 or about[0] != _FORMAT:
            remedy = "give the file that --state wrote, or leave --resume out"
            raise SceneError(Cause.NOT_READABLE, "no record of an optimization", where=where, remedy=remedy)
        if about[1] != self._key:
            message, remedy = "the record is one of another problem, or the problem was changed", "leave --resume out"
            raise SceneError(Cause.CHANGED, message, where=where, remedy=remedy)
        self._known = {name: array.astype(float) for name, array in found.items() if array.dtype.kind == "f"}


def key_of(problem: Problem) -> str:
    """SHA-256 of what designs and their motions depend on, the version with it, limits and settings apart."""
    record = problem.record
    named = [record.variables, record.constraints, *([record.choices] if record.choices else [])]
    about = [package_version("erls"), problem.scene.record, *named]
    digest = hashlib.sha256(msgspec.json.encode(about, order="deterministic"))
    for link in problem.scene.record.links:
        if link.model:
            digest.update(link_description(problem.scene, link).content_hash().encode())
        elif link.modal_file:
            digest.update((problem.scene.folder / link.modal_file).read_bytes())
    return digest.hexdigest()
