"""Worker processes: where they come from and where they go; `erls.parallel.crew` gives them work.

A worker is a new interpreter with the search path of this one. It imports the functions that it calls and nothing
else, least of all the script that is running, so that scripts need no guard around what they do. Workers stay for what
comes next, as starting one takes about a second, and leave after five minutes without work or with this process.
"""

from __future__ import annotations

import atexit
import os
import pickle
import subprocess
import sys
import threading
from dataclasses import dataclass
from typing import Any

from erls.parallel.worker_process import GO, inside

_IDLE_S = 300.0
_PATIENCE_S = 5.0  # until a worker that was told to leave is killed
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def possible() -> bool:
    """Whether this process can start workers: it is no worker, and its interpreter is a program of its own."""
    return not inside() and bool(sys.executable) and not getattr(sys, "frozen", False)


@dataclass(frozen=True)
class Answer:
    """Of call ``number``: its result, or the error of which it failed."""

    number: int
    result: Any = None
    error: BaseException | None = None


class Worker:
    """One process."""

    def __init__(self) -> None:
        deaf = "import signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN)"
        path = [str(p) for p in sys.path]
        start = f"{deaf}; sys.path[:] = {path!r}; from erls.parallel.worker_process import serve; serve()"
        self.key = _surroundings()
        self._lock = threading.Lock()
        self.process = subprocess.Popen(
            [sys.executable, "-c", start],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **dict.fromkeys(_THREADS, "1")},  # cores are shared out among processes
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )

    def send(self, number: int, call: bytes | None = None) -> None:
        """A call, or `STOP` or `GO`; a worker that died says so when it is asked for an answer."""
        assert self.process.stdin is not None
        try:
            with self._lock:
                pickle.dump((number, call), self.process.stdin, pickle.HIGHEST_PROTOCOL)
                self.process.stdin.flush()
        except (OSError, ValueError):
            pass

    def receive(self) -> Answer | None:
        """The next answer; None when the process died."""
        assert self.process.stdout is not None
        try:
            number, (result, error) = pickle.load(self.process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            return None
        try:
            return Answer(number, None if result is None else pickle.loads(result), error)
        except Exception as problem:
            return Answer(number, None, problem)

    def leave(self, now: bool = False) -> None:
        """End the process, ``now`` also in the middle of a call."""
        if now:
            self.process.kill()
        with self._lock:
            for stream in (self.process.stdin, self.process.stdout):
                try:
                    if stream is not None:
                        stream.close()
                except OSError:
                    pass
        try:
            self.process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Idle:
    """Workers without work; those of another folder, path, or settings in ``ERLS_*`` are of no use."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.workers: list[Worker] = []
        self.everyone: set[Worker] = set()
        self.timer: threading.Timer | None = None

    def usable(self) -> int:
        """How many would serve at once."""
        with self.lock:
            return len([w for w in self.workers if self._fits(w)])

    @staticmethod
    def _fits(worker: Worker) -> bool:
        return worker.key == _surroundings() and worker.process.poll() is None

    def take(self) -> Worker:
        """One of them, or a new one."""
        with self.lock:
            if self.timer is not None:
                self.timer.cancel()
            fitting = [w for w in self.workers if self._fits(w)]
            for other in self.workers:
                if other not in fitting:
                    self._leave(other)
            self.workers = fitting
            worker = self.workers.pop() if self.workers else Worker()
            self.everyone.add(worker)
        worker.send(GO)
        return worker

    def give_back(self, worker: Worker) -> None:
        """Keep one for later."""
        with self.lock:
            if not self._fits(worker):
                self._leave(worker)
                return
            self.workers.append(worker)
            if self.timer is not None:
                self.timer.cancel()
            self.timer = threading.Timer(_IDLE_S, self.dismiss)
            self.timer.daemon = True
            self.timer.start()

    def drop(self, worker: Worker) -> None:
        """One that died or must."""
        with self.lock:
            self._leave(worker, now=True)

    def dismiss(self) -> None:
        """All that have nothing to do."""
        with self.lock:
            for worker in self.workers:
                self._leave(worker)
            self.workers = []

    def _leave(self, worker: Worker, now: bool = False) -> None:
        self.everyone.discard(worker)
        if worker.key[0] == os.getpid():  # after a fork they are those of the parent
            worker.leave(now)

    def end(self) -> None:
        """Before this process ends."""
        with self.lock:
            for worker in [*self.everyone]:
                self._leave(worker, now=worker not in self.workers)


def _surroundings() -> tuple[Any, ...]:
    """What a worker takes over from this process when it starts."""
    settings = sorted((k, v) for k, v in os.environ.items() if k.startswith("ERLS_"))
    try:
        folder = os.getcwd()
    except OSError:  # it was removed
        folder = ""
    return os.getpid(), folder, tuple(map(str, sys.path)), tuple(settings)


IDLE = Idle()
atexit.register(IDLE.end)
