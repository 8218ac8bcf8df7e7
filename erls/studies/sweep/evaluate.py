"""Points of a sweep as worker processes see them: a few at a time, links shared with those before."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SimulationError
from erls.run.record import Run
from erls.scene.chain import Scene
from erls.scene.read import AnyScene
from erls.simulation.variants import Variants
from erls.studies.sweep.quantities import quantity, values_of
from erls.studies.sweep.store import Row
from fe_import.description.link import load_link
from fe_import.errors import ReportedError

Reduction = Callable[[Run], Mapping[str, float]]
"""Numbers of a run by name, of one's own; workers import it by its name."""

_FEW, _OF_FEW, _OF_MANY = 256, 16, 128

_known = threading.local()


@dataclass(frozen=True)
class Task:
    """Some points.

    Attributes
    ----------
    scene : Path
    overrides : tuple of str
        Of all points.
    keys : tuple of str
    rows : list of (number, values)
        Values for the keys.
    quantities : tuple of str, or callable
    verdict : bool
        Whether runs state their error.
    content : str
        What tells the files of the scene from what they were before.
    """

    scene: Path
    overrides: tuple[str, ...]
    keys: tuple[str, ...]
    rows: list[tuple[int, tuple[Any, ...]]]
    quantities: tuple[str, ...] | Reduction
    verdict: bool
    content: str = ""


def check_keys(task: Task, values: Sequence[Any]) -> None:
    """Refuse keys that lead nowhere; values that are no good are failures of their points.

    Parameters
    ----------
    task : Task
    values : sequence
        Those of any point.

    Raises
    ------
    SceneError, FEImportError
        UNKNOWN_FIELD, BAD_REFERENCE: a key misspelt.
    """
    try:
        scene = Variants(task.scene, task.overrides).scene((), _varied(task, values))
        for link in scene.record.links if isinstance(scene, Scene) else ():
            if link.model and link.changes:
                load_link(scene.folder / link.model, changes=link.changes)
    except ReportedError as problem:
        unknown = str(problem.cause) == Cause.UNKNOWN_FIELD and _last(problem.where) in map(_last, task.keys)
        if unknown or (str(problem.cause) == Cause.BAD_REFERENCE and problem.where.startswith("--set")):
            raise


def _last(key: str) -> str:
    return key.rpartition(".")[2]


def _varied(task: Task, values: Sequence[Any]) -> list[tuple[str, Any]]:
    return list(zip(task.keys, values, strict=True))


def evaluate(task: Task) -> list[Row]:
    """Run them; what fails is a row, too.

    First all are read, then all are run, then all are asked for their numbers: what is done between two integrations
    takes a fifth longer where each of them has driven it out of the processor's cache.
    """
    scenes = [_scene(task, values) for _, values in task.rows]
    runs = [_run(task, number, scene) for (number, _), scene in zip(task.rows, scenes, strict=True)]
    return [row_of(task, *point, run) for point, run in zip(task.rows, runs, strict=True)]


def looks_at_bending(number: int) -> bool:
    """Whether a point is looked at for how far off links are that bend (`erls.run.watches.deflection_range`), where
    runs do not state their error: one of 16 of the first, one of 128 of the others.
    """
    return number % (_OF_FEW if number < _FEW else _OF_MANY) == 0


def run_point(task: Task, number: int, values: Sequence[Any]) -> Run | ReportedError:
    """The run of a point, or its failure."""
    return _run(task, number, _scene(task, values))


def _scene(task: Task, values: Sequence[Any]) -> AnyScene | ReportedError:
    try:
        return _variants(task).scene((), _varied(task, values))
    except ReportedError as problem:
        return problem


def _run(task: Task, number: int, scene: AnyScene | ReportedError) -> Run | ReportedError:
    if isinstance(scene, ReportedError):
        return scene
    return _variants(task).run_scene(scene, lambda t, duration: None, task.verdict, looks_at_bending(number))


def numbers_of(run: Run, quantities: Sequence[str] | Reduction) -> dict[str, float]:
    """What is kept of a run, by name."""
    if callable(quantities):
        return {str(name): float(value) for name, value in quantities(run).items()}
    return dict(zip(quantities, values_of(run, [quantity(text) for text in quantities]), strict=True))


def row_of(task: Task, number: int, values: Sequence[Any], found: Run | ReportedError) -> Row:
    """What is kept of a point."""
    parameters = list(values)
    if isinstance(found, Run):
        try:
            numbers = np.array(list(numbers_of(found, task.quantities).values()))
            return Row(number, parameters, numbers, warnings=found.warnings, wall_s=found.wall_s)
        except ReportedError as problem:
            found = problem
    if found.cause == Cause.INTERRUPTED:
        raise SimulationError(Cause.INTERRUPTED, "the sweep was interrupted", remedy="go on with it")
    return Row(number, parameters, None, str(found.cause), str(found))


def _variants(task: Task) -> Variants:
    """One for each thread, and for the scene at hand."""
    of = task.scene, task.overrides, task.content
    if getattr(_known, "of", None) != of:
        _known.of, _known.variants = of, Variants(task.scene, task.overrides)
    found: Variants = _known.variants
    return found
