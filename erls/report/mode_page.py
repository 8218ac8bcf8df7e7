"""The report of ``erls study modes``: text for the terminal, HTML; figures of a publication beside ours."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table
from erls.studies.mode_result import SUCCESSIVE, ModeStudy, Point

_LARGEST_FILE = 1_000_000
_LEAST = 1e-12  # m, shown of distances: less is rounding
_WIDE = 100  # columns of a terminal
_NAME = 16  # characters of what a terminal shows of a name
_READING = "largest change of each figure over the run from the row above"
_COLUMN = re.compile(r"joint .+|point .+ [xyz]")


@dataclass(frozen=True)
class Printed:
    """A published table: figures by number of elastic modes, and what its file says about them.

    Attributes
    ----------
    time : float
        At which they hold [s].
    columns : tuple of str
        ``joint NAME`` (coordinate, deg) or ``point NAME x``.
    rows : dict of int to tuple of float
    note : str
    """

    time: float
    columns: tuple[str, ...]
    rows: dict[int, tuple[float, ...]]
    note: str


def read_printed(path: Path) -> Printed:
    """Read a published table: CSV with the header ``elastic_modes, t, joint NAME, point NAME x ...``, notes after #.

    Raises
    ------
    SceneError
        Not readable, or not such a table.
    """
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise _bad(path, "too large for a table of published figures", path.stat().st_size)
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise SceneError(Cause.NOT_READABLE, str(problem), where=str(path), remedy="give a CSV file") from None
    note = " ".join(line[1:].strip() for line in lines if line.startswith("#"))
    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    if not rows or [c.strip() for c in rows[0][:2]] != ["elastic_modes", "t"] or len(rows[0]) < 3:
        raise _bad(path, "not a table of published figures", ", ".join(rows[0]) if rows else None)
    columns = tuple(c.strip() for c in rows[0][2:])
    for column in columns:
        if not _COLUMN.fullmatch(column) or columns.count(column) > 1:
            raise _bad(path, "a column names no joint or axis of a point, or stands twice", column)
    found: dict[int, tuple[float, ...]] = {}
    times: set[float] = set()
    for number, row in enumerate(rows[1:], start=2):
        try:
            values = [float(c) for c in row]
            if len(values) != len(rows[0]) or not np.isfinite(values).all() or "_" in "".join(row):
                raise ValueError
        except ValueError:
            raise _bad(path, f"row {number} does not fit the header", ", ".join(row)) from None
        if values[0] != int(values[0]) or values[0] < 0 or int(values[0]) in found:
            raise _bad(path, f"row {number} does not fit: a mode count is a whole number and stands once", row[0])
        found[int(values[0])] = tuple(values[2:])
        times.add(values[1])
    if len(times) != 1:
        raise _bad(path, "the figures must hold at one time", sorted(times))
    return Printed(times.pop(), columns, found, note)


def _bad(path: Path, message: str, value: object) -> SceneError:
    remedy = "header: elastic_modes, t, then columns like 'joint shoulder' (deg) and 'point tip x' (m)"
    return SceneError(Cause.BAD_FIELD, message, where=str(path), value=value, remedy=remedy)


def beside(study: ModeStudy, printed: Printed) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows: printed and computed figures for every mode count of either.

    Raises
    ------
    SceneError
        A column that names no joint or point of the scene.
    """
    header = ("elastic modes", *(f"{c} {kind}" for c in printed.columns for kind in ("printed", "here")))
    ours = {p.modes: p for p in study.points if p.outputs is not None}
    rows = []
    for modes in sorted({*printed.rows, *ours}):
        cells = [str(modes)]
        for k, column in enumerate(printed.columns):
            cells.append(f"{printed.rows[modes][k]:g}" if modes in printed.rows else "")
            cells.append(_figure(ours[modes], column, printed.time) if modes in ours else "")
        rows.append(tuple(cells))
    return header, rows


def beside_summary(study: ModeStudy, printed: Printed) -> dict[str, Any]:
    """The same for JSON."""
    header, rows = beside(study, printed)
    return {"t": printed.time, "note": printed.note, "header": list(header), "rows": [list(row) for row in rows]}


def _figure(point: Point, column: str, time: float) -> str:
    outputs = point.outputs
    assert outputs is not None
    kind, _, rest = column.partition(" ")
    name, _, axis = rest.rpartition(" ")
    if kind == "joint" and rest in outputs.coordinates:
        history, digits, factor = outputs.coordinates[rest], 4, 180 / np.pi
    elif kind == "point" and name in outputs.points and axis in ("x", "y", "z"):
        history, digits, factor = outputs.points[name][:, "xyz".index(axis)], 6, 1.0
    else:
        raise SceneError(
            Cause.BAD_REFERENCE,
            "names no joint or point of the scene",
            where="published table",
            value=column,
            remedy="joints: " + ", ".join(outputs.coordinates) + "; points: " + ", ".join(outputs.points),
        )
    if not outputs.times[0] <= time <= outputs.times[-1] + 1e-12:
        return "beyond the run"
    return f"{factor * np.interp(time, outputs.times, history):.{digits}f}"


def mode_study_text(study: ModeStudy, printed: Printed | None = None) -> str:
    """Changes from count to count, and the verdict, for the terminal."""
    what = f"{study.kind} of link {study.link!r}" if study.link else f"{study.kind}, all links alike"
    told = f"{study.scene}: {what}; {_READING}: points [m], angles [rad], others relative; time [s]"
    parts = [fill(told, _WIDE), table(*_short_rows(study)), fill(verdict(study), _WIDE)]
    if printed is not None:
        parts.append(f"Published figures at t = {printed.time:g} s: {printed.note}\n" + table(*beside(study, printed)))
    return "\n\n".join(parts)


def verdict(study: ModeStudy) -> str:
    """What the study says about convergence."""
    t = study.tolerances
    limits = f"{t.position:g} m at points, {100 * t.load:g} % of peak loads, {100 * t.frequency:g} % of frequencies"
    if study.converged is not None:
        return f"converged at {study.converged} {study.kind}: {SUCCESSIVE} successive changes below {limits}"
    text = f"NOT converged: there are no {SUCCESSIVE} successive changes below {limits}"
    if study.exhausted:
        text = f"complete: all {study.points[-1].modes} {study.kind} that there are have been taken"
    last = next((p for p in reversed(study.points) if p.changes), None)
    if last is not None and not last.unchanged:
        c = last.changes[0]
        text += f"; the last step still moved {c.output} by {c.value:.2g} {c.unit}"
    if study.remaining:
        kind, share = study.remaining[0]
        most = f"{100 * share:.2g} % of the elastic energy"
        text += f"; of the modes it added, '{kind}' ones hold the largest share, {most}"
    if not study.complete:
        text += "; the study was interrupted"
    return text


def mode_study_page(study: ModeStudy, printed: Printed | None = None) -> str:
    """One self-contained HTML page."""
    parts = [paragraph(verdict(study), "good" if study.converged is not None or study.exhausted else "bad")]
    parts += [heading("Changes from one count to the next"), paragraph(_READING, "note")]
    parts.append(html_table(*_change_rows(study)))
    if printed is not None:
        parts += [heading(f"Published figures at t = {printed.time:g} s"), html_table(*beside(study, printed))]
        parts.append(paragraph(printed.note, "note"))
    parts += [figure(plot) for plot in _plots(study)]
    failed = [p for p in study.points if p.error is not None]
    parts += [paragraph(f"{p.modes} modes failed: {p.error}", "bad") for p in failed]
    return page(f"{study.scene}: how many modes", parts)


def _change_rows(study: ModeStudy) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    units = {c.output: c.unit for p in study.points for c in p.changes}
    names = sorted(units)
    rows = []
    for p in study.points:
        if p.outputs is None:
            rows.append((str(p.modes), "failed", *("" for _ in names), ""))
            continue
        values = {c.output: f"{c.value:.2g}" for c in p.changes}
        state = "" if not p.changes else "yes" if p.unchanged else "no"
        wall = f"{p.outputs.summary['wall_s']:.2f}"
        rows.append((str(p.modes), wall, *(values.get(n, "") for n in names), state))
    return (study.kind, "time [s]", *(f"{n} [{units[n]}]" for n in names), "all within tolerance"), rows


_SHORT = {
    "points": ("point",),
    "angles": ("angle",),
    "forces": ("force",),
    "moments": ("moment",),
    "efforts": ("effort",),
    "sections": ("section-force", "section-moment"),
    "stress": ("stress",),
    "peaks": ("spectrum",),
}
"""Heads of a terminal's table, and the kinds of which each shows the largest change."""


def _short_rows(study: ModeStudy) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The largest change of each kind, and what changed most for its tolerance, within `_WIDE` columns."""
    heads = [head for head, kinds in _SHORT.items() if any(_of_kind(p, kinds) for p in study.points)]
    name = min(_NAME, _WIDE - 20 - sum(2 + max(len(head), 7) for head in heads))
    rows = []
    for p in study.points:
        worst = p.changes[0].output if p.changes else "failed" if p.outputs is None else ""
        worst = worst if len(worst) <= name else f"{worst[: name - 1]}…"
        cells = [f"{max(found):.1e}" if (found := _of_kind(p, _SHORT[head])) else "" for head in heads]
        wall = "" if p.outputs is None else f"{p.outputs.summary['wall_s']:.2f}"
        rows.append((str(p.modes), wall, *cells, worst, "" if not p.changes else "yes" if p.unchanged else "no"))
    return ("modes", "time", *heads, "worst", "ok"), rows


def _of_kind(point: Point, kinds: Sequence[str]) -> list[float]:
    return [change.value for change in point.changes if change.output.split()[0] in kinds]


def _plots(study: ModeStudy) -> list[Plot]:
    done = [p for p in study.points if p.changes]
    plots = []
    for kind, unit in (
        ("point", "m"), ("angle", "rad or m"), ("force", "of peak"), ("moment", "of peak"), ("effort", "of peak"),
        ("section-force", "of peak"), ("section-moment", "of peak"), ("stress", "of peak"),
    ):  # fmt: skip
        names = sorted({c.output for p in done for c in p.changes if c.output.split()[0] == kind})
        curves = []
        for name in names:
            pairs = [(p.modes, c.value) for p in done for c in p.changes if c.output == name and c.value > 0]
            if pairs:
                counts, values = np.array(pairs, dtype=float).T
                curves.append(Curve(name, counts, values, marked=True))
        if curves:
            limit = study.tolerances.position if kind == "point" else None
            limit = study.tolerances.load if unit == "of peak" else limit
            plots.append(
                Plot(f"change of {kind} from the count before", study.kind, f"change [{unit}]", curves, "y", limit)
            )
    return [*plots, *_distances([p for p in study.points if p.outputs is not None])]


def _distances(runs: Sequence[Point]) -> list[Plot]:
    """Of every point, over time, from where most modes put it."""
    last = runs[-1].outputs if runs else None
    plots = []
    for name, places in last.points.items() if last is not None else ():
        curves = []
        for p in runs[:-1]:
            if p.outputs is not None:
                apart = np.linalg.norm(p.outputs.points[name] - places, axis=1)
                curves.append(Curve(_counted(p), p.outputs.times, np.maximum(apart, _LEAST)))
        if curves:
            title = f"distance of {name} from where {_counted(runs[-1])} put it"
            plots.append(Plot(title, "t [s]", "distance [m]", curves, "y"))
    return plots


def _counted(point: Point) -> str:
    return "1 mode" if point.modes == 1 else f"{point.modes} modes"
