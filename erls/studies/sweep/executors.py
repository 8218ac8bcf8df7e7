"""Who evaluates the points of a sweep: processes of this program, or whatever has ``submit``.

An executor of `concurrent.futures`, of loky (joblib's), or a client of Dask takes a function and an argument and gives
a future that calls back. Few tasks wait at a time, so that memory does not grow with the number of points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from queue import SimpleQueue
from typing import Any, TypeVar

from erls.errors import Cause, SimulationError
from fe_import.errors import ReportedError

A = TypeVar("A")
R = TypeVar("R")

_AHEAD = 4  # tasks that wait for each worker


def evaluated(work: Callable[[A], R], tasks: Iterable[A], executor: Any, at_once: int) -> Iterator[R]:
    """Results as they come.

    Parameters
    ----------
    work : callable
        Importable by name.
    tasks : iterable
    executor : object
        With ``submit(function, argument)``.
    at_once : int
        Workers that it has.

    Raises
    ------
    SimulationError
        OUT_OF_MEMORY: the executor lost its workers.
    """
    options = {"pure": False} if hasattr(executor, "scheduler_info") else {}  # Dask: each call is one of its own
    done: SimpleQueue[Any] = SimpleQueue()
    waiting, given = iter(tasks), set()

    def give() -> bool:
        for task in waiting:
            future = executor.submit(work, task, **options)
            given.add(future)
            future.add_done_callback(done.put)
            return True
        return False

    try:
        while len(given) < _AHEAD * at_once and give():
            pass
        while given:
            future = done.get()
            given.discard(future)
            try:
                found = future.result()
            except (ReportedError, KeyboardInterrupt):
                raise
            except Exception as problem:
                message = f"the workers are gone: {type(problem).__name__}: {problem}"
                raise SimulationError(Cause.OUT_OF_MEMORY, message, remedy="start workers, and go on") from problem
            give()
            yield found
    finally:
        for future in given:
            future.cancel()


def workers_of(executor: Any, asked: int | None) -> int:
    """How many tasks it does at once, as far as it tells."""
    if asked is not None:
        return asked
    told = getattr(executor, "_max_workers", None)
    if isinstance(told, int):
        return told
    threads = getattr(executor, "nthreads", None)  # of Dask: by worker
    return max(1, sum(threads().values())) if callable(threads) else 4


def dask_client(address: str) -> Any:
    """A client of a Dask scheduler.

    Raises
    ------
    SceneError
        BAD_FIELD: Dask is not installed.
    SimulationError
        OUT_OF_MEMORY: no scheduler answers there.
    """
    from erls.files.optional import optional_package

    distributed = optional_package("distributed", "--scheduler")
    try:
        return distributed.Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as problem:
        remedy = "start one with dask scheduler, and dask worker ADDRESS beside it"
        message = f"no scheduler answers: {problem}"
        raise SimulationError(Cause.OUT_OF_MEMORY, message, where="--scheduler", value=address, remedy=remedy) from None
