"""Many variants of one scene in one call: parameters, drives, initial states; on all cores where that pays."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from erls.errors import Cause, SceneError, SimulationError
from erls.parallel.crew import Crew, reported
from erls.parallel.worker_process import stopped
from erls.parallel.workers import IDLE, possible
from erls.run.record import Run
from erls.simulation.packed_run import Packed, packed
from erls.simulation.variants import Variants
from fe_import.errors import ReportedError

_START_S, _READY_S = 1.0, 0.2  # of work left, from which on workers pay that must be started, or that are there
_LOOK_S = 0.2  # between looks while only workers work


def simulate_many(
    scene: Path | str,
    variants: Sequence[Sequence[str]],
    *,
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
) -> list[Run | ReportedError]:
    """Simulate variants of a scene, on several cores where that pays.

    This process takes one variant after the other. When by the time that they took more than a second of work is left,
    worker processes come and take some, too; starting one takes about a second, on another core. They stay for five
    minutes, and for later batches pay from 0.2 s of work on. They do not run the script that calls this, so it needs no
    ``if __name__ == "__main__"``. Runs come back without their equations of motion, which are put together here: of
    bodies at once, of chains from the modal models that all share, when they are first asked for.

    Parameters
    ----------
    scene : Path or str
    variants : sequence of sequence of str
        ``KEY=VALUE`` that make each variant, as on the command line: ``joints.0.initial.position_deg=30``.
    progress : callable
        Called with (finished, all).
    workers : int, optional
        Runs at a time, the one of this process included; as many as cores unless given.

    Returns
    -------
    list of Run or ReportedError
        In the order of the variants. What failed is its error; after an interrupt, what had not finished is an error
        with cause INTERRUPTED, which holds what was computed of it, if anything.

    Raises
    ------
    SceneError
        ``workers`` is not positive.

    Examples
    --------
    >>> import erls
    >>> turned = [[f"joints.0.initial.position_deg={a}", "simulation.duration=0.01"] for a in (0, 30)]
    >>> [round(float(run.position("tip", 0.01)[0]), 4) for run in erls.simulate_many(
    ...     "data/l_shape/steel_tall.toml", turned)]
    [0.5, 0.4331]
    """
    if workers is not None and workers < 1:
        message = "the number of workers must be positive"
        raise SceneError(Cause.BAD_FIELD, message, where="workers", value=workers, remedy="give 1 or more")
    count = min(workers or os.cpu_count() or 1, len(variants)) if possible() else 1
    return _Batch(scene, [list(overrides) for overrides in variants], progress, count).results()


@dataclass(frozen=True)
class _Task:
    """A variant, and the batch of which it is one."""

    batch: str
    scene: Path | str
    overrides: list[str]


class _Batch:
    """What this process takes on itself, and what it leaves to workers."""

    def __init__(
        self,
        scene: Path | str,
        variants: list[list[str]],
        progress: Callable[[float, float], None],
        count: int,
    ) -> None:
        self.variants, self.progress, self.helpers = variants, progress, count - 1
        self.here = Variants(scene)
        name = uuid.uuid4().hex
        tasks = [_Task(name, scene, overrides) for overrides in variants]
        self.crew = Crew(_run, tasks, prepare=_prepare, preparation=tasks[0] if tasks else None)
        self.found: dict[int, Run | ReportedError] = {}
        self.stopping = False
        self.spent, self.made = 0.0, 0  # by this process: seconds, and runs
        self.begun: float | None = None  # the one that it is at

    def results(self) -> list[Run | ReportedError]:
        """In the order of the variants."""
        try:
            self._work()
        except KeyboardInterrupt:
            self._stop()
        except BaseException:
            self.crew.dismiss()
            raise
        return [self.found.get(number, _interrupted()) for number in range(len(self.variants))]

    def _work(self) -> None:
        while True:
            while (number := self.crew.take()) is not None:
                self._run_here(number)
            if not self.crew.left:
                return
            self._collect(_LOOK_S)  # a worker that died leaves what it had not begun

    def _stop(self) -> None:
        """Take what workers have of their runs."""
        self.stopping = True
        self.crew.stop()
        try:
            while self.crew.given:
                self._collect(_LOOK_S)
        except KeyboardInterrupt:  # once more
            self.crew.dismiss()
            raise

    def _run_here(self, number: int) -> None:
        self.begun = time.perf_counter() if self.made else None
        run = self.here.run(self.variants[number], self._look)
        self.found[number] = run
        if isinstance(run, ReportedError) and run.cause == Cause.INTERRUPTED:
            raise KeyboardInterrupt
        self.spent += self._elapsed()
        self.made += 1
        self.progress(len(self.found), len(self.variants))
        self._look(0.0, 0.0)

    def _look(self, t: float, duration: float) -> None:
        """Between steps: take what came in, and have workers come where they pay."""
        if self.begun is None and duration:  # the first one may have reduced and compiled; the others need not
            self.begun = time.perf_counter()
        self._collect()
        if self.helpers and self._pays():
            self.crew.start(self.helpers)
            self.helpers = 0

    def _elapsed(self) -> float:
        return 0.0 if self.begun is None else time.perf_counter() - self.begun

    def _pays(self) -> bool:
        """Whether enough work is left, going by the variants so far or the one under way."""
        mean = self.spent / self.made if self.made else 0.0
        left = max(mean, self._elapsed()) * self.crew.waiting
        return left > _START_S or (left > _READY_S and IDLE.usable() >= self.helpers)

    def _collect(self, wait_s: float = 0.0) -> None:
        for answer in self.crew.answers(wait_s):
            problem = reported(answer)
            self.found[answer.number] = self._received(*answer.result) if problem is None else problem
            if not self.stopping:
                self.progress(len(self.found), len(self.variants))

    def _received(self, problem: ReportedError | None, run: Packed | None) -> Run | ReportedError:
        made = None if run is None else self.here.unpacked(run)
        if isinstance(problem, SimulationError) and made is not None:
            problem.run = made
        return problem or made or _interrupted()


def _interrupted() -> SimulationError:
    return SimulationError(Cause.INTERRUPTED, "the run was interrupted", remedy="run this variant again")


# ----- in workers

_current: dict[str, Variants] = {}  # of the batch that is under way


def _variants(task: _Task) -> Variants:
    if task.batch not in _current:
        _current.clear()
        _current[task.batch] = Variants(task.scene)
    return _current[task.batch]


def _prepare(task: _Task) -> None:
    """What goes wrong here goes wrong in the run, too, and is told there."""
    with suppress(ReportedError):
        _variants(task).prepare(task.overrides)


def _run(task: _Task) -> tuple[ReportedError | None, Packed | None]:
    """The failure of a variant, if it failed, and what was computed of it."""

    def look(t: float, duration: float) -> None:
        if stopped():
            raise _interrupted()

    found = _variants(task).run(task.overrides, look)
    if isinstance(found, Run):
        return None, packed(found)
    run = getattr(found, "run", None)
    return found, None if run is None else packed(run)
