"""Many variants of one scene in one call: parameters, drives, initial states; what they share is read once."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

from erls.errors import Cause, SceneError, SimulationError
from erls.run import Run
from erls.scene import load_scene
from erls.simulation import simulate
from fe_import.errors import ReportedError


def simulate_many(
    scene: Path | str,
    variants: Sequence[Sequence[str]],
    *,
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
) -> list[Run | ReportedError]:
    """Simulate variants of a scene; compiled runs go side by side in threads of this process.

    Parameters
    ----------
    scene : Path or str
    variants : sequence of sequence of str
        ``KEY=VALUE`` that make each variant, as on the command line: ``joints.0.initial.position_deg=30``.
    progress : callable
        Called with (finished, all).
    workers : int, optional
        Runs at a time; as many as cores unless given.

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
    stop = threading.Event()

    def look(t: float, duration: float) -> None:
        if stop.is_set():
            raise SimulationError(Cause.INTERRUPTED, "the run was interrupted", remedy="run this variant again")

    shared: Run | None = None

    def one(overrides: Sequence[str]) -> Run | ReportedError:
        try:
            look(0.0, 0.0)
            loaded = load_scene(scene, overrides)
            same = shared is not None and loaded.record.links == shared.scene.record.links
            return simulate(loaded, progress=look, like=shared if same else None)
        except ReportedError as problem:
            return problem

    results: dict[int, Run | ReportedError] = {}
    count = min(workers or os.cpu_count() or 1, len(variants))
    if not count:
        return []
    first = one(variants[0])  # alone: it reduces and compiles what the others then share
    if isinstance(first, Run) and all(link.substructures == 1 for link in first.scene.record.links):
        shared = first
    results[0] = first
    progress(1, len(variants))
    with ThreadPoolExecutor(count) as pool:
        numbers: dict[Future[Run | ReportedError], int] = {
            pool.submit(one, overrides): k for k, overrides in enumerate(variants[1:], start=1)
        }
        waiting = set(numbers)
        try:
            while waiting:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    results[numbers[future]] = future.result()
                progress(len(results), len(variants))
        except KeyboardInterrupt:
            stop.set()
            for future in waiting:
                results[numbers[future]] = future.result()
    return [results[k] for k in range(len(variants))]
