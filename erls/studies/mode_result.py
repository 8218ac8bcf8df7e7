"""What a study of mode counts found: changes of outputs, from where on they are small, the JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.studies.outputs import Outputs
from erls.studies.spectrum import amplitude_spectrum, peaks
from fe_import.errors import ReportedError

SUCCESSIVE = 3  # changes below the tolerance, one after the other, before a study says "converged"


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
    counts : dict of str to int
        Elastic modes by link.
    outputs : Outputs or None
        None when the run failed.
    error : ReportedError or None
    changes : tuple of Change
        Against the run before, the largest ratio first; empty for the first run.
    """

    counts: Mapping[str, int]
    outputs: Outputs | None
    error: ReportedError | None
    changes: tuple[Change, ...]

    @property
    def modes(self) -> int:
        """Elastic modes, of the link that has most."""
        return max(self.counts.values())

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
    available : dict of str to int
        Modes that there are of each link.
    ranked : bool
        Whether modes are fixed-interface ones in the order of a ranking, rather than elastic ones.
    """

    scene: str
    link: str
    points: tuple[Point, ...]
    tolerances: Tolerances
    converged: int | None
    remaining: tuple[tuple[str, float], ...]
    complete: bool
    available: Mapping[str, int]
    ranked: bool = False

    @property
    def kind(self) -> str:
        """What is counted."""
        return "ranked fixed-interface modes" if self.ranked else "elastic modes"

    @property
    def exhausted(self) -> bool:
        """Whether all modes that there are have been taken."""
        last = self.points[-1] if self.points else None
        return last is not None and last.outputs is not None and last.counts == self.available


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
    for name in after.recovered.keys() & before.recovered.keys():
        value = relative_change(before.recovered[name], after.recovered[name])
        found.append(Change(name, value, "of peak", value / limits.load))
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


def converged_at(points: Sequence[Point]) -> int | None:
    """The least mode count after which `SUCCESSIVE` changes stayed within the tolerances."""
    for k in range(len(points) - SUCCESSIVE):
        if all(p.unchanged for p in points[k + 1 : k + 1 + SUCCESSIVE]):
            return points[k].modes
    return None


def remaining_kinds(points: Sequence[Point]) -> tuple[tuple[str, float], ...]:
    """Kinds of the modes that the last step added and their share of the elastic energy, largest first."""
    done = [p.outputs for p in points if p.outputs is not None]
    if len(done) < 2:
        return ()
    shares: dict[str, float] = {}
    before_last, last = done[-2:]
    for name, energy in last.mode_energy.items():
        before = len(before_last.mode_energy.get(name, ()))
        for kind, share in list(zip(last.mode_kinds[name], energy, strict=True))[before:]:
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
        "all_modes_taken": study.exhausted,
        "points": [
            {
                "ranked_modes" if study.ranked else "elastic_modes": p.modes,
                "by_link": dict(p.counts),
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
