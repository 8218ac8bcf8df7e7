"""What a study of cost found: the front of its runs, the cheapest that is good enough, a sentence, the JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from erls.studies.ladder import CostPoint, Norm
from erls.studies.reference import Reference

_AS_CHEAP = 1.2  # times the shortest: what noise makes of equal times


@dataclass(frozen=True)
class CostStudy:
    """The result of `study_cost`.

    Attributes
    ----------
    scene : str
    points : tuple of str
        Named points that the error is taken over.
    norm : str
    tolerance : float
        What the user asked for [m].
    reference : Reference
    runs : tuple of CostPoint
        Ladder by ladder, from coarse to fine.
    front : tuple of CostPoint
        Runs that no other one beats in both error and time, from cheap to accurate.
    chosen : CostPoint or None
        The cheapest that meets the tolerance; of those within a fifth of its time the plainest.
    chosen_overrides : tuple of str
        Its ``KEY=VALUE``.
    complete : bool
        False after an interrupt.
    """

    scene: str
    points: tuple[str, ...]
    norm: Norm
    tolerance: float
    reference: Reference
    runs: tuple[CostPoint, ...]
    front: tuple[CostPoint, ...]
    chosen: CostPoint | None
    chosen_overrides: tuple[str, ...]
    complete: bool


def pareto_front(runs: Sequence[CostPoint]) -> tuple[CostPoint, ...]:
    """Runs that no other one beats in both error and time, from cheap to accurate."""
    front: list[CostPoint] = []
    for run in sorted((r for r in runs if r.failure is None), key=lambda r: (r.wall_s, r.error)):
        if not front or run.error < front[-1].error:
            front.append(run)
    return tuple(front)


def cheapest(runs: Sequence[CostPoint], largest: float, tolerance: float) -> CostPoint | None:
    """The run to recommend: of those off by ``largest`` at most that do not warn of more than the tolerance the
    cheapest, or, of those as cheap within the noise, the plainest: all effects, or a set told in few words.
    """
    met = [run for run in runs if run.failure is None and run.error <= largest and run.foretold <= tolerance]
    shortest = min((run.wall_s for run in met), default=0.0)
    equal = [run for run in met if run.wall_s <= _AS_CHEAP * shortest]
    return min(equal, key=_plainness, default=None)


def _plainness(run: CostPoint) -> tuple[bool, int, float]:
    effects = run.setting.effects
    return effects == "auto", (effects != "all") + effects.count("+") + effects.count("-"), run.wall_s


def recommendation(study: CostStudy) -> str:
    """One sentence: the cheapest setting that meets the tolerance, or that none does."""
    where = f"{study.tolerance:.3g} m ({study.norm} over time, at {', '.join(study.points)})"
    if study.chosen is None:
        best = min((r for r in study.runs if r.failure is None), key=lambda r: r.error, default=None)
        if study.reference.error >= study.tolerance:
            unsure = f"the reference itself is known to {study.reference.error:.2g} m only"
            return f"no setting can be judged within {where}: {unsure}; raise the budget (--budget)"
        if best is None:
            return f"no setting ran; none can be recommended for {where}"
        found = f"the best was {best.setting.name}, {best.setting.knob} = {best.setting.value:.3g}"
        warned = f", and its run warns of {best.foretold:.2g} m" if best.foretold > study.tolerance else ""
        return f"no setting meets {where}: {found}, off by {best.error:.2g} m{warned}"
    s = study.chosen.setting
    return (
        f"the cheapest setting within {where} is {s.name}, {s.knob} = {s.value:.3g}: "
        f"off by {study.chosen.error:.2g} m in {study.chosen.wall_s:.3g} s"
    )


def cost_summary(study: CostStudy) -> dict[str, Any]:
    """The JSON of ``erls study cost``."""
    front = set(map(id, study.front))
    return {
        "study": "cost",
        "scene": study.scene,
        "points": list(study.points),
        "norm": study.norm,
        "tolerance": study.tolerance,
        "reference": {
            "made_by": study.reference.made_by,
            "error": study.reference.error,
            "linear_links": study.reference.linear,
            "warnings": list(study.reference.warnings),
        },
        "complete": study.complete,
        "recommendation": recommendation(study),
        "chosen": None if study.chosen is None else _point_summary(study.chosen, True),
        "runs": [_point_summary(run, id(run) in front) for run in study.runs],
    }


def _point_summary(run: CostPoint, on_front: bool) -> dict[str, Any]:
    s = run.setting
    return {
        "formulation": s.formulation,
        "integrator": s.integrator,
        "effects": s.effects,
        "elastic_modes": s.modes,
        s.knob: s.value,
        "wall_s": run.wall_s,
        "error": run.error,
        "steps": run.steps,
        "rhs_calls": run.rhs_calls,
        "factorizations": run.factorizations,
        "runs": run.runs,
        "warned_error": run.foretold,
        "on_front": on_front,
        "failure": None if run.failure is None else run.failure.as_dict(),
    }
