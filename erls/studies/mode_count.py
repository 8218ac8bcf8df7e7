"""How many modes are enough: one scene with more and more elastic modes, until chosen outputs stop changing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias, TypeVar

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.simulation.simulate import simulate
from erls.studies.kept import KeptRuns, State, keeping
from erls.studies.mode_overrides import (
    count_field,
    default_counts,
    elastic_frequencies,
    ranked_setting,
    rankings,
    whole_counts,
)
from erls.studies.mode_result import ModeStudy, Point, Tolerances, changed, converged_at, remaining_kinds
from erls.studies.outputs import Outputs, run_outputs
from erls.studies.pool import run_all
from fe_import.files.toml import choose

T = TypeVar("T")
_SAMPLES = 1000


def study_modes(
    scene: Scene | Path | str,
    counts: Sequence[int] | None = None,
    *,
    frequencies: Sequence[float] | None = None,
    ranked: bool = False,
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
    ranked : bool
        Count fixed-interface modes in the order in which the reduction of each link ranks them, up to as many as that
        asks for, rather than elastic modes.
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
    if ranked and frequencies is not None:
        raise _twice("a ranking and limits of frequencies", frequencies)
    if counts is not None and frequencies is not None:
        raise _twice("counts and limits of frequencies", frequencies)
    if ranked:
        available, steps, settings = _ranked_steps(loaded, counts, link)
    else:
        available, steps, settings = _steps(loaded, counts, frequencies, link)
    tasks = [(str(path), (*overrides, *setting)) for setting in settings]
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
        available=available,
        ranked=ranked,
    )


_Steps: TypeAlias = tuple[dict[str, int], list[dict[str, int]], list[tuple[str, ...]]]
"""Modes that there are by link, counts of each step, and ``KEY=VALUE`` that take them."""


def _steps(scene: Scene, counts: Sequence[int] | None, frequencies: Sequence[float] | None, link: str) -> _Steps:
    """Of elastic modes."""
    modes = _varied(elastic_frequencies(scene), link)
    if not modes:
        raise SceneError(
            Cause.BAD_FIELD,
            "no link of this scene has elastic modes to vary",
            where=str(scene.path),
            remedy="give a link a model or modal_file with elastic modes",
        )
    available = {name: len(found) for name, found in modes.items()}
    if frequencies is not None:
        steps = [_below(modes, limit) for limit in sorted(set(frequencies))]
    else:
        steps = _alike(available, counts, 0, "elastic modes")
    steps = [dict(step) for step in dict.fromkeys(tuple(whole_counts(scene, s, modes).items()) for s in steps)]
    fields = {name: count_field(scene, name) for name in modes}
    return available, steps, [tuple(f"{fields[name]}={count}" for name, count in step.items()) for step in steps]


def _ranked_steps(scene: Scene, counts: Sequence[int] | None, link: str) -> _Steps:
    """Of fixed-interface modes in the order of a ranking."""
    modes = _varied(rankings(scene), link)
    available = {name: found.count for name, found in modes.items()}
    steps = _alike(available, counts, 1, "ranked modes")
    return available, steps, [tuple(ranked_setting(name, modes[name], n) for name, n in s.items()) for s in steps]


def _varied(modes: dict[str, T], link: str) -> dict[str, T]:
    """Those of the links that are varied."""
    if link:
        choose(link, modes, "link", SceneError)
        return {link: modes[link]}
    return modes


def _alike(available: Mapping[str, int], counts: Sequence[int] | None, least: int, kind: str) -> list[dict[str, int]]:
    """The same counts of all links."""
    most = min(available.values())
    chosen = sorted(set(counts)) if counts is not None else [n for n in default_counts(most) if n >= least]
    for count in chosen:
        if not least <= count <= most:
            raise SceneError(
                Cause.BAD_FIELD,
                f"the modal models do not have this number of {kind}",
                where="mode counts",
                value=count,
                limit=most,
                remedy=f"give counts from {least} to the limit, or reduce the links with more modes",
            )
    return [dict.fromkeys(available, count) for count in chosen]


def _twice(what: str, value: Sequence[float]) -> SceneError:
    message, remedy = f"{what} are two ways to say the same", "give one of them"
    return SceneError(Cause.BAD_FIELD, message, where="frequencies", value=list(value), remedy=remedy)


def _below(modes: Mapping[str, Array], limit: float) -> dict[str, int]:
    if not 0 <= limit < np.inf:
        message, remedy = "a limit of frequencies is a number of 0 or more", "give Hz"
        raise SceneError(Cause.BAD_FIELD, message, where="frequencies", value=limit, remedy=remedy)
    return {name: int(np.searchsorted(found, limit, side="right")) for name, found in modes.items()}


def _run(task: tuple[str, tuple[str, ...]]) -> Outputs:
    path, overrides = task
    run = simulate(load_chain(path, overrides), verdict=False)
    return run_outputs(run, np.linspace(0.0, run.end, _SAMPLES + 1), recovering=True)
