"""Reports of inversions: text for the terminal, HTML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from erls.inverse.inversion import Inversion
from erls.inverse.nature import shown
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table
from erls.tracking.confirm import Confirmation

_LEAST = 1e-12  # shown of what is missed: less is rounding
_ZEROS = 6  # shown, of those above the real axis
_HEAD = ("drive", "peak effort", "of rigid links", "unit")


def inversion_text(
    inversion: Inversion, elastic: Confirmation | None, rigid: Confirmation | None, output: Path | None
) -> str:
    """What was found, for the terminal."""
    parts = [*_words(inversion, elastic, rigid), table(_HEAD, _rows(inversion))]
    if output is not None and output.suffix == ".csv":
        parts.append("As drives of a scene beside the table:\n" + "\n".join(drive_lines(inversion, output)))
    return "\n\n".join(parts)


def drive_lines(inversion: Inversion, table_file: Path) -> list[str]:
    """``drive`` of each joint, as a scene beside the table takes it."""
    shape = f'shape = "table", file = "{table_file.name}", column = {{}}, interpolation = "cubic"'
    return [
        f'{name}: initial = {{ position = {inversion.start[name]:.9g} }}, '
        f'drive = {{ type = "torque", profiles = [{{ {shape.format(k + 1)} }}] }}'
        for k, name in enumerate(inversion.efforts)
    ]


def _words(inversion: Inversion, elastic: Confirmation | None, rigid: Confirmation | None) -> list[str]:
    problem, nature = inversion.problem, inversion.nature
    names = ", ".join(each.name for each in problem.conditions.every)
    about = f"{problem.scene.name}: {', '.join(problem.drives)} so that {names} is as demanded"
    above = [shown(zero) for zero in nature.zeros.tolist() if zero.imag >= 0][:_ZEROS]
    zeros = f"zeros [1/s], slow ones first: {', '.join(above) or 'none'}"
    steps = f"{inversion.method}, {len(inversion.t) - 1} steps, {inversion.iterations} iterations"
    ahead = f"drives begin {inversion.pre_actuation():.3g} s ahead (1 %)"
    lines = [about, f"{nature.words}\n{zeros}", f"{steps}, {inversion.wall_s:.2f} s; {ahead}"]
    if inversion.left > 0 and np.isfinite(inversion.left):
        lines.append(f"fast internal motions follow; the last pass changed efforts by {100 * inversion.left:.2g} %")
    return lines + [f"forward run {kind}: {_missed(run)}" for kind, run in _runs(elastic, rigid)]


def _runs(elastic: Confirmation | None, rigid: Confirmation | None) -> list[tuple[str, Confirmation]]:
    found = [("with these drives", elastic), ("with those of rigid links", rigid)]
    return [(name, run) for name, run in found if run is not None]


def _missed(run: Confirmation) -> str:
    settings, problem = run.run.scene.record.simulation, run.problem
    each = zip(problem.conditions.every, run.largest, strict=True)
    told = ", ".join(f"{one.name} {x:.3g} {one.unit}" for one, x in each)
    place = f"{1e3 * run.error:.4g} mm at most; " if problem.conditions.points else ""
    return f"{place}{told} ({settings.formulation})"


def _rows(inversion: Inversion) -> list[tuple[str, ...]]:
    units = {joint.name: joint.freedom.units[1] for joint in inversion.problem.mechanism.joints}
    return [
        (name, f"{np.abs(effort).max():.4g}", f"{np.abs(inversion.rigid_efforts[name]).max():.4g}", units[name])
        for name, effort in inversion.efforts.items()
    ]


def inversion_page(inversion: Inversion, elastic: Confirmation | None, rigid: Confirmation | None) -> str:
    """One self-contained HTML page."""
    parts = [paragraph(line) for text in _words(inversion, elastic, rigid) for line in text.splitlines()]
    parts += [paragraph(text, "note") for text in inversion.warnings]
    parts += [html_table(_HEAD, _rows(inversion)), heading("Efforts")]
    units = {joint.name: joint.freedom.units for joint in inversion.problem.mechanism.joints}
    for name, effort in inversion.efforts.items():
        curves = [
            Curve("elastic", inversion.t, effort),
            Curve("rigid links", inversion.t, inversion.rigid_efforts[name][: len(effort)], dashed=True),
        ]
        parts.append(figure(Plot(name, "t [s]", f"effort [{units[name][1]}]", curves)))
    if inversion.deflection.any():
        curves = [Curve("largest", inversion.t, inversion.deflection)]
        parts += [heading("Internal motion"), figure(Plot("Deflection", "t [s]", "deflection [m]", curves))]
    if elastic is not None:
        parts += [heading("What forward runs miss"), *_misses(inversion, elastic, rigid)]
    return page(f"{inversion.problem.scene.name}: inverse dynamics", parts)


def _misses(inversion: Inversion, elastic: Confirmation, rigid: Confirmation | None) -> list[str]:
    found = []
    for k, each in enumerate(inversion.problem.conditions.every):
        curves: list[Any] = [
            Curve(name, run.t, np.maximum(np.abs(run.missed[:, k]), _LEAST), dashed=run is rigid)
            for name, run in _runs(elastic, rigid)
        ]
        found.append(figure(Plot(each.name, "t [s]", f"missed by [{each.unit}]", curves, "y")))
    return found
