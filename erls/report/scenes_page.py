"""The report of ``erls compare`` on several scenes: text for the terminal, HTML, CSV."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from erls.files.csv_table import write_table
from erls.report.compare_page import distance_rows
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table
from erls.studies.compare_scenes import SceneComparison

TITLE = "Departure against deflection"


def scenes_text(comparison: SceneComparison) -> str:
    """Departures, their order, what could not be compared, and verdicts for the terminal."""
    parts = [f"{TITLE}: largest distance of named points from {comparison.reference}"]
    header, rows = departure_rows(comparison)
    if rows:
        parts.append(table(header, rows))
    parts += [text for text, _ in statements(comparison)]
    parts += failures(comparison)
    if not comparison.complete:
        parts.append("interrupted: only the scenes above finished")
    return "\n\n".join(parts)


def scenes_page(comparison: SceneComparison) -> str:
    """One self-contained HTML page."""
    parts = [paragraph(text, "good" if fine else "bad") for text, fine in statements(comparison)]
    parts += [paragraph(text, "note") for text in failures(comparison)]
    parts += [heading(TITLE), html_table(*departure_rows(comparison))]
    if comparison.departures:
        parts.append(figure(_plot(comparison)))
    for scene, found in comparison.comparisons.items():
        for p in found.pairs:
            parts += [heading(f"{Path(scene).stem}: {p.a} against {p.b}")]
            parts += [paragraph(p.verdict, "good" if p.as_expected else "bad"), html_table(*distance_rows(p))]
    return page(f"{len(comparison.comparisons)} scenes: departures from {comparison.reference}", parts)


def scenes_csv(comparison: SceneComparison) -> str:
    """One row for each formulation on each scene."""
    out = io.StringIO()
    head = ["scene", "formulation", "deflection [m]", "size [m]", "departure [m]", "departure L / deflection^2"]
    figures = ((d, (d.deflection, d.size, d.largest, d.share)) for d in comparison.departures)
    write_table(out, head, ([d.scene, d.formulation, *map(repr, found)] for d, found in figures))
    return out.getvalue()


def departure_rows(comparison: SceneComparison) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """A row for each scene, in the order of deflections."""
    names = comparison.formulations
    header = ("scene", "deflection [m]", *(f"{n} {what}" for n in names for what in ("[m]", "/ (deflection^2/L)")))
    by_scene = {d.scene: d.deflection for d in comparison.departures}
    rows: list[tuple[str, ...]] = []
    for scene in sorted(by_scene, key=lambda s: by_scene[s]):
        own = {d.formulation: d for d in comparison.departures if d.scene == scene}
        cells = [(f"{own[n].largest:.3g}", f"{own[n].share:.2f}") if n in own else ("-", "-") for n in names]
        rows.append((Path(scene).stem, f"{by_scene[scene]:.3g}", *(c for pair in cells for c in pair)))
    return header, rows


def statements(comparison: SceneComparison) -> list[tuple[str, bool]]:
    """What the table says, and whether it is as second order has it."""
    result = []
    for name in comparison.formulations:
        own = [d for d in comparison.departures if d.formulation == name]
        fine = [d for d in own if d.as_expected]
        text = f"{name} departs from {comparison.reference} by up to {max(d.largest for d in own):.2g} m; on "
        text += f"{len(fine)} of {len(own)} scenes second order in the deflection, phase drift included, explains it"
        order = comparison.order(name)
        if order is not None:
            text += f", and from one to the next it grows as deflection to the power {order:.1f}"
        odd = [Path(d.scene).stem for d in own if not d.as_expected]
        if odd:
            text += f"; NOT on {', '.join(odd)}: look at the meshes first (simulation.elements_per_member of "
            text += f"{comparison.reference}), then at step and number of modes"
        result.append((text, not odd))
    return result


def failures(comparison: SceneComparison) -> list[str]:
    """Scenes that say nothing about departures, and formulations that failed on one."""
    result = [f"{Path(scene).name} is not comparable: {error}" for scene, error in comparison.refused.items()]
    for scene, found in comparison.comparisons.items():
        result += [
            f"{Path(scene).name}: {name} failed: {error}"
            for name, error in found.errors.items()
            if name != comparison.reference
        ]
    return result


def _plot(comparison: SceneComparison) -> Plot:
    curves = []
    for name in comparison.formulations:
        own = sorted((d for d in comparison.departures if d.formulation == name), key=lambda d: d.deflection)
        x, y = np.array([[d.deflection / d.size, max(d.largest / d.size, 1e-16)] for d in own]).T
        curves.append(Curve(name, x, y, marked=True))
    x = curves[0].x
    curves.append(Curve("deflection^2", x, x**2, dashed=True))
    return Plot(
        "departure over deflection, both over the size of the link", "deflection / L", "departure / L", curves, "xy"
    )
