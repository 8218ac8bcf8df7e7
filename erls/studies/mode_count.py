"""How many modes are enough: one scene with more and more elastic modes, until chosen outputs stop changing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.simulation.simulate import simulate
from erls.studies.kept import KeptRuns, State, keeping
from erls.studies.mode_overrides import count_field, default_counts, elastic_frequencies, whole_counts
from erls.studies.mode_result import ModeStudy, Point, Tolerances, changed, converged_at, remaining_kinds
from erls.studies.outputs import Outputs, run_outputs
from erls.studies.pool import run_all
from fe_import.files.toml import choose

_SAMPLES = 1000


def study_modes(
    scene: Scene | Path | str,
    counts: Sequence[int] | None = None,
    *,
    frequencies: Sequence[float] | None = None,
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
        Elastic modes; `default_counts` unless given. Modes of equal frequency are taken together.
    frequencies : sequence of float, optional
        Instead: limits up to which the modes of each link are taken [Hz].
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
    modes = elastic_frequencies(loaded)
    if link:
        choose(link, modes, "link", SceneError)
        modes = {link: modes[link]}
    most = min(map(len, modes.values()), default=0)
    if most < 1:
        raise SceneError(
            Cause.BAD_FIELD,
            "no link of this scene has elastic modes to vary",
            where=str(path),
            remedy="give a link a model or modal_file with elastic modes",
        )
    if counts is not None and frequencies is not None:
        message, remedy = "counts and limits of frequencies are two ways to say the same", "give one of them"
        raise SceneError(Cause.BAD_FIELD, message, where="frequencies", value=list(frequencies), remedy=remedy)
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
    if frequencies is not None:
        steps = [_below(modes, limit) for limit in sorted(set(frequencies))]
    else:
        steps = [dict.fromkeys(modes, count) for count in chosen]
    steps = [dict(step) for step in dict.fromkeys(tuple(whole_counts(loaded, s, modes).items()) for s in steps)]
    fields = {name: count_field(loaded, name) for name in modes}
    tasks = [
        (str(path), (*overrides, *(f"{fields[name]}={count}" for name, count in step.items()))) for step in steps
    ]
    with keeping(state, path, overrides) as kept:
        known = KeptRuns(kept, [("modes", changes) for _, changes in tasks], Outputs)
        finished, complete = run_all(_run, tasks, progress, workers, known=known)
    limit = tolerances or Tolerances()
    points: list[Point] = []
    for one in finished:
        before = points[-1].outputs if points else None
        changes = () if one.result is None or before is None else changed(before, one.result, limit)
        points.append(Point(steps[one.number], one.result, one.error, changes))
    return ModeStudy(
        scene=loaded.name,
        link=link,
        points=tuple(points),
        tolerances=limit,
        converged=converged_at(points),
        remaining=remaining_kinds(points),
        complete=complete,
        available={name: len(found) for name, found in modes.items()},
    )


def _below(modes: Mapping[str, Array], limit: float) -> dict[str, int]:
    if not 0 <= limit < np.inf:
        message, remedy = "a limit of frequencies is a number of 0 or more", "give Hz"
        raise SceneError(Cause.BAD_FIELD, message, where="frequencies", value=limit, remedy=remedy)
    return {name: int(np.searchsorted(found, limit, side="right")) for name, found in modes.items()}


def _run(task: tuple[str, tuple[str, ...]]) -> Outputs:
    path, overrides = task
    run = simulate(load_chain(path, overrides), verdict=False)
    return run_outputs(run, np.linspace(0.0, run.end, _SAMPLES + 1), recovering=True)
