"""How many modes are enough: one scene with more and more elastic modes, until chosen outputs stop changing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.simulation.simulate import simulate
from erls.studies.mode_overrides import available_modes, count_field, default_counts
from erls.studies.outputs import Outputs, run_outputs
from erls.studies.pool import run_all
from erls.studies.spectrum import amplitude_spectrum, peaks
from fe_import.errors import ReportedError
from fe_import.files.toml import choose

SUCCESSIVE = 3  # changes below the tolerance, one after the other, before a study says "converged"
_SAMPLES = 1000


@dataclass(frozen=True)
class Tolerances:
    """What counts as unchanged.

    Attributes
    ----------
    position : float
        Distance of named points, at any time [m]; angles are held to it over the size of the largest link.
    load : float
        Joint forces, moments and efforts, relative to their peak.
    frequency : float
        Spectrum peaks of the named points' accelerations, relative.
    """

    position: float = 1e-4
    load: float = 0.02
    frequency: float = 0.01

    def __post_init__(self) -> None:
        for name in ("position", "load", "frequency"):
            if not 0 < getattr(self, name) < np.inf:
                message, remedy = "a tolerance must be a positive number", "give what does not matter to you"
                value = getattr(self, name)
                raise SceneError(Cause.BAD_FIELD, message, where=f"{name} tolerance", value=value, remedy=remedy)


@dataclass(frozen=True)
class Change:
    """How far an output moved from one mode count to the next: its value, and that over its tolerance."""

    output: str
    value: float
    unit: str
    ratio: float


@dataclass(frozen=True)
class Point:
    """One run of the study.

    Attributes
    ----------
    modes : int
        Elastic modes.
    outputs : Outputs or None
        None when the run failed.
    error : ReportedError or None
    changes : tuple of Change
        Against the run before, the largest ratio first; empty for the first run.
    """

    modes: int
    outputs: Outputs | None
    error: ReportedError | None
    changes: tuple[Change, ...]

    @property
    def unchanged(self) -> bool:
        """Whether every output stayed within its tolerance."""
        return bool(self.changes) and self.changes[0].ratio <= 1


@dataclass(frozen=True)
class ModeStudy:
    """The result of `study_modes`.

    Attributes
    ----------
    scene : str
    link : str
        The link whose modes were varied; empty for all alike.
    points : tuple of Point
        In rising mode count.
    tolerances : Tolerances
    converged : int or None
        The least mode count after which three successive changes stayed within the tolerances.
    remaining : tuple of (str, float)
        Kinds of the modes that the last step added, with their share of the elastic energy there, largest first.
    complete : bool
        False after an interrupt.
    """

    scene: str
    link: str
    points: tuple[Point, ...]
    tolerances: Tolerances
    converged: int | None
    remaining: tuple[tuple[str, float], ...]
    complete: bool


def study_modes(
    scene: Scene | Path | str,
    counts: Sequence[int] | None = None,
    *,
    link: str = "",
    overrides: Sequence[str] = (),
    tolerances: Tolerances | None = None,
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
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
    finished, complete = run_all(_run, tasks, progress, workers)
    limit = tolerances or Tolerances()
    points: list[Point] = []
    for one in finished:
        before = points[-1].outputs if points else None
        changes = () if one.result is None or before is None else changed(before, one.result, limit)
        points.append(Point(chosen[one.number], one.result, one.error, changes))
    return ModeStudy(loaded.name, link, tuple(points), limit, _converged(points), _remaining(points), complete)


def _run(task: tuple[str, tuple[str, ...]]) -> Outputs:
    path, overrides = task
    run = simulate(load_chain(path, overrides))
    return run_outputs(run, np.linspace(0.0, run.end, _SAMPLES + 1))


def changed(before: Outputs, after: Outputs, limits: Tolerances) -> tuple[Change, ...]:
    """Changes of all outputs between two runs of one scene, the largest ratio first."""
    found = []
    for name, places in after.points.items():
        distance = float(np.linalg.norm(places - before.points[name], axis=1).max())
        found.append(Change(f"point {name}", distance, "m", distance / limits.position))
    for name, angle in after.angles.items():
        difference = float(np.abs(angle - before.angles[name]).max())
        found.append(Change(f"angle {name}", difference, "rad", difference * after.size / limits.position))
    for kind in ("forces", "moments", "efforts"):
        new, old = getattr(after, kind), getattr(before, kind)
        for name in new:
            value = relative_change(old[name], new[name])
            found.append(Change(f"{kind[:-1]} {name}", value, "of peak", value / limits.load))
    for name in after.accelerations:
        value = _peak_change(before, after, name)
        found.append(Change(f"spectrum {name}", value, "of frequency", value / limits.frequency))
    return tuple(sorted(found, key=lambda c: -c.ratio))


def relative_change(before: Array, after: Array) -> float:
    """Largest distance between two histories over the peak of the second; 0 for two that are nothing."""
    rows = [x.reshape(len(x), -1) for x in (before, after)]
    peak = np.linalg.norm(rows[1], axis=1).max()
    difference = np.linalg.norm(rows[1] - rows[0], axis=1).max()
    return float(difference / peak) if peak > 1e-9 else 0.0


def _peak_change(before: Outputs, after: Outputs, name: str) -> float:
    """Largest relative shift of the three highest peaks; 1 where one is gone. Further modes bring further peaks."""
    old, new = (
        peaks(amplitude_spectrum(o.times, o.accelerations[name]), count) for o, count in ((before, 3), (after, 20))
    )
    return max(
        (min((abs(p.frequency - q.frequency) / p.frequency for q in new), default=1.0) for p in old), default=0.0
    )


def _converged(points: Sequence[Point]) -> int | None:
    for k in range(len(points) - SUCCESSIVE):
        if all(p.unchanged for p in points[k + 1 : k + 1 + SUCCESSIVE]):
            return points[k].modes
    return None


def _remaining(points: Sequence[Point]) -> tuple[tuple[str, float], ...]:
    """Kinds of the modes that the last step added and their share of the elastic energy, largest first."""
    done = [p for p in points if p.outputs is not None]
    if len(done) < 2 or done[-1].outputs is None:
        return ()
    shares: dict[str, float] = {}
    last = done[-1].outputs
    for name, energy in last.mode_energy.items():
        for kind, share in list(zip(last.mode_kinds[name], energy, strict=True))[done[-2].modes :]:
            shares[kind] = shares.get(kind, 0.0) + float(share)
    return tuple(sorted(shares.items(), key=lambda item: -item[1]))


def study_summary(study: ModeStudy) -> dict[str, Any]:
    """The JSON of ``erls study modes``."""
    return {
        "study": "modes",
        "scene": study.scene,
        "link": study.link or None,
        "tolerances": {
            "position": study.tolerances.position,
            "load": study.tolerances.load,
            "frequency": study.tolerances.frequency,
        },
        "converged": study.converged,
        "remaining": [{"kind": kind, "share": share} for kind, share in study.remaining],
        "complete": study.complete,
        "points": [
            {
                "elastic_modes": p.modes,
                "wall_s": None if p.outputs is None else p.outputs.summary["wall_s"],
                "error": None if p.error is None else p.error.as_dict(),
                "changes": [
                    {"output": c.output, "value": c.value, "unit": c.unit, "ratio": c.ratio} for c in p.changes
                ],
                "end": None if p.outputs is None else _end(p.outputs),
            }
            for p in study.points
        ],
    }


def _end(outputs: Outputs) -> dict[str, Any]:
    """Joints and points at the end of the run."""
    return {
        "t": float(outputs.times[-1]),
        "joints": {
            name: {"coordinate": float(outputs.coordinates[name][-1]), "angle": float(angle[-1])}
            for name, angle in outputs.angles.items()
        },
        "points": {name: places[-1].tolist() for name, places in outputs.points.items()},
    }
