"""The report of ``erls study cost``: text for the terminal, CSV, HTML."""

from __future__ import annotations

import io
from textwrap import fill

import numpy as np

from erls.files.csv_table import write_table
from erls.maths.so3 import Array
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table
from erls.studies.cost_result import CostStudy, recommendation
from erls.studies.ladder import CostPoint

_HEADER = (
    *("setting", "accuracy", "time [s]", "error [m]", "warns of [m]", "steps", "right-hand sides", "factorizations"),
)

_SHORT = ("formulation, modes, integrator, effects", "accuracy", "time [s]", "error [m]", "warns of [m]", "steps")
_WIDE = 100  # columns of a terminal


def cost_text(study: CostStudy) -> str:
    """The front, what failed, and the recommendation, for the terminal."""
    parts = [
        f"{study.scene}: error against time, {len(study.runs)} settings",
        fill(_about_reference(study), _WIDE),
        "Runs that no other one beats in both error and time\n" + table(_SHORT, [_short(r) for r in study.front]),
    ]
    causes: dict[str, list[str]] = {}
    for r in study.runs:
        if r.failure is not None:
            causes.setdefault(str(r.failure), []).append(f"{_named(r)} ({_accuracy(r)})")
    for cause, settings in causes.items():
        listed = fill("; ".join(settings), _WIDE, initial_indent="  ", subsequent_indent="  ")
        parts.append(f"{fill(f'Failed: {cause}', _WIDE)}\n{listed}")
    ended = recommendation(study) + ("" if study.complete else "; the study was interrupted")
    return "\n\n".join([*parts, fill(ended, _WIDE)])


def cost_csv(study: CostStudy) -> str:
    """Every run as one row."""
    front = set(map(id, study.front))
    out = io.StringIO()
    head = (
        *("formulation", "elastic_modes", "integrator", "effects", "knob", "value", "wall_s", "error_m", "steps"),
        *("rhs_calls", "factorizations", "on_front", "failure", "warned_error_m"),
    )
    rows: list[tuple[object, ...]] = []
    for r in study.runs:
        s = r.setting
        modes = "all" if s.modes is None else s.modes
        figures = ("", "") if r.failure else (f"{r.wall_s:.6g}", f"{r.error:.6g}")
        work = (r.steps, r.rhs_calls, r.factorizations)
        cause = "" if r.failure is None else str(r.failure.cause)
        rows.append((s.formulation, modes, s.integrator, s.effects, s.knob, f"{s.value:.6g}", *figures, *work,
                     int(id(r) in front), cause, "" if r.failure else f"{r.foretold:.6g}"))  # fmt: skip
    write_table(out, head, rows)
    return out.getvalue()


def cost_page(study: CostStudy) -> str:
    """One self-contained HTML page."""
    parts = [paragraph(recommendation(study), "good" if study.chosen is not None else "bad")]
    if not study.complete:
        parts.append(paragraph("The study was interrupted: what had finished is shown.", "bad"))
    parts.append(paragraph(_about_reference(study)))
    parts.append(figure(_plot(study)))
    parts += [heading("The front: no other run is better in both"), html_table(_HEADER, [_row(r) for r in study.front])]
    done = [r for r in study.runs if r.failure is None]
    parts += [heading("All runs"), html_table(_HEADER, [_row(r) for r in done])]
    failed = _failed(study)
    if failed:
        parts += [heading("Failed, with their cause"), html_table(("setting", "accuracy", "cause"), failed)]
    return page(f"{study.scene}: what accuracy costs", parts)


def _about_reference(study: CostStudy) -> str:
    linear = "; links are linear in it, and what that leaves out is not counted" if study.reference.linear else ""
    warned = "".join(f" The reference itself warns: {text}." for text in study.reference.warnings)
    return (
        f"Reference: {study.reference.made_by}; its own error is about {study.reference.error:.1e} m{linear}.{warned} "
        f"Error: {'largest' if study.norm == 'max' else 'root mean square'} distance over time at the worst of "
        f"{', '.join(study.points)}. Time: the integration, with choosing effects and certifying where they are auto, "
        f"median of its runs. Settings whose run warns of an error above {study.tolerance:.3g} m are not recommended."
    )


def _row(r: CostPoint) -> tuple[str, ...]:
    counts = (str(r.steps), str(r.rhs_calls), str(r.factorizations))
    warned = f"{r.foretold:.2e}" if r.foretold else ""
    return (r.setting.name, _accuracy(r), f"{r.wall_s:.3g}", f"{r.error:.2e}", warned, *counts)


def _named(r: CostPoint) -> str:
    """The setting, as short as it can be told from others."""
    s = r.setting
    return f"{s.formulation}, {'all' if s.modes is None else s.modes}, {s.integrator}, {s.effects}"


def _short(r: CostPoint) -> tuple[str, ...]:
    """A row for a terminal."""
    _, *figures = _row(r)
    return (_named(r), *figures[: len(_SHORT) - 1])


def _accuracy(r: CostPoint) -> str:
    return f"{r.setting.knob} {r.setting.value:.3g}"


def _failed(study: CostStudy) -> list[tuple[str, str, str]]:
    return [(r.setting.name, _accuracy(r), str(r.failure)) for r in study.runs if r.failure is not None]


def _plot(study: CostStudy) -> Plot:
    ladders: dict[str, list[CostPoint]] = {}
    for r in study.runs:
        if r.failure is None:
            ladders.setdefault(r.setting.name, []).append(r)
    # the ladders nearest to the front are told apart by name; a plot with all of them could not be read
    on_front = list(dict.fromkeys(r.setting.name for r in study.front))
    curves = [
        Curve(name, _times(ladders[name]), _errors(ladders[name]), marked=True)
        for name in on_front
    ]
    others = [r for name, runs in ladders.items() if name not in on_front for r in runs]
    if others:
        curves.append(Curve("all others", _times(others), _errors(others), points=True))
    return Plot(
        "error against time",
        "time of the integration [s]",
        "error [m]",
        curves,
        "xy",
        study.tolerance,
        "dotted: the tolerance asked for",
    )


def _times(runs: list[CostPoint]) -> Array:
    return np.array([r.wall_s for r in runs])


def _errors(runs: list[CostPoint]) -> Array:
    return np.array([max(r.error, 1e-300) for r in runs])
