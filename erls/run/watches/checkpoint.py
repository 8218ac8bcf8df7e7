"""The checkpoints of an integration: when they are written, and what it goes on from."""

from __future__ import annotations

import time
from collections.abc import Callable

from erls.errors import SceneError
from erls.integrate.base import Solution
from erls.integrate.memory import Memory, time_of
from erls.run.checkpoints import Checkpoints, Part
from erls.run.watches.base import NOTHING, Finding, Knots, Started, Watch

FIRST_S, LEAST_S = 1.0, 1.0
"""Work before the first checkpoint, which takes a tenth of that, and between two of them at the least [s]."""

_SHARE, _WAITING = 0.02, 0.1  # of the time of a run: what checkpoints may cost, and wait for disks and other processes


class Checkpoint(Watch):
    """Writes an unfinished run to a file from its first second on, ever more rarely where that takes long.

    It also is the `erls.integrate.memory.Keeper` of the integration. An integrator that cannot be resumed offers it
    nothing: then the file can be read, and no more.

    Parameters
    ----------
    checkpoints : Checkpoints
        Of the simulation.
    key : str
        Of the integration (`erls.run.checkpoints.key_of`).
    """

    def __init__(self, checkpoints: Checkpoints, key: str) -> None:
        self._checkpoints, self._key = checkpoints, key
        self._found = found = checkpoints.part(key)
        self.memory: Memory | None = None if found is None else found.memory
        self.spent: float = 0.0 if found is None else found.wall_s
        """Work that was saved [s]."""
        self._knots: Knots | None = None
        self._seen = 0.0
        self._offered: Callable[[], Memory] | None = None
        self._problem = ""

    @property
    def since(self) -> float:
        """Time up to which the run was looked at before [s]."""
        return time_of(self) or 0.0

    def begins(self, begun: Started) -> Finding:
        """Nothing; the clock starts."""
        self._run_of, self._begun = begun.run_of, time.perf_counter()
        self._due = self._begun + FIRST_S
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """That a file could not be written: a full disk may have room again at the end."""
        silent = self._knots is not None and self._offered is None
        self._knots, self._seen = knots, t
        if silent and time.perf_counter() >= self._due:
            self._write(None)
        problem, self._problem = self._problem, ""
        return Finding(notes=(problem,)) if problem else NOTHING

    def offer(self, memory: Callable[[], Memory]) -> None:
        """What the integration needs to go on from where it is."""
        self._offered = memory
        if time.perf_counter() >= self._due:
            self._write(memory)

    def ends(self, solution: Solution) -> Finding:
        """Nothing; an integration that came to its end is not made again, whatever comes after it."""
        if solution.failure is None and self._offered is None and self._found is not None:
            self._checkpoints.finished[self._key] = self._found  # it had come to its end before
        if solution.failure is not None or self._offered is None:
            return NOTHING
        part = self._part(self._offered)
        if part.memory["time"] == self._seen:  # otherwise a watch ended it, and has to do so again
            self._checkpoints.finished[self._key] = part
            if time.perf_counter() >= self._due:
                self._write(self._offered)
        return NOTHING

    def _part(self, memory: Callable[[], Memory]) -> Part:
        return Part(memory(), self.spent + time.perf_counter() - self._begun)

    def _write(self, memory: Callable[[], Memory] | None) -> None:
        begun, worked = time.perf_counter(), time.thread_time()
        assert self._knots is not None
        part = None if memory is None else self._part(memory)
        try:
            self._checkpoints.write(self._run_of(self._knots()), self._key, part)
        except (SceneError, MemoryError) as problem:
            self._problem = f"warning: no checkpoint: {problem}"
        now, work = time.perf_counter(), time.thread_time() - worked
        self._due = now + max(LEAST_S, work / _SHARE, (now - begun) / _WAITING)
