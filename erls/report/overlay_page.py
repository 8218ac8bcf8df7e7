"""The page of ``erls view --overlay``: a measured record over what a run says."""

from __future__ import annotations

from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table
from erls.studies.overlay import Overlaid, Overlay

_HEADER = ("column", "largest difference", "rms", "peak measured", "correlation", "lag [s]")


def overlay_text(found: Overlay) -> str:
    """Figures for the terminal."""
    return "\n".join([table(_HEADER, _rows(found)), *_remarks(found)])


def overlay_page(found: Overlay) -> str:
    """One self-contained HTML page: figures, and each column of the record over that of the run."""
    x = f"{found.run.axis.symbol} [{found.run.axis.unit or '1'}]"
    parts = [*(paragraph(text, "note") for text in _remarks(found)), html_table(_HEADER, _rows(found))]
    parts.append(heading("Measured and simulated"))
    for column in found.columns:
        curves = [
            Curve("measured", column.times, column.measured),
            Curve("simulated", column.times, column.simulated, dashed=True),
        ]
        parts.append(figure(Plot(column.name, x, column.name, curves)))
        apart = Curve("measured - simulated", column.times, column.measured - column.simulated)
        parts.append(figure(Plot(f"{column.name}: difference", x, column.name, [apart])))
    return page(f"{found.run.title}: {found.record.name}", parts)


def _rows(found: Overlay) -> list[tuple[str, ...]]:
    return [_row(column) for column in found.columns]


def _row(c: Overlaid) -> tuple[str, ...]:
    likeness = tuple("-" if x is None else f"{x:.4g}" for x in (c.correlation, c.lag))
    return c.name, f"{c.largest:.3g}", f"{c.rms:.3g}", f"{c.peak:.3g}", *likeness


def _remarks(found: Overlay) -> list[str]:
    """What was left out."""
    result = []
    if found.unknown:
        result.append(f"not in the run, left out: {', '.join(found.unknown)}")
    if found.outside:
        result.append(f"{found.outside} rows lie outside the run")
    if found.every > 1:
        result.append(f"of {found.every} rows one was taken")
    return result
