"""Threads for compiled functions, and how many there may be.

As many as ``OMP_NUM_THREADS`` says, or else as there are processors for this process. While they work, the linear
algebra that they call keeps to one thread each.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Any

_VARIABLE = "OMP_NUM_THREADS"


def threads() -> int:
    """How many threads work side by side."""
    given = os.environ.get(_VARIABLE, "").partition(",")[0].strip()
    if given.isdigit() and int(given) > 0:
        return int(given)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def side_by_side(work: Callable[[Any], Any], items: Sequence[Any], among: int | None = None) -> list[Any]:
    """What a function gives for each item, which threads take in turn, this one among them.

    Parameters
    ----------
    work : callable
        Called in any of the threads.
    items : sequence
        Those that take longest come first.
    among : int, optional
        Threads at most; as many as there are unless given.

    Raises
    ------
    BaseException
        The first of what was raised; no other item is begun after it.
    """
    helpers = min(threads() if among is None else among, len(items)) - 1
    results: list[Any] = [None] * len(items)
    waiting, lock, stopped = iter(range(len(items))), threading.Lock(), threading.Event()

    def take() -> None:
        while not stopped.is_set():
            with lock:
                number = next(waiting, None)
            if number is None:
                return
            results[number] = work(items[number])

    def guarded() -> None:
        try:
            take()
        except BaseException:
            stopped.set()
            raise

    with one_thread_each():
        hired: list[Future[None]] = [_pool(os.getpid(), helpers).submit(guarded) for _ in range(helpers)]
        try:
            guarded()
        finally:
            problems = [helper.exception() for helper in hired]  # which waits for what they have begun
        for problem in problems:
            if problem is not None:
                raise problem
    return results


@cache
def _pool(process: int, helpers: int) -> ThreadPoolExecutor:
    """Threads of this process: a child has none of those of its parent."""
    return ThreadPoolExecutor(helpers, thread_name_prefix="solver")


@cache
def _libraries() -> Any:
    import scipy.linalg  # noqa: F401  # whose library is to be found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


@contextmanager
def one_thread_each() -> Iterator[None]:
    """The linear algebra of NumPy and SciPy takes no threads of its own."""
    with _libraries().limit(limits=1):
        yield
