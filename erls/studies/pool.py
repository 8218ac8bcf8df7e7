"""Independent runs on all cores: finished ones are kept when the user interrupts or one of them fails."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

from erls.errors import Cause, SceneError
from erls.parallel.crew import Crew, reported
from erls.parallel.workers import possible
from fe_import.errors import ReportedError

A = TypeVar("A")
R = TypeVar("R")
_LOOK_S = 0.2  # between looks at whether workers are left


@dataclass(frozen=True)
class Finished:
    """Result of one task, or why there is none."""

    number: int
    result: Any
    error: ReportedError | None


class Known(Protocol):
    """Results of tasks that outlast a program."""

    def found(self) -> list[Finished]:
        """Those from before."""

    def keep(self, one: Finished) -> None:
        """One of now."""


def run_all(
    work: Callable[[A], R],
    tasks: Sequence[A],
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
    longest_last: bool = True,
    known: Known | None = None,
) -> tuple[list[Finished], bool]:
    """Results of ``work`` for every task, in the order of the tasks.

    Parameters
    ----------
    work : callable
        Importable by name from a module other than the script; its argument and result can be pickled.
    tasks : sequence
    progress : callable
        Called with (finished, all).
    workers : int, optional
        Processes (`erls.parallel.crew`); as many as cores unless given. One runs in this process.
    longest_last : bool
        Whether the last tasks take longest, so that several processes start with them.
    known : Known, optional
        Results from before, which are not computed again, and where those of now go.

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
    finished = [] if known is None else known.found()
    there = {one.number for one in finished}
    left = [number for number in range(len(tasks)) if number not in there]
    try:
        for done in each(work, [tasks[number] for number in left], workers, longest_last):
            finished.append(one := replace(done, number=left[done.number]))
            if known is not None:
                known.keep(one)
            progress(len(finished), len(tasks))
    except KeyboardInterrupt:
        return sorted(finished, key=lambda f: f.number), False
    return sorted(finished, key=lambda f: f.number), True


def each(
    work: Callable[[A], R], tasks: Sequence[A], workers: int | None = None, longest_last: bool = False
) -> Iterator[Finished]:
    """The same one by one, as they come; an interrupt goes on to who asks. See `run_all`."""
    if workers is not None and workers < 1:
        message = "the number of workers must be positive"
        raise SceneError(Cause.BAD_FIELD, message, where="workers", value=workers, remedy="give 1 or more")
    count = min(workers or os.cpu_count() or 1, len(tasks))
    if count > 1 and possible():
        return _spread(work, tasks, count, longest_last)
    return _here(work, tasks)


def _here(work: Callable[[A], R], tasks: Sequence[A]) -> Iterator[Finished]:
    for number, task in enumerate(tasks):
        try:
            yield Finished(number, work(task), None)
        except ReportedError as problem:
            if problem.cause == Cause.INTERRUPTED:
                raise KeyboardInterrupt from None
            yield Finished(number, None, problem)


def _spread(work: Callable[[A], R], tasks: Sequence[A], count: int, longest_last: bool) -> Iterator[Finished]:
    order = range(len(tasks))
    crew = Crew(work, tasks, reversed(order) if longest_last else order)
    crew.start(count)
    try:
        while crew.members or crew.given:
            for answer in crew.answers(_LOOK_S):
                yield Finished(answer.number, answer.result, reported(answer))
        while (number := crew.take()) is not None:  # no worker could be started
            yield from (replace(done, number=number) for done in _here(work, [tasks[number]]))
    finally:
        crew.dismiss()  # interrupted: a run in progress is of no use any more
