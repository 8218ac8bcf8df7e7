"""Reports of optimizations: text for the terminal, HTML."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from erls.optimization.pictures import frames_among
from erls.optimization.result import REASONS, Analysis, Confirmed, Optimization, Outcome
from erls.report.html import Curve, Plot, Shape, figure, heading, page, paragraph, view
from erls.report.html import table as html_table
from erls.report.tables import table

Rows = list[tuple[str, ...]]
_AGAIN = "Simulated again, all steps unless said"
_SHOWN = 12  # active constraints


def optimum_text(found: Optimization) -> str:
    """What came out, beside what is published."""
    parts = [_about(found)]
    if found.tried:
        parts.append("Choices\n" + table(_tried_header(found), _tried_rows(found)))
    parts.append(table(_header(found), _rows(found)))
    if any(o.confirmed for o in found.outcomes):
        parts.append(f"{_AGAIN}\n" + table(_confirmed_header(found), _confirmed_rows(found)))
    for o in found.outcomes:
        if o.active:
            parts.append(f"{o.method}: what holds the design\n" + table(_ACTIVE, _active_rows(found, o)))
        if o.further:
            parts.append(f"{o.method}: further starts\n" + table(_STARTS, _start_rows(o)))
    parts += [f"{o.method}: {o.status}: {_reason(o)}" for o in found.outcomes]
    return "\n\n".join(parts)


def optimum_page(found: Optimization) -> str:
    """One self-contained HTML page."""
    parts = [paragraph(_about(found))]
    for o in found.outcomes:
        parts.append(paragraph(f"{o.method}: {_reason(o)}", "good" if o.status == "converged" else "bad"))
    if found.tried:
        parts += [heading("Choices"), html_table(_tried_header(found), _tried_rows(found))]
    parts += [heading("Designs"), html_table(_header(found), _rows(found))]
    parts += [heading(_AGAIN), html_table(_confirmed_header(found), _confirmed_rows(found))]
    parts += [figure(plot) for plot in _motions(found)]
    parts += [heading("Start and optimum"), *_pictures(found)]
    for o in found.outcomes:
        parts += [heading(f"{o.method}: what holds the design"), html_table(_ACTIVE, _active_rows(found, o))]
        if o.further:
            parts += [heading(f"{o.method}: further starts"), html_table(_STARTS, _start_rows(o))]
        parts += [heading(f"{o.method}: analyses"), html_table(_analyses_header(found), _analyses(o))]
        parts += [figure(plot) for plot in _histories(o)]
    return page(f"{found.problem.name}: optimum", parts)


def _about(found: Optimization) -> str:
    names = [o.method for o in found.outcomes]
    sizes = f"{len(found.problem.names)} variables, scene {found.problem.scene.name}"
    return f"{found.problem.name}: {sizes}, {', '.join(names)}"


def _tried_header(found: Optimization) -> tuple[str, ...]:
    return *found.chosen, "objective", *found.problem.names, "violation", "analyses", "by", "status", ""


def _tried_rows(found: Optimization) -> Rows:
    """The best of each combination."""
    rows: Rows = []
    for options, o in ((one.options, one.best) for one in found.tried):
        about = _share(o.violation), str(o.analyses), o.method, o.status, "chosen" if options == found.chosen else ""
        rows.append((*options.values(), _number(o.objective), *_numbers(o.x.tolist()), *about))
    return rows


def _reason(o: Outcome) -> str:
    text = REASONS[o.status]
    if o.status != "converged" and o.violation > 0:
        text += f"; {o.worst or 'a constraint'} passes its limit by {100 * o.violation:.3g} %"
    for name in o.idle:
        text += f"; {name} holds nothing: it comes to {100 * o.peaks[name]:.3g} % of its limit"
    for name, share in o.excess.items():
        text += f"; {name} is held as a smooth value, {100 * share:.2g} % of the limit above the largest"
    return text


def _header(found: Optimization) -> tuple[str, ...]:
    counts = "analyses", "inner", "seconds", "KKT", "status"
    return "", "objective", *found.problem.names, "violation, all steps", *counts


def _rows(found: Optimization) -> Rows:
    start = found.start
    rows: Rows = [("start", _number(start.objective), *_numbers(start.x.tolist()), _share(start.violation), *5 * [""])]
    for o in found.outcomes:
        counts = str(o.analyses), str(o.inner_iterations or ""), f"{o.wall_s:.2f}", f"{o.residual:.1e}"
        rows.append((o.method, _number(o.objective), *_numbers(o.x.tolist()), _share(o.violation), *counts, o.status))
        rows += _published(found, o.method)
    shown = {o.method for o in found.outcomes}
    for name in found.problem.record.published:
        rows += [] if name in shown else _published(found, name)
    return rows


def _published(found: Optimization, method: str) -> Rows:
    known = found.problem.record.published.get(method)
    if known is None:
        return []
    values = [known.variables.get(name) for name in found.problem.names]
    counts = ["" if n is None else str(n) for n in (known.analyses, known.inner_iterations)]
    own = ["" if value is None else _number(value) for value in values]
    return [(f"{method}, published", _number(known.objective), *own, "", *counts, "", "", "")]


def _confirmed_header(found: Optimization) -> tuple[str, ...]:
    return "method", "simulated by", *(c.name for c in found.problem.record.constraints), "violation"


def _confirmed_rows(found: Optimization) -> Rows:
    rows: Rows = []
    for o in found.outcomes:
        for c in o.confirmed:
            names = [one.name for one in found.problem.record.constraints]
            values = [_number(c.values[name]) if name in c.values else "" for name in names]
            rows.append((o.method, c.formulation, *values, c.failure or _share(c.violation)))
    return rows


_ACTIVE = ("constraint", "where", "share of its limit", "multiplier")
_STARTS = ("objective", "violation", "analyses", "status")


def _active_rows(found: Optimization, o: Outcome) -> Rows:
    rows: Rows = []
    times = {c.name: found.problem.times(c) for c in found.problem.record.constraints}
    for a in sorted(o.active, key=lambda a: -a.multiplier)[:_SHOWN]:
        if a.row < 0:
            where = "lower bound" if a.row == -1 else "upper bound"
        else:
            where = f"sample {a.row}"
            if a.name in times and a.row < len(times[a.name]):
                where = f"t = {times[a.name][a.row]:.4g} s"
        rows.append((a.name, where, f"{a.share:.6f}", f"{a.multiplier:.4g}"))
    return rows


def _start_rows(o: Outcome) -> Rows:
    return [(_number(f), _share(v), str(n), status) for f, v, n, status in o.further]


def _analyses_header(found: Optimization) -> tuple[str, ...]:
    return "analysis", "objective", *found.problem.names, "violation", "change", "inner"


def _analyses(o: Outcome) -> Rows:
    return [
        (str(k), _number(a.objective), *_numbers(a.x.tolist()), _share(a.violation), _change(a), str(a.inner or ""))
        for k, a in enumerate(o.history, 1)
    ]


def _change(a: Analysis) -> str:
    return "" if not np.isfinite(a.change) else f"{a.change:.2e}"


def _histories(o: Outcome) -> list[Plot]:
    count = np.arange(1.0, len(o.history) + 1)
    objective = Curve(o.method, count, np.array([a.objective for a in o.history]), marked=True)
    passed = Curve(o.method, count, np.array([a.violation for a in o.history]), marked=True)
    return [
        Plot("Objective", "analysis", "objective", [objective]),
        Plot("Violation", "analysis", "share beyond the limit", [passed], limit=0.0),
    ]


def _motions(found: Optimization) -> list[Plot]:
    """Constraints over the motion, at the start and at the optima."""
    plots = []
    for c in found.problem.record.constraints:
        curves = [] if found.begun is None else _curve("start", found.begun, c.name, True)
        for o in found.outcomes:
            curves += _curve(o.method, o.confirmed[0], c.name, False) if o.confirmed else []
        if curves:
            plots.append(Plot(f"{c.name} during the motion", "t [s]", c.name, curves, limit=c.limit))
    return plots


def _pictures(found: Optimization) -> Iterator[str]:
    """The mechanism at the start and at each optimum, with true sections."""
    shown = [("start", found.begun)] + [(o.method, o.confirmed[0]) for o in found.outcomes if o.confirmed]
    for label, one in shown:
        if one is not None and one.shapes:
            times = one.instants[frames_among(len(one.instants))]
            shapes = [Shape(s.name, s.lines, s.triangles, s.rest, s.moved) for s in one.shapes]
            yield view(f"{label}: turn it by dragging; colours show how far links bend", "t", "s", times, shapes)


def _curve(label: str, found: Confirmed, name: str, dashed: bool) -> list[Curve]:
    return [Curve(label, found.instants, found.curves[name], dashed=dashed)] if name in found.curves else []


def _number(value: float) -> str:
    return f"{value:.6g}"


def _numbers(values: Sequence[float]) -> list[str]:
    return [_number(value) for value in values]


def _share(value: float) -> str:
    return f"{round(100 * value, 3) + 0.0:.3f} %"  # never -0.000
