"""One function, many arguments, several processes: who does what, and what came of it."""

from __future__ import annotations

import pickle
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from queue import Empty, SimpleQueue
from typing import Any

from erls.errors import Cause, SimulationError
from erls.parallel.worker_process import STOP
from erls.parallel.workers import IDLE, Answer, Worker
from fe_import.errors import ReportedError

_AHEAD_S, _MOST_AHEAD = 0.05, 16  # of work, and of calls, that wait in a worker for their turn
_STILLBORN = 4  # workers that may die before they had a task: what runs here instead could end this process, too


class Crew:
    """Workers that take the next task as soon as they are free; the process that calls them may take some, too.

    Parameters
    ----------
    work : callable
        Importable by name from a module other than the script; its argument and result can be pickled.
    tasks : sequence
        Arguments of ``work``; each is asked for when its turn comes.
    order : iterable of int, optional
        Numbers of the tasks as they are to be taken.
    prepare : callable, optional
        Likewise importable; each worker calls it with ``preparation`` before it takes a task.
    """

    def __init__(
        self,
        work: Callable[[Any], Any],
        tasks: Sequence[Any],
        order: Iterable[int] | None = None,
        prepare: Callable[[Any], Any] = bool,
        preparation: Any = None,
    ) -> None:
        self._work, self._tasks = work, tasks
        pickle.dumps((work, tasks[0] if len(tasks) else None))  # what cannot be sent is found here
        self._prepare = pickle.dumps((prepare, preparation))
        self._waiting = deque(range(len(tasks)) if order is None else order)
        self._given: set[int] = set()
        self._workers: set[Worker] = set()
        self._answers: SimpleQueue[Answer] = SimpleQueue()
        self._lock = threading.Lock()
        self._ended = False
        self._most_ahead = _MOST_AHEAD
        self._stillborn = 0
        self.members = 0  # that work, or are about to

    @property
    def waiting(self) -> int:
        """Tasks that nobody has taken."""
        return len(self._waiting)

    @property
    def given(self) -> int:
        """Tasks of workers whose answers were not fetched."""
        return len(self._given)

    @property
    def left(self) -> int:
        """Both."""
        with self._lock:
            return len(self._waiting) + len(self._given)

    def start(self, count: int) -> None:
        """Have ``count`` workers come."""
        with self._lock:
            self.members += count
        for _ in range(count):
            threading.Thread(target=self._lead, daemon=True).start()

    def take(self) -> int | None:
        """A task for this process; None when there is none left."""
        with self._lock:
            return self._waiting.popleft() if self._waiting else None

    def answers(self, wait_s: float = 0.0) -> list[Answer]:
        """What has come in; waits so long when nothing has."""
        found: list[Answer] = []
        try:
            while True:
                found.append(self._answers.get(timeout=wait_s) if wait_s and not found else self._answers.get_nowait())
        except Empty:
            pass
        with self._lock:
            self._given -= {answer.number for answer in found}
        return found

    def stop(self) -> None:
        """Give out no more tasks, and tell the workers that theirs are of no use; they answer all the same."""
        with self._lock:
            self._ended = True
            self._waiting.clear()
            workers = list(self._workers)
        for worker in workers:
            worker.send(STOP)

    def dismiss(self) -> None:
        """End all workers that have not answered."""
        with self._lock:
            self._ended = True
            self._waiting.clear()
            workers = list(self._workers)
        for worker in workers:
            IDLE.drop(worker)

    def _lead(self) -> None:
        """Give a worker tasks and take its answers, in a thread of its own; another one where it dies."""
        try:
            while self._lead_one():
                pass
        finally:
            with self._lock:
                self.members -= 1

    def _lead_one(self) -> bool:
        """Whether another worker shall come: this one died over a task, or before it had one."""
        try:
            worker = IDLE.take()
        except OSError:  # no more processes
            return False
        with self._lock:
            self._workers.add(worker)
        outstanding: deque[int] = deque()
        try:
            worker.send(0, self._prepare)
            ready = worker.receive()
            if ready is not None and ready.error is None:
                self._exchange(worker, outstanding)
        finally:
            with self._lock:
                self._workers.discard(worker)
            IDLE.give_back(worker)
        if ready is None:  # it was on its way out as it was taken, or died before it had a task
            with self._lock:
                self._stillborn += 1
                return self._stillborn <= _STILLBORN and not self._ended
        return bool(outstanding) and self._lost(list(outstanding))

    def _lost(self, numbers: list[int]) -> bool:
        """Whether tasks of a worker that died were put back: of several it is not known which it was."""
        with self._lock:
            again = len(numbers) > 1 and not self._ended
            if again:
                self._most_ahead = 1
                self._given -= set(numbers)
                self._waiting.extendleft(reversed(numbers))
        for number in () if again else numbers:
            self._answers.put(Answer(number, None, _died()))
        return again or not self._ended

    def _exchange(self, worker: Worker, outstanding: deque[int]) -> None:
        """Tasks against answers; leaves what was ``outstanding`` when the worker died."""
        most, answered, begun = 1, 0, time.perf_counter()
        while True:
            while len(outstanding) < most and (number := self._give()) is not None:
                worker.send(number, pickle.dumps((self._work, self._tasks[number])))
                outstanding.append(number)
            if not outstanding:
                return
            answer = worker.receive()
            if answer is None:
                return
            outstanding.remove(answer.number)
            answered += 1
            spent = (time.perf_counter() - begun) / answered
            most = min(1 + int(_AHEAD_S / spent), self._most_ahead)
            self._answers.put(answer)

    def _give(self) -> int | None:
        with self._lock:
            if not self._waiting:
                return None
            number = self._waiting.popleft()
            self._given.add(number)
            return number


def reported(answer: Answer) -> ReportedError | None:
    """The failure that an answer tells of, if any; raises an error of the program."""
    if answer.error is None or isinstance(answer.error, ReportedError):
        return answer.error
    if isinstance(answer.error, MemoryError):
        return _died()
    raise answer.error


def _died() -> SimulationError:
    remedy = "free memory, or run fewer at a time"
    return SimulationError(Cause.OUT_OF_MEMORY, "the process of this run died", remedy=remedy)
