"""One self-contained HTML page: text, tables and plots that open without a network, on a phone too."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from erls.files.results import MARK
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 60rem; padding: 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .7rem; text-align: right; border-bottom: 1px solid #8884; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
figure { margin: 1.5rem 0; }
figure div { overflow-x: auto; background: white; border-radius: 4px; }
figure svg { width: 100%; min-width: 22rem; height: auto; display: block; }
figcaption { padding-bottom: .3rem; font-weight: 600; }
.good::before { content: "\\2713  "; color: #2a7d2a; } .bad::before { content: "\\2717  "; color: #b3261e; }
.note { font-size: .9rem; opacity: .85; }
""".strip()


@dataclass(frozen=True)
class Curve:
    """One line of a plot; ``marked`` with its points shown, ``points`` nothing but these."""

    label: str
    x: Array
    y: Array
    dashed: bool = False
    marked: bool = False
    points: bool = False


@dataclass(frozen=True)
class Plot:
    """A plot: curves over a common axis; ``logarithmic`` names the axes with a logarithmic scale (``x``, ``y``)."""

    title: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]
    logarithmic: str = ""
    limit: float | None = None
    note: str = ""


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph; ``kind`` is ``good``, ``bad``, ``note`` or nothing."""
    return f'<p class="{kind}">{html.escape(text)}</p>' if kind else f"<p>{html.escape(text)}</p>"


def heading(text: str) -> str:
    """A section heading."""
    return f"<h2>{html.escape(text)}</h2>"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table that scrolls by itself where the page is narrow."""
    head = "".join(f"<th>{html.escape(c)}</th>" for c in header)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def figure(plot: Plot) -> str:
    """A plot as inline SVG, text kept as text."""
    from matplotlib.figure import Figure  # here: texts of the same reports do without it

    canvas = Figure(figsize=(6.0, 3.1), layout="constrained")
    axes = canvas.subplots()
    for curve in plot.curves:
        line = "" if curve.points else "--" if curve.dashed else "-"
        marker = "." if curve.points else "o" if curve.marked else ""
        axes.plot(curve.x, curve.y, label=curve.label, linewidth=1.2, linestyle=line, marker=marker, markersize=4)
    if plot.limit is not None:
        axes.axhline(plot.limit, color="0.4", linewidth=0.8, linestyle=":")
    for axis in plot.logarithmic:
        values = np.concatenate([c.x if axis == "x" else c.y for c in plot.curves] or [np.zeros(0)])
        if (values > 0).any():
            (axes.set_xscale if axis == "x" else axes.set_yscale)("log")
    axes.set_xlabel(plot.x_label)
    axes.set_ylabel(plot.y_label)
    axes.grid(alpha=0.3)
    if plot.curves:
        axes.legend(fontsize=8, loc="best")
    caption = f"<figcaption>{html.escape(plot.title)}{_note(plot)}</figcaption>"
    return f"<figure>{caption}<div>{_svg(canvas)}</div></figure>"


def _note(plot: Plot) -> str:
    return f'<br><span class="note">{html.escape(plot.note)}</span>' if plot.note else ""


_drawn = 0


def _svg(canvas: Figure) -> str:
    import matplotlib as mpl

    global _drawn
    _drawn += 1  # ids must differ between the drawings of one page
    out = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": f"erls{_drawn}", "font.family": "sans-serif"}):
        canvas.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>f{_drawn}-", text)
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1), count=1
    )


def page(title: str, parts: Sequence[str]) -> str:
    """The whole document."""
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="generator" content="{MARK}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<link rel="icon" href="data:,"><title>{html.escape(title)}</title><style>{_STYLE}</style></head>\n'
        f"<body><h1>{html.escape(title)}</h1>\n" + "\n".join(parts) + "\n</body></html>\n"
    )


