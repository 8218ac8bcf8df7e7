"""What a caller of a simulation looks with: a bar that advances, and a file that keeps what a long run has."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from erls.errors import SceneError
from erls.run.file import write_run
from erls.run.watches.base import NOTHING, Finding, Knots, Started, Watch

CHECKPOINT_S = 20.0  # a killed run loses at most this much work


class Progress(Watch):
    """Calls ``advance`` with (time, duration) after each step."""

    def __init__(self, advance: Callable[[float, float], None]) -> None:
        self._advance, self._duration = advance, 0.0

    def begins(self, begun: Started) -> Finding:
        """Nothing; it learns the duration."""
        self._duration = begun.duration
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """Nothing; it calls."""
        self._advance(t, self._duration)
        return NOTHING


class Checkpoint(Watch):
    """Writes an unfinished run to a file, every 20 s of work."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def begins(self, begun: Started) -> Finding:
        """Nothing; the clock starts."""
        self._run_of, self._saved = begun.run_of, time.perf_counter()
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """That the file cannot be written: a full disk may have room again at the end."""
        if time.perf_counter() - self._saved <= CHECKPOINT_S:
            return NOTHING
        finding = NOTHING
        try:
            write_run(self._path, self._run_of(knots()), "unfinished")
        except SceneError as problem:
            finding = Finding(notes=(f"warning: no checkpoint: {problem}",))
        self._saved = time.perf_counter()
        return finding
