"""One self-contained HTML page: text, tables that sort and plots one can look into, without a network, on a phone too.

Plots and views are drawn by plotly.js (MIT), of which the part for lines and scenes in space lies beside this file: the
package of the same name for Python brings three times as much, more than a page may have. Matplotlib draws pictures
that cannot be asked; uPlot is a tenth as large, and knows no space. What a page shows is JSON within it.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from erls.files.results import MARK
from erls.maths.so3 import Array

_DIGITS = 7  # of numbers in plots
_MOST_NUMBERS = 120_000  # of a view, times two
_BOX = "@box@"  # for the name of what a part draws, which the page gives
_NUMBER = re.compile(r"[-+]?[\d.]")  # what a cell with one begins with
_UNIT = re.compile(r"\[[^\]]{1,6}\]")  # is not broken
_LONG = 25  # characters of a cell that may have several lines where the page is narrow
_SHORT = 3  # sections from which on a page has a list of contents


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
    """A section heading; where there are several, the list of contents leads to it."""
    return f'<h2 id="{_anchor(text)}">{html.escape(text)}</h2>'


def _anchor(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "section"


def code(text: str) -> str:
    """Lines to copy."""
    return f"<pre>{html.escape(text)}</pre>"


def folded(title: str, part: str) -> str:
    """A part that is long and seldom read: shown when its title is clicked, and in print."""
    return f"<details><summary>{html.escape(title)}</summary>{part}</details>"


def table(header: Sequence[str], rows: Sequence[Sequence[str]], explained: Sequence[str] = ()) -> str:
    """A table that scrolls by itself where the page is narrow; ``explained`` says what each column is."""
    told = list(explained) or [""] * len(header)
    texts = [not any(_NUMBER.match(row[k]) for row in rows) for k in range(len(header))]
    long = [any(len(row[k]) > _LONG for row in rows) for k in range(len(header))]
    text = {False: ' class="text"', True: ' class="text long"'}  # without any number on the left; long ones wrap
    kinds = [text[wraps] if words else "" for words, wraps in zip(texts, long, strict=True)]
    titles = [f' title="{html.escape(text)}"' if text else "" for text in told]
    heads = [_UNIT.sub(lambda unit: unit[0].replace(" ", "\u00a0"), html.escape(text)) for text in header]
    head = "".join(f"<th{k}{t}>{c}</th>" for c, k, t in zip(heads, kinds, titles, strict=True))
    body = "".join(
        "<tr>" + "".join(f"<td{k}>{html.escape(c)}</td>" for c, k in zip(row, kinds, strict=True)) + "</tr>"
        for row in rows
    )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def figure(plot: Plot) -> str:
    """A plot: pointing at it tells values, dragging zooms in, a name in the legend hides its curve."""
    told = {
        "x": plot.x_label,
        "y": plot.y_label,
        "logarithmic": "".join(axis for axis in plot.logarithmic if _positive(plot, axis)),
        "limit": plot.limit,
        "curves": [
            {
                "label": curve.label,
                "x": _numbers(curve.x),
                "y": _numbers(curve.y),
                "dashed": curve.dashed,
                "mode": "markers" if curve.points else "lines+markers" if curve.marked else "lines",
            }
            for curve in plot.curves
        ],
    }
    caption = f"<figcaption>{html.escape(plot.title)}{_note(plot)}</figcaption>" if plot.title else ""
    box = _box("plot", told, f"plot of {plot.y_label} over {plot.x_label}")
    return f"<figure>{caption}{box}</figure>"


def _positive(plot: Plot, axis: str) -> bool:
    """Whether an axis has something to show on a logarithmic scale."""
    return any((np.asarray(curve.x if axis == "x" else curve.y) > 0).any() for curve in plot.curves)


@dataclass(frozen=True)
class Shape:
    """A part of a mechanism in a view.

    Attributes
    ----------
    name : str
    lines : list of lists of int
        Nodes that lines run through.
    triangles : list of (3,) lists of int
        Of nodes.
    rest, moved : (f, n, 3) arrays
        Places of nodes without displacement, and displacements [m], in each frame.
    weights : (m, n) array, optional
        Lines and triangles are then over m corners, whose places and displacements are these weighted sums of those of
        the nodes: of a rigid surface with many corners, four nodes tell all frames.
    stress : (f, n) array, optional
        Von Mises [MPa]; not a number where it is not known.
    """

    name: str
    lines: list[list[int]]
    triangles: list[list[int]]
    rest: Array
    moved: Array
    weights: Array | None = None
    stress: Array | None = None


def frames_of(nodes: int, most: int = 121) -> int:
    """How many frames a view of so many nodes may have."""
    return int(min(most, max(2, _MOST_NUMBERS // max(3 * nodes, 1))))


def view(title: str, axis: str, unit: str, times: Array, shapes: Sequence[Shape]) -> str:
    """A mechanism in space that one can turn and play, its displacements magnified by a slider.

    Parameters
    ----------
    title : str
    axis, unit : str
        Symbol and unit of what it goes along.
    times : (f,) array
    shapes : sequence of Shape
    """
    parts = [
        {
            "name": shape.name,
            "nodes": shape.rest.shape[1],
            "lines": shape.lines,
            "triangles": shape.triangles,
            "rest": _packed(shape.rest),
            "moved": _packed(shape.moved),
            **{name: _packed(values) for name in ("weights", "stress") if (values := getattr(shape, name)) is not None},
        }
        for shape in shapes
    ]
    told = {"axis": axis, "unit": unit, "times": _numbers(times), "parts": parts}
    shades = _SHADES if any(shape.stress is not None for shape in shapes) else ""
    box = _box("view", told, "the mechanism in space", _CONTROLS.format(shades=shades))
    return f"<figure><figcaption>{html.escape(title)}</figcaption>{box}</figure>"


_CONTROLS = (
    '<div class="controls" id="@box@-controls"><button class="play" type="button">Play</button>'
    '<label>time <input type="range" min="0" value="0" step="1"><output></output></label>'
    '<label>displacement <input type="range" min="0" max="3" value="0" step="0.05"><output></output></label>'
    "{shades}</div>"
)
_SHADES = "<label>colours <select><option>deflection</option><option>stress</option></select></label>"


def _box(kind: str, told: dict[str, Any], label: str, controls: str = "") -> str:
    text = json.dumps(told, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")  # ends no script
    data = f'<script type="application/json" id="{_BOX}-data">{text}</script>'
    said = f'role="img" aria-label="{html.escape(label)}"'
    return f'{controls}<div class="{kind}" id="{_BOX}" {said}></div>{data}'


def _numbers(values: Any) -> list[float | None]:
    array = np.asarray(values, dtype=float)
    return [float(f"{x:.{_DIGITS}g}") if np.isfinite(x) else None for x in array.tolist()]


def _packed(values: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


def _note(plot: Plot) -> str:
    return f'<br><span class="note">{html.escape(plot.note)}</span>' if plot.note else ""


@cache
def _asset(name: str) -> str:
    content = files(__package__).joinpath("assets", name).read_bytes()
    return (gzip.decompress(content) if name.endswith(".gz") else content).decode("utf-8")


def _contents(parts: Sequence[str]) -> str:
    """A list that leads to the sections."""
    found = [match for part in parts for match in re.findall(r'^<h2 id="([^"]+)">(.*?)</h2>$', part)]
    if len(found) < _SHORT:
        return ""
    lines = "".join(f'<li><a href="#{name}">{text}</a></li>' for name, text in found)
    return f'<nav aria-label="contents"><ul>{lines}</ul></nav>\n'


def page(title: str, parts: Sequence[str]) -> str:
    """The whole document."""
    body = "\n".join(part.replace(_BOX, f"box-{number}") for number, part in enumerate(parts, 1))
    drawn = 'class="plot"' in body or 'class="view"' in body
    scripts = [_asset("canvas.js"), _asset("plotly-gl3d.min.js.gz")] if drawn else []
    scripts += [_asset("page.js")] if drawn or "<table>" in body else []
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="generator" content="{MARK}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<link rel="icon" href="data:,"><title>{html.escape(title)}</title>'
        f"<style>{_asset('page.css')}</style></head>\n"
        f"<body><h1>{html.escape(title)}</h1>\n{_contents(parts)}{body}\n"
        + "".join(f"<script>{text}</script>\n" for text in scripts)
        + "</body></html>\n"
    )
