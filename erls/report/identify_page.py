"""An identification in words, and as a page."""

from __future__ import annotations

from erls.identify.identify import Identification
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table

_PARAMETERS = ("parameter", "start", "value", "± (95 %)")
_COLUMNS = ("column", "noise", "rms before", "rms after", "correlation of residuals")


def identify_text(found: Identification) -> str:
    """What a terminal shows."""
    parts = [table(_PARAMETERS, _parameters(found)), "", table(_COLUMNS, _columns(found))]
    return "\n".join([*parts, "", *_remarks(found), f"{found.runs} runs, {found.wall_s:.3g} s"])


def identify_page(found: Identification) -> str:
    """One self-contained HTML page: parameters, and every column before and after, with what is left."""
    remarks = [paragraph(text, "bad") for text in _remarks(found)]
    parts = [heading("Parameters"), html_table(_PARAMETERS, _parameters(found)), *remarks]
    parts += [heading("Columns"), html_table(_COLUMNS, _columns(found))]
    for name, column in found.columns.items():
        parts.append(heading(name))
        curves = [
            Curve("measured", found.times, column.measured, points=True),
            Curve("fitted", found.times, column.simulated),
            Curve("before", found.times, column.before, dashed=True),
        ]
        parts.append(figure(Plot("", "t [s]", name, curves)))
        left = Curve("measured - fitted", found.times, column.measured - column.simulated, points=True)
        parts.append(figure(Plot("What is left", "t [s]", name, [left])))
    return page(f"{found.scene.name}: fitted to {found.record.name}", parts)


def _parameters(found: Identification) -> list[tuple[str, ...]]:
    return [
        (key, f"{one.start:.6g}", f"{one.value:.6g}", "none" if one.half_width is None else f"{one.half_width:.2g}")
        for key, one in found.parameters.items()
    ]


def _columns(found: Identification) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for name, c in found.columns.items():
        before, after = (float(((c.measured - x) ** 2).mean() ** 0.5) for x in (c.before, c.simulated))
        rows.append((name, f"{c.noise:.4g}", f"{before:.4g}", f"{after:.4g}", f"{c.likeness:.2f}"))
    return rows


def _remarks(found: Identification) -> list[str]:
    groups = [
        f"{group[0]} cannot be told from this record" if len(group) == 1
        else f"only a combination of {', '.join(group)} can be told from this record"
        for group in found.not_told
    ]  # fmt: skip
    return [*groups, *found.warnings]
