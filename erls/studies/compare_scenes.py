"""Formulations side by side on several scenes: how far they depart from one of them, against how far links bend.

Links of modal formulations are linear in their own frame, which leaves errors of second order: with a deflection δ of a
link of size L, departures of about δ²/L, that grow with the square of the deflection from one scene to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.studies.compare import COLUMNS, compare
from erls.studies.compare_result import Comparison, comparison_summary, distance
from fe_import.errors import ReportedError
from fe_import.files.toml import choose

JUDGE = "nodal"
_NEGLIGIBLE = 1e-4  # of the largest deflection: a scene that hardly bends says nothing about an order


@dataclass(frozen=True)
class Departure:
    """One formulation on one scene.

    Attributes
    ----------
    scene, formulation : str
    largest : float
        Distance of any named point from where the reference has it, over all times [m].
    deflection : float
        Largest one of the reference: of a node against its link's rigid shape [m].
    size : float
        Of the largest link [m].
    as_expected : bool
        Whether second order in the deflection, phase drift included, explains it (`erls.studies.compare.Pair`).
    """

    scene: str
    formulation: str
    largest: float
    deflection: float
    size: float
    as_expected: bool

    @property
    def share(self) -> float:
        """Of δ²/L."""
        square = self.deflection**2 / self.size
        return self.largest / square if square > 0 else float("nan")


@dataclass(frozen=True)
class SceneComparison:
    """The result of `compare_scenes`.

    Attributes
    ----------
    reference : str
        The formulation that the others are held against.
    comparisons : dict of Comparison
        By scene; those that could be run at all.
    refused : dict of ReportedError
        By scene: why it says nothing about departures.
    departures : tuple of Departure
    complete : bool
    """

    reference: str
    comparisons: dict[str, Comparison]
    refused: dict[str, ReportedError]
    departures: tuple[Departure, ...]
    complete: bool

    @property
    def formulations(self) -> tuple[str, ...]:
        """Those that departures are known of."""
        return tuple(dict.fromkeys(d.formulation for d in self.departures))

    def order(self, formulation: str) -> float | None:
        """Power of the deflection with which departures grow over the scenes that are as expected, by least squares of
        logarithms; None when fewer than two of them bend by different amounts.
        """
        own = [d for d in self.departures if d.formulation == formulation and d.largest > 0 and d.as_expected]
        largest = max((d.deflection for d in own), default=0.0)
        own = [d for d in own if d.deflection > _NEGLIGIBLE * largest]
        x, y = np.log([[d.deflection / d.size, d.largest / d.size] for d in own]).reshape(-1, 2).T
        if len(own) < 2 or np.ptp(x) < np.log(1.2):
            return None
        return float(np.polyfit(x, y, 1)[0])


def compare_scenes(
    paths: Sequence[Path],
    columns: Sequence[str],
    *,
    overrides: Sequence[str] = (),
    progress: Callable[[float, float], None] = lambda done, total: None,
    workers: int | None = None,
) -> SceneComparison:
    """Run every scene in every formulation.

    The reference is the nodal formulation if it is among them, else the first. Scenes that it cannot compute are named
    with the reason; the others go on.

    Parameters
    ----------
    paths : sequence of Path
        Scene files.
    columns : sequence of str
        Of `erls.studies.compare.COLUMNS`, two or more.
    overrides, progress, workers
        As for `erls.studies.compare.compare`.

    Raises
    ------
    SceneError
        Fewer than two columns, or an unknown one.
    """
    names = list(dict.fromkeys(columns))
    for name in names:
        choose(name, COLUMNS, "formulations", SceneError)
    if len(names) < 2:
        raise SceneError(
            Cause.BAD_FIELD,
            "a comparison needs two formulations",
            where="formulations",
            value=", ".join(names) or None,
            remedy="two or more of " + ", ".join(COLUMNS),
        )
    reference = JUDGE if JUDGE in names else names[0]
    comparisons: dict[str, Comparison] = {}
    refused: dict[str, ReportedError] = {}
    found: list[Departure] = []
    complete = True
    for k, path in enumerate(dict.fromkeys(paths)):

        def within(done: float, total: float, before: int = k) -> None:
            progress(before + done / total, len(paths))

        try:
            result = compare(path, names, overrides=overrides, progress=within, workers=workers)
        except ReportedError as problem:
            refused[str(path)] = problem
            continue
        comparisons[str(path)] = result
        found += departures(str(path), result, reference)
        if reference in result.errors:
            refused[str(path)] = result.errors[reference]
        if not result.complete:
            complete = False
            break
    return SceneComparison(reference, comparisons, refused, tuple(found), complete)


def departures(scene: str, comparison: Comparison, reference: str) -> list[Departure]:
    """Of all formulations that ran from the reference; none when it did not."""
    if reference not in comparison.outputs:
        return []
    judge = comparison.outputs[reference]
    result = []
    for name, other in comparison.outputs.items():
        if name != reference:
            apart = max((distance(judge.points[p], other.points[p]).largest for p in judge.points), default=0.0)
            fine = all(p.as_expected for p in comparison.pairs if {p.a, p.b} == {name, reference})
            result.append(Departure(scene, name, apart, judge.deflection, judge.size, fine))
    return result


def scenes_summary(comparison: SceneComparison) -> dict[str, Any]:
    """The JSON of ``erls compare`` on several scenes."""
    return {
        "reference": comparison.reference,
        "complete": comparison.complete,
        "departures": [
            {
                "scene": d.scene,
                "formulation": d.formulation,
                "departure": d.largest,
                "deflection": d.deflection,
                "size": d.size,
                "share_of_second_order": d.share,
                "as_expected": d.as_expected,
            }
            for d in comparison.departures
        ],
        "orders": {name: comparison.order(name) for name in comparison.formulations},
        "not_comparable": {scene: error.as_dict() for scene, error in comparison.refused.items()},
        "scenes": [{"file": scene, **comparison_summary(c)} for scene, c in comparison.comparisons.items()],
    }
