"""Independent runs on all cores: finished ones are kept when the user interrupts or one of them fails."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, TypeVar

from erls.errors import Cause, SceneError, SimulationError
from fe_import.errors import ReportedError

A = TypeVar("A")
R = TypeVar("R")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Finished:
    """Result of one task, or why there is none."""

    number: int
    result: Any
    error: ReportedError | None


def run_all(
    work: Callable[[A], R],
    tasks: Sequence[A],
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
    longest_last: bool = True,
) -> tuple[list[Finished], bool]:
    """Results of ``work`` for every task, in the order of the tasks.

    Parameters
    ----------
    work : callable
        Importable by name; its argument and result can be pickled.
    tasks : sequence
    progress : callable
        Called with (finished, all).
    workers : int, optional
        Processes; as many as cores unless given. One runs in this process.
    longest_last : bool
        Whether the last tasks take longest, so that several processes start with them.

    Returns
    -------
    finished : list of Finished
    complete : bool
        False after an interrupt.

    Raises
    ------
    SceneError
        ``workers`` is not positive.
    """
    if workers is not None and workers < 1:
        message = "the number of workers must be positive"
        raise SceneError(Cause.BAD_FIELD, message, where="workers", value=workers, remedy="give 1 or more")
    count = min(workers or os.cpu_count() or 1, len(tasks))
    finished: list[Finished] = []
    try:
        for one in _here(work, tasks) if count <= 1 else _spread(work, tasks, count, longest_last):
            finished.append(one)
            progress(len(finished), len(tasks))
    except KeyboardInterrupt:
        return sorted(finished, key=lambda f: f.number), False
    return sorted(finished, key=lambda f: f.number), True


def _here(work: Callable[[A], R], tasks: Sequence[A]) -> Iterator[Finished]:
    for number, task in enumerate(tasks):
        try:
            yield Finished(number, work(task), None)
        except ReportedError as problem:
            if problem.cause == Cause.INTERRUPTED:
                raise KeyboardInterrupt from None
            yield Finished(number, None, problem)


def _spread(work: Callable[[A], R], tasks: Sequence[A], count: int, longest_last: bool) -> Iterator[Finished]:
    numbers: dict[Future[tuple[R | None, ReportedError | None]], int] = {}
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read by the workers when they load their libraries
    pool = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_deaf)
    try:
        numbered = list(enumerate(tasks))
        for number, task in reversed(numbered) if longest_last else numbered:
            numbers[pool.submit(_caught, work, task)] = number
        waiting = set(numbers)
        while waiting:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                result, error = _result(future)
                yield Finished(numbers[future], result, error)
    finally:
        if any(not future.done() for future in numbers):  # interrupted: a run in progress is of no use any more
            for process in list((pool._processes or {}).values()):
                process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _result(future: Future[tuple[R | None, ReportedError | None]]) -> tuple[R | None, ReportedError | None]:
    try:
        return future.result()
    except (BrokenExecutor, MemoryError):
        remedy = "free memory, or run fewer at a time"
        return None, SimulationError(Cause.OUT_OF_MEMORY, "the process of this run died", remedy=remedy)


def _caught(work: Callable[[A], R], task: A) -> tuple[R | None, ReportedError | None]:
    try:
        return work(task), None
    except ReportedError as problem:
        return None, problem  # pickled without the run that it may carry


def _deaf() -> None:
    """Workers leave Ctrl-C to the process that started them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
