"""Formulations side by side on one scene: distances of everything comparable, cost, and what to make of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import msgspec
import numpy as np

from erls.equations.registry import FORMULATIONS, TREES
from erls.errors import Cause, SceneError
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.simulation.simulate import simulate
from erls.studies.compare_result import Comparison, pair
from erls.studies.kept import KeptRuns, State, keeping
from erls.studies.outputs import Outputs, run_outputs
from erls.studies.pool import run_all
from fe_import.files.toml import choose

_SAMPLES = 1000


@dataclass(frozen=True)
class Column:
    """One way to simulate a scene.

    Attributes
    ----------
    name : str
    overrides : tuple of str
        ``KEY=VALUE`` applied to the scene.
    full_model : bool
        Links keep all nodal dofs (ERLS-FEM).
    """

    name: str
    overrides: tuple[str, ...] = ()
    full_model: bool = False


COLUMNS: dict[str, Column] = {
    "erls": Column("erls", ('simulation.formulation="erls"',)),
    "erls-minimum-norm": Column(
        "erls-minimum-norm", ('simulation.formulation="erls"', 'simulation.gauge="minimum-norm"')
    ),
    "erls-fem": Column("erls-fem", ('simulation.formulation="erls"',), full_model=True),
    **{name: Column(name, (f'simulation.formulation="{name}"',)) for name in FORMULATIONS if name != "erls"},
}


def compare(
    scene: Scene | Path | str,
    columns: Sequence[str] = (),
    *,
    overrides: Sequence[str] = (),
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
    state: State | None = None,
) -> Comparison:
    """Simulate a scene in several formulations and compare them.

    Parameters
    ----------
    scene : Scene, Path or str
    columns : sequence of str
        Of `COLUMNS`; the modal formulations unless given.
    overrides : sequence of str
        ``KEY=VALUE`` applied to the scene, for all columns.
    progress : callable
        Called with (finished runs, all).
    workers : int, optional
        Processes; as many as cores unless given.
    state : State, optional
        File that keeps runs as they are finished.

    Raises
    ------
    SceneError, FEImportError
        Bad input, or fewer than two columns.
    """
    path = scene.path if isinstance(scene, Scene) else Path(scene)
    loaded = load_chain(path, overrides)
    names = list(dict.fromkeys(columns)) or list(TREES)
    for name in names:
        choose(name, COLUMNS, "formulations", SceneError)
    if len(names) < 2:
        raise SceneError(
            Cause.BAD_FIELD,
            "a comparison needs two formulations",
            where="formulations",
            value=", ".join(names),
            remedy="two or more of " + ", ".join(COLUMNS),
        )
    from erls.scene.build import link_models

    link_models(loaded, lambda text: None)  # reduced once, before the workers would do so at once
    tasks = [(str(path), (*overrides, *COLUMNS[name].overrides), COLUMNS[name].full_model) for name in names]
    with keeping(state, path, overrides) as kept:
        known = KeptRuns(kept, [("compare", *task[1:]) for task in tasks], Outputs)
        finished, complete = run_all(_run, tasks, progress, workers, known=known)
    outputs = {names[f.number]: f.result for f in finished if f.error is None}
    errors = {names[f.number]: f.error for f in finished if f.error is not None}
    pairs = tuple(pair(a, outputs[a], b, outputs[b]) for a, b in combinations(outputs, 2))
    return Comparison(loaded.name, outputs, errors, pairs, complete)


def _run(task: tuple[str, tuple[str, ...], bool]) -> Outputs:
    path, overrides, full_model = task
    scene = load_chain(path, overrides)
    if full_model:
        scene = _unreduced(scene)
    run = simulate(scene, verdict=False)
    return run_outputs(run, np.linspace(0.0, run.end, _SAMPLES + 1))


def _unreduced(scene: Scene) -> Scene:
    """The scene with all nodal dofs of its links kept."""
    everything = {"method": "none", "elastic_modes": None}
    links = [
        msgspec.structs.replace(link, elastic_modes=None, reduction=everything) if link.model else link
        for link in scene.record.links
    ]
    return Scene(scene.path, msgspec.structs.replace(scene.record, links=links))
