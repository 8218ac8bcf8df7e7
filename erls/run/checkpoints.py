"""Checkpoints of a simulation: a run file of what it has so far, and beside that what it needs to go on.

The group ``checkpoint`` holds the memory of each integration (`erls.integrate.memory`) that a simulation has made so
far (``effects = "auto"`` and ``strict`` may take several), by a digest of the scene that it integrates, and digests of
what everything was made from, so that nothing is continued that has changed since.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

import h5py
import msgspec
import numpy as np

from erls.errors import Cause, SceneError
from erls.integrate.memory import Memory
from erls.run.file import save_run
from erls.run.record import Run
from erls.scene.records import SceneFile
from fe_import.files.hdf5.files import open_for_reading, write_array, write_attribute, write_strings
from fe_import.files.hdf5.seal import seal_of
from fe_import.files.hdf5.values import Reader
from fe_import.modal.file import write_modal_group
from fe_import.modal.model import ModalModel

UNFINISHED = "unfinished"
EXTENDED = "run that is extended"
"""Among what runs are made from: a finished one, which is in a file of its own."""

_GROUP, _PROGRAM = "checkpoint", "program"
_BITS = ".bits"  # after the name of float64 values of which some are not finite: stored as int64
_ANEW = "run the scene again without --resume"


class Part(NamedTuple):
    """An integration: what it needs to go on, and the time that it took [s]."""

    memory: Memory
    wall_s: float


@dataclass(frozen=True)
class Saved:
    """What a checkpoint holds.

    Attributes
    ----------
    path : Path
    made_from : dict of str
        Digests of what the runs were made from, by name.
    made_with : str
        Versions and machine: what bits depend on.
    changes : tuple of str
        ``KEY=VALUE`` with which the scene was read.
    parts : dict of Part
        By digest of the scene that was integrated.
    """

    path: Path
    made_from: Mapping[str, str]
    made_with: str
    changes: tuple[str, ...]
    parts: Mapping[str, Part]


@dataclass
class Checkpoints:
    """What a simulation leaves at its checkpoints.

    Attributes
    ----------
    path : Path
        The file.
    changes : tuple of str
        ``KEY=VALUE`` with which the scene was read.
    saved : Saved or None
        What the simulation goes on from.
    """

    path: Path
    changes: tuple[str, ...] = ()
    saved: Saved | None = None
    made_from: Mapping[str, str] = field(default_factory=dict)
    finished: dict[str, Part] = field(default_factory=dict)

    def identify(
        self, scene: SceneFile, models: Iterable[ModalModel] = (), beside: Mapping[str, str] | None = None
    ) -> None:
        """Learn what the runs are made from: the scene with its tables in it, the modal models of its links, and what
        else there is, as digests.

        Raises
        ------
        SceneError
            CHANGED: what was saved is of something else.
        """
        self.made_from = {**_tables(scene), **_models(models), **(beside or {})}
        if self.saved is None:
            return
        now = {**self.made_from, _PROGRAM: made_with()}
        before = {**self.saved.made_from, _PROGRAM: self.saved.made_with}
        for name in (name for name in {**before, **now} if before.get(name) != now.get(name)):
            message = f"{name} is not what the run that shall be resumed began with"
            where, remedy = f"{self.saved.path}: {name}", f"take back the change, or {_ANEW}"
            value, limit = (now[name], before[name]) if name == _PROGRAM else (None, None)  # digests tell nothing
            raise SceneError(Cause.CHANGED, message, where=where, value=value, limit=limit, remedy=remedy)

    def part(self, key: str) -> Part | None:
        """What an integration goes on from."""
        return None if self.saved is None else self.saved.parts.get(key)

    def write(self, run: Run, key: str, part: Part | None) -> None:
        """Save an unfinished run, with what its integration needs to go on where it says so.

        Raises
        ------
        SceneError
            NOT_WRITABLE.
        """
        parts = {**self.finished, **({} if part is None else {key: part})}
        save_run(self.path, run, UNFINISHED, lambda group: self._fill(group.create_group(_GROUP), parts))

    def _fill(self, group: h5py.Group, parts: Mapping[str, Part]) -> None:
        write_attribute(group, "made_with", made_with())
        write_strings(group, "made_from", json.dumps(dict(self.made_from)), "digests of what the run was made from")
        write_strings(group, "changes", self.changes, "of the scene, as by --set")
        runs = group.create_group("integrations")
        for key, part in parts.items():
            own = runs.create_group(key)
            write_attribute(own, "wall_s", part.wall_s)
            for name, values in part.memory.items():
                known = bool(np.isfinite(values).all())
                stored = values if known else np.ascontiguousarray(values).view(np.int64)  # readers refuse the others
                write_array(own, name if known else name + _BITS, stored, "SI", "of the integrator")


def read_checkpoint(path: Path | str) -> Saved:
    """What a checkpoint holds.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND, NOT_READABLE, or RUN_FILE: damaged, or of a run whose integrator cannot go on from a checkpoint.
    """
    with open_for_reading(path, SceneError, Cause.RUN_FILE) as file:
        if _GROUP not in file.names_inside():
            raise file.fail(_GROUP, "no checkpoint, from which a run could be resumed")
        group = file.subgroup(_GROUP)
        made_from = _digests(group)
        runs = group.subgroup("integrations")
        parts = {key: _part(runs.subgroup(key)) for key in runs.names_inside()}
        if not parts:
            message = "its integrator cannot go on from a checkpoint (lobatto, generalized_alpha, rk45 and dop853 can)"
            raise SceneError(Cause.RUN_FILE, message, where=str(path), remedy=_ANEW)
        made, changes = group.attribute("made_with", str), group.names("changes")
        return Saved(Path(path), made_from, made, changes, parts)


def _part(group: Reader) -> Part:
    found = {name: group.numbers(name) for name in group.names_inside()}
    memory = {
        name.removesuffix(_BITS): values.view(np.float64) if name.endswith(_BITS) else values
        for name, values in found.items()
    }
    return Part(memory, group.attribute("wall_s", float))


def _digests(group: Reader) -> dict[str, str]:
    try:
        return msgspec.json.decode(group.text("made_from"), type=dict[str, str])
    except (msgspec.DecodeError, RecursionError) as problem:
        raise group.fail("made_from", f"not JSON: {problem}") from None


def key_of(scene: SceneFile) -> str:
    """Digest of a scene that is integrated: its settings, effects and links as they were chosen."""
    return _digest(msgspec.json.encode(scene.record))


@cache
def made_with() -> str:
    """Versions and machine: what the last bits of a run depend on."""
    names = ("erls", "numpy", "scipy", "numba")
    known = []
    for name in names:
        try:
            known.append(f"{name} {version(name)}")
        except PackageNotFoundError:  # a source tree that was not installed
            known.append(name)
    return ", ".join([*known, f"Python {platform.python_version()}", platform.system(), platform.machine()])


def _tables(scene: SceneFile) -> dict[str, str]:
    tables = msgspec.to_builtins(scene.record)
    return {f"table {name!r} of the scene": _digest(msgspec.json.encode(value)) for name, value in tables.items()}


def _models(models: Iterable[ModalModel]) -> dict[str, str]:
    """Digests of all that moves, by number and name of the link or piece."""
    found: dict[int, str] = {}
    result = {}
    for number, model in enumerate(models):
        if id(model) not in found:
            with h5py.File("model", "w", driver="core", backing_store=False) as file:
                write_modal_group(file, replace(model, provenance={}, recovery=None))
                found[id(model)] = seal_of(file)
        result[f"modal model {number} ({model.name!r})"] = found[id(model)]
    return result


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
