"""How many modes are enough: one scene with more and more elastic modes, until chosen outputs stop changing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from erls.errors import Cause, SceneError
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.simulation.simulate import simulate
from erls.studies.kept import KeptRuns, State, keeping
from erls.studies.mode_overrides import available_modes, count_field, default_counts
from erls.studies.mode_result import ModeStudy, Point, Tolerances, changed, converged_at, remaining_kinds
from erls.studies.outputs import Outputs, run_outputs
from erls.studies.pool import run_all
from fe_import.files.toml import choose

_SAMPLES = 1000


def study_modes(
    scene: Scene | Path | str,
    counts: Sequence[int] | None = None,
    *,
    link: str = "",
    overrides: Sequence[str] = (),
    tolerances: Tolerances | None = None,
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
    state: State | None = None,
) -> ModeStudy:
    """Run a scene with rising numbers of elastic modes.

    Parameters
    ----------
    scene : Scene, Path or str
    counts : sequence of int, optional
        Elastic modes; `default_counts` unless given.
    link : str
        Vary this link only; all elastic links alike unless given.
    overrides : sequence of str
        ``KEY=VALUE`` applied to the scene.
    tolerances : Tolerances, optional
    progress : callable
        Called with (finished runs, all).
    workers : int, optional
        Processes; as many as cores unless given.
    state : State, optional
        File that keeps runs as they are finished.

    Returns
    -------
    ModeStudy

    Raises
    ------
    SceneError, FEImportError
        Bad input; also when no link has elastic modes to vary.
    """
    path = scene.path if isinstance(scene, Scene) else Path(scene)
    loaded = load_chain(path, overrides)
    limits = available_modes(loaded)
    if link:
        choose(link, limits, "link", SceneError)
        limits = {link: limits[link]}
    most = min(limits.values(), default=0)
    if most < 1:
        raise SceneError(
            Cause.BAD_FIELD,
            "no link of this scene has elastic modes to vary",
            where=str(path),
            remedy="give a link a model or modal_file with elastic modes",
        )
    chosen = sorted(set(counts)) if counts is not None else default_counts(most)
    for count in chosen:
        if not 0 <= count <= most:
            raise SceneError(
                Cause.BAD_FIELD,
                "the modal models do not have this number of elastic modes",
                where="mode counts",
                value=count,
                limit=most,
                remedy="give counts from 0 to the limit, or reduce the links with more modes",
            )
    fields = [count_field(loaded, name) for name in limits]
    tasks = [(str(path), (*overrides, *(f"{field}={count}" for field in fields))) for count in chosen]
    with keeping(state, path, overrides) as kept:
        known = KeptRuns(kept, [("modes", changes) for _, changes in tasks], Outputs)
        finished, complete = run_all(_run, tasks, progress, workers, known=known)
    limit = tolerances or Tolerances()
    points: list[Point] = []
    for one in finished:
        before = points[-1].outputs if points else None
        changes = () if one.result is None or before is None else changed(before, one.result, limit)
        points.append(Point(chosen[one.number], one.result, one.error, changes))
    return ModeStudy(loaded.name, link, tuple(points), limit, converged_at(points), remaining_kinds(points), complete)


def _run(task: tuple[str, tuple[str, ...]]) -> Outputs:
    path, overrides = task
    run = simulate(load_chain(path, overrides), verdict=False)
    return run_outputs(run, np.linspace(0.0, run.end, _SAMPLES + 1))
