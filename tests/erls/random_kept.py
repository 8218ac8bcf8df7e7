"""References of random scenes that outlast the runs which they judge: files by what was run, not by who ran it.

A better run takes ten times as long as the run that it judges, and says the same whatever becomes of that one. Its
places are kept by the digest of the scene that was run; a file that is of other places, or damaged, is made anew.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from random_scenes import RandomScene

from erls.maths.so3 import Array

_NEAR = 0.05  # of an end: events end better runs a little elsewhere


@dataclass(frozen=True)
class Kept:
    """What came of a better run: places up to an end [m], or the problem that ended it."""

    end: float
    places: Array | None
    problem: str


@dataclass(frozen=True)
class KeptReferences:
    """Those of one seed.

    Attributes
    ----------
    folder : Path or None
        None: nothing is kept.
    seed : int
    """

    folder: Path | None
    seed: int

    def end(self, reached: float) -> float:
        """Up to when runs are judged that have been reached so far: as before, where they get that far [s]."""
        ends = [kept.end for kept in map(_read, self._files()) if kept is not None]
        near = [end for end in ends if reached >= end > (1 - _NEAR) * reached]
        return max(near, default=reached)

    def find(self, scene: RandomScene, end: float) -> Kept | None:
        """What is kept of a run of this scene up to this end."""
        file = self._file(scene)
        kept = _read(file) if file is not None and file.exists() else None
        return kept if kept is not None and kept.end == end else None

    def keep(self, scene: RandomScene, kept: Kept) -> None:
        """Write it, whole or not at all."""
        file = self._file(scene)
        if file is None:
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        partial = file.with_suffix(".partial")
        places = np.zeros((0, 0, 3)) if kept.places is None else kept.places
        with partial.open("wb") as stream:
            np.savez_compressed(stream, end=kept.end, places=places, problem=kept.problem)
        partial.replace(file)

    def _files(self) -> list[Path]:
        return [] if self.folder is None else sorted(self.folder.glob(f"{self.seed:05d}-*.npz"))

    def _file(self, scene: RandomScene) -> Path | None:
        if self.folder is None:
            return None
        text = json.dumps([scene.tables, scene.links], sort_keys=True, default=str)
        return self.folder / f"{self.seed:05d}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.npz"


def _read(file: Path) -> Kept | None:
    try:
        with np.load(file) as stored:
            places, problem = stored["places"], str(stored["problem"])
            return Kept(float(stored["end"]), None if problem else places, problem)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None
