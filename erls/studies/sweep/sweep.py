"""One scene at many points: every point that is finished is kept, and what was kept is not run again."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.files.optional import optional_package
from erls.files.results import claim
from erls.maths.so3 import Array
from erls.run.record import Run
from erls.scene.inputs import files_of
from erls.scene.read import load_scene
from erls.studies.kept import content_of
from erls.studies.pool import each
from erls.studies.sweep.chunks import Chunks
from erls.studies.sweep.evaluate import (
    Reduction,
    Task,
    check_keys,
    evaluate,
    looks_at_bending,
    numbers_of,
    row_of,
    run_point,
)
from erls.studies.sweep.executors import evaluated, workers_of
from erls.studies.sweep.points import Grid, Points, grid_of
from erls.studies.sweep.quantities import kept_texts, quantity
from erls.studies.sweep.store import SUFFIX, Row, Store
from fe_import.errors import ReportedError
from fe_import.files.versions import package_version

_CHUNK_S, _MOST_IN_CHUNK = 0.3, 50  # of work that goes to a worker at a time; what a kill -9 may cost
_KEEP_S = 1.0  # between transactions
_WORTH_S = 3.0  # of work, from which on processes pay that must be started


@dataclass(frozen=True)
class Sweep:
    """What came of a sweep.

    Attributes
    ----------
    scene : Path
    keys : tuple of str
        What was varied.
    quantities, units : tuple of str
        What was kept of each run.
    shape : tuple of int
        Of a grid: number of values of each key; otherwise (n,).
    rows : tuple of Row
        Of the finished points, by number.
    points : int
        All that were asked for.
    ran : int
        Points that were run now; the others were kept from before.
    integration_s, wall_s : float
        Times of all integrations that were run now, and of it all [s].
    interrupted : bool
    verdict : bool
        Whether runs stated their error.
    """

    scene: Path
    keys: tuple[str, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    shape: tuple[int, ...]
    rows: tuple[Row, ...]
    points: int
    ran: int
    integration_s: float
    wall_s: float
    interrupted: bool
    verdict: bool

    @property
    def numbers(self) -> Array:
        """(n, q) of all points; not a number where a run failed or was not made."""
        found = np.full((self.points, len(self.quantities)), np.nan)
        for row in self.rows:
            if row.numbers is not None:
                found[row.number] = row.numbers
        return found

    @property
    def looked_at(self) -> int:
        """Finished points of which it was looked at how far off links are that bend."""
        return sum(self.verdict or looks_at_bending(row.number) for row in self.rows)

    @property
    def failed(self) -> tuple[Row, ...]:
        """Finished points whose run failed."""
        return tuple(row for row in self.rows if row.numbers is None)

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``: a line for each finished point, its number the index.

        Raises
        ------
        SceneError
            BAD_FIELD: pandas is not installed.
        """
        pandas = optional_package("pandas", "Sweep.to_pandas")
        index = pandas.Index([row.number for row in self.rows], name="point")
        table = {key: [row.parameters[k] for row in self.rows] for k, key in enumerate(self.keys)}
        numbers = self.numbers[[row.number for row in self.rows]]
        table |= {name: numbers[:, k].tolist() for k, name in enumerate(self.quantities)}
        return pandas.DataFrame({**table, "cause": [row.cause for row in self.rows]}, index=index)

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset`` over the keys of a grid, or over points.

        Raises
        ------
        SceneError
            BAD_FIELD: xarray is not installed.
        """
        xarray = optional_package("xarray", "Sweep.to_xarray")
        numbers = self.numbers.reshape(*self.shape, -1)
        over = self.keys if len(self.shape) == len(self.keys) else ("point",)
        variables = {name: (over, numbers[..., k], {"units": self.units[k]}) for k, name in enumerate(self.quantities)}
        return xarray.Dataset(variables, self._coordinates(over))

    def _coordinates(self, over: Sequence[str]) -> dict[str, Any]:
        if tuple(over) != self.keys or len(self.rows) != self.points:
            return {}
        apart = [int(np.prod(self.shape[k + 1 :])) for k in range(len(self.shape))]  # points between two values
        return {
            key: [self.rows[j * apart[k]].parameters[k] for j in range(self.shape[k])]
            for k, key in enumerate(self.keys)
        }


def sweep(
    scene: Path | str,
    points: Points | Mapping[str, Sequence[Any]],
    quantities: Sequence[str] | Reduction,
    *,
    overrides: Sequence[str] = (),
    store: Path | str | None = None,
    resume: bool = False,
    force: bool = False,
    retry: bool = False,
    executor: Any = None,
    workers: int | None = None,
    verdict: bool = False,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> Sweep:
    """Simulate a scene at many points.

    Parameters
    ----------
    scene : Path or str
    points : Points, or dict of sequences
        Values by key (as ``--set`` takes it), of which all combinations are run; or `erls.studies.sweep.points`.
    quantities : sequence of str, or callable
        What is kept of each run (`erls.studies.sweep.quantities`), or a function of a run that gives numbers by name,
        which workers import.
    overrides : sequence of str
        ``KEY=VALUE`` of all points.
    store : Path or str, optional
        File that keeps points as they are finished; in memory unless given.
    resume : bool
        Go on with the store: points that it holds are not run again.
    force : bool
        Replace a store that holds finished points, which is refused otherwise.
    retry : bool
        With ``resume``: run again what failed.
    executor : object, optional
        With ``submit``: an executor of `concurrent.futures` or loky, or a client of Dask, whose workers see the files
        of the scene at the same paths. Processes of this program unless given.
    workers : int, optional
        Runs at a time; as many as cores, or as the executor has, unless given.
    verdict : bool
        Whether runs state their error, for the quantity ``error``; they are not judged otherwise.
    progress : callable
        Called with (finished, all).

    Returns
    -------
    Sweep
        Results do not depend on who computed them, nor on the order in which they came.

    Raises
    ------
    SceneError, FEImportError
        Bad input, or a store of another sweep.

    Examples
    --------
    >>> import erls
    >>> found = erls.sweep(
    ...     "data/l_shape/steel_tall.toml", {"joints.0.initial.position_deg": (0, 30)}, ["tip.x@end"],
    ...     overrides=["simulation.duration=0.01"])
    >>> found.numbers.round(4).tolist()
    [[0.5], [0.4331]]
    """
    begun = time.perf_counter()
    asked = grid_of(points) if isinstance(points, Mapping) else points
    kept = quantities if callable(quantities) else kept_texts(quantities, verdict)
    task = Task(Path(scene), tuple(overrides), asked.keys, [], kept, verdict)
    check_keys(task, asked.row(0))
    task = replace(task, content=content_of(task.scene, task.overrides))
    about, target = _about(task, asked), None if store is None else Path(store)
    if target is not None:
        claim(target, SUFFIX, files_of(load_scene(task.scene, task.overrides)), force and not resume)
        if not resume:
            Store.make_room(target, force)
    with closing(Store(target)) as base:
        if base.empty:
            base.begin(about)
        else:
            _check_same(base, about)
        done = set(base.finished(failed=not retry))
        engine = _Engine(task, asked, base, progress, len(done))
        interrupted = engine.run([number for number in range(len(asked)) if number not in done], executor, workers)
        told, rows = base.about(), tuple(base.rows())
    return Sweep(
        scene=task.scene,
        keys=asked.keys,
        quantities=tuple(told["quantities"]),
        units=tuple(told["units"]),
        shape=asked.shape if isinstance(asked, Grid) else (len(asked),),
        rows=rows,
        points=len(asked),
        ran=engine.ran,
        integration_s=engine.integration_s,
        wall_s=time.perf_counter() - begun,
        interrupted=interrupted,
        verdict=verdict,
    )


def _about(task: Task, points: Points) -> dict[str, Any]:
    """What a store is of."""
    rows = hashlib.sha256()
    for number in range(len(points)):
        rows.update(json.dumps(points.row(number)).encode())
    own = task.quantities
    return {
        "program": package_version("erls"),
        "scene": task.content,
        "overrides": list(task.overrides),
        "keys": list(task.keys),
        "points": rows.hexdigest(),
        "kept": f"{own.__module__}.{own.__qualname__}" if callable(own) else list(own),
        "verdict": task.verdict,
        "quantities": [] if callable(own) else list(own),
        "units": [] if callable(own) else [""] * len(own),
    }


def _check_same(base: Store, now: Mapping[str, Any]) -> None:
    """Refuse to go on with the store of another sweep."""
    before = base.about()
    for name in set(now) - {"quantities", "units"}:
        if before.get(name) != now[name]:
            raise SceneError(
                Cause.CHANGED,
                f"this store is of another sweep: not the same {name}",
                where=base.where,
                remedy="run the sweep that it is of, or start anew without --resume",
            )


class _Engine:
    """Runs points and keeps them as they come."""

    def __init__(
        self, task: Task, points: Points, base: Store, progress: Callable[[float, float], None], done: int
    ) -> None:
        self.task, self.points, self.base, self.progress, self.done = task, points, base, progress, done
        self.waiting: list[Row] = []
        self.kept, self.each_s = time.monotonic(), _CHUNK_S
        self.ran, self.integration_s = 0, 0.0

    def run(self, todo: list[int], executor: Any, workers: int | None) -> bool:
        """All of them; whether it was interrupted."""
        try:
            left = todo[self._first(todo) :]
            for rows in self._evaluated(left, executor, workers):
                self._take(rows)
        except KeyboardInterrupt:
            return True
        except ReportedError as problem:
            if problem.cause == Cause.INTERRUPTED:
                return True
            raise
        finally:
            self._keep()
        return False

    def _first(self, todo: list[int]) -> int:
        """Run points here until one gives numbers, which tells what there is, and how long a run takes; how many."""
        for count, number in enumerate(todo, 1):
            values = self.points.row(number)
            run = run_point(self.task, number, values)
            if isinstance(run, Run):
                found = numbers_of(run, self.task.quantities)  # what does not exist is told before more is done
                self.base.tell("quantities", list(found))
                if not callable(self.task.quantities):
                    self.base.tell("units", [quantity(text).unit(run) for text in self.task.quantities])
                begun = time.perf_counter()
                run = run_point(self.task, number, values)  # with all that is compiled
                self.each_s = time.perf_counter() - begun
            self._take([row_of(self.task, number, values, run)])
            if isinstance(run, Run):
                return count
        return len(todo)

    def _evaluated(self, todo: list[int], executor: Any, workers: int | None) -> Iterator[list[Row]]:
        size = max(1, min(_MOST_IN_CHUNK, int(_CHUNK_S / max(self.each_s, 1e-3))))
        tasks = Chunks(self.task, self.points, todo, size)
        if executor is not None:
            yield from evaluated(evaluate, tasks, executor, workers_of(executor, workers))
            return
        if workers is None and self.each_s * len(todo) < _WORTH_S:
            workers = 1
        for done in each(evaluate, tasks, workers):
            yield done.result if done.error is None else self._lost(tasks[done.number], done.error)

    @staticmethod
    def _lost(task: Task, problem: ReportedError) -> list[Row]:
        """A worker died over them."""
        return [row_of(task, number, values, problem) for number, values in task.rows]

    def _take(self, rows: list[Row]) -> None:
        self.waiting += rows
        self.ran += len(rows)
        self.integration_s += sum(row.wall_s for row in rows)
        if time.monotonic() - self.kept > _KEEP_S:
            self._keep()
        self.progress(self.done + self.ran, len(self.points))

    def _keep(self) -> None:
        if self.waiting:
            self.base.add(self.waiting)
            self.waiting = []
        self.kept = time.monotonic()
