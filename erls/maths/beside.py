"""Compilation by two processes: while one compiles what is called for, another compiles what will be."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from threading import Condition, Thread

from erls.maths.jit import compiled_before, tell_of

_WORK = """
import contextlib, importlib, sys
for line in sys.stdin:
    with contextlib.suppress(Exception):
        importlib.import_module(line.strip())
    print(flush=True)
"""


class _Helper:
    """A process that compiles modules one after the other; what it has not begun can be taken from it."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _WORK],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            encoding="utf-8",
        )
        self._waiting: list[str] = []
        self._busy: str | None = None
        self._ends = False
        self._changed = Condition()
        self._feeder = Thread(target=self._feed, daemon=True)
        self._feeder.start()

    def _feed(self) -> None:
        given, done = self._process.stdin, self._process.stdout
        assert given is not None
        assert done is not None
        alive = True
        while alive:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._ends)
                if self._ends:
                    return
                self._busy = self._waiting.pop(0)
            try:
                print(self._busy, file=given, flush=True)
                alive = bool(done.readline())
            except OSError:  # whatever became of it: what it has not compiled is compiled where it is called
                alive = False
            with self._changed:
                self._busy = None
                self._changed.notify_all()

    def add(self, modules: Sequence[str]) -> None:
        """Have these compiled before what waits already."""
        with self._changed:
            self._waiting[:0] = modules
            self._changed.notify_all()

    def take(self, modules: Sequence[str]) -> str | None:
        """The last of these that has not been begun, which then is left out."""
        with self._changed:
            found = next((module for module in reversed(modules) if module in self._waiting), None)
            if found is not None:
                self._waiting.remove(found)
            return found

    def wait_for(self, modules: Sequence[str]) -> None:
        """Until it compiles none of these any more."""
        with self._changed:
            self._changed.wait_for(lambda: self._busy not in modules)

    def end(self, now: bool) -> None:
        """Let it go, at once or when it has done what it is at."""
        with self._changed:
            self._ends = True
            self._changed.notify_all()
        if now:
            self._process.terminate()
        for stream in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                assert stream is not None
                if not now:
                    self._feeder.join()
                stream.close()
        self._process.wait()


_at_work: list[_Helper] = []


@contextmanager
def compiling_beside(*modules: str) -> Iterator[None]:
    """While kernels are compiled here, have those of other modules compiled too, by a process of their own.

    What that process has not begun when the block ends is compiled here, from the last one on. Blocks within blocks
    share the process, whose first task are the modules of the innermost one.
    """
    waiting = [module for module in modules if module not in sys.modules and not compiled_before(module)]
    if not waiting or (os.cpu_count() or 1) < 2:
        yield
        return
    for module in waiting:
        tell_of(module)
    outermost = not _at_work
    if outermost:
        _at_work.append(_Helper())
    helper = _at_work[0]
    helper.add(waiting)
    try:
        yield
        while (left := helper.take(waiting)) is not None:
            import_module(left)
        helper.wait_for(waiting)
    except BaseException:
        if outermost:
            _at_work.remove(helper)
            helper.end(now=True)
        raise
    if outermost:
        _at_work.remove(helper)
        helper.end(now=False)
