"""The report of ``erls compare``: text for the terminal, HTML, CSV."""

from __future__ import annotations

import io

import numpy as np

from erls.files.csv_table import write_table
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table
from erls.studies.compare_result import Comparison, Distance, Pair
from erls.studies.spectrum import amplitude_spectrum, peaks

_LEAST = 1e-12  # m, shown of distances: less is rounding
_HISTORIES = (
    ("points", "position", "m"),
    ("accelerations", "acceleration", "m/s2"),
    ("angles", "joint angle", "rad or m"),
    ("coordinates", "joint coordinate", "rad or m"),
    ("forces", "joint force", "N"),
    ("moments", "joint moment", "N m"),
    ("efforts", "joint effort", "N m or N"),
)


def comparison_text(comparison: Comparison) -> str:
    """Cost, distances and verdicts for the terminal."""
    parts = [f"{comparison.scene}: {', '.join([*comparison.outputs, *comparison.errors])}"]
    header, rows = _cost(comparison)
    parts.append(table(header, rows))
    for p in comparison.pairs:
        header, rows = distance_rows(p)
        parts.append(f"{p.a} against {p.b}: {p.verdict}\n" + table(header, rows))
    parts += [f"{name} failed: {error}" for name, error in comparison.errors.items()]
    if not comparison.complete:
        parts.append("interrupted: only the formulations above finished")
    return "\n\n".join(parts)


def comparison_page(comparison: Comparison) -> str:
    """One self-contained HTML page."""
    parts = []
    for p in comparison.pairs:
        parts.append(paragraph(f"{p.a} against {p.b}: {p.verdict}", "good" if p.as_expected else "bad"))
    parts += [paragraph(f"{name} failed: {error}", "bad") for name, error in comparison.errors.items()]
    parts += [heading("Cost"), html_table(*_cost(comparison))]
    for p in comparison.pairs:
        parts += [heading(f"{p.a} against {p.b}"), html_table(*distance_rows(p))]
    for plot in _plots(comparison):
        parts.append(figure(plot))
    parts += [heading("Peaks of the acceleration spectra"), html_table(*_peak_rows(comparison))]
    warnings = [f"{name}: {w}" for name, o in comparison.outputs.items() for w in o.summary["warnings"]]
    if warnings:
        parts += [heading("Warnings"), *(paragraph(w) for w in warnings)]
    return page(f"{comparison.scene}: {', '.join(comparison.outputs)}", parts)


def comparison_csv(comparison: Comparison) -> str:
    """Histories of all columns side by side, one row per time."""
    columns: list[tuple[str, np.ndarray]] = []
    for name, o in comparison.outputs.items():
        if not columns:
            columns.append(("t [s]", o.times))
        for kind, label, unit in _HISTORIES:
            for item, values in getattr(o, kind).items():
                components = values.reshape(len(values), -1).T
                axes = ("",) if len(components) == 1 else (" x", " y", " z")
                columns += [(f"{name}: {label} {item}{a} [{unit}]", c) for a, c in zip(axes, components, strict=True)]
        columns.append((f"{name}: energy [J]", o.energy))
    out = io.StringIO()
    rows = zip(*(map(repr, values.tolist()) for _, values in columns), strict=True)
    write_table(out, [name for name, _ in columns], rows)
    return out.getvalue()


def _cost(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    header = (
        "formulation",
        "elastic coordinates",
        "steps",
        "evaluations",
        "time [s]",
        "energy drift [J]",
        "deflection [m]",
    )
    rows: list[tuple[str, ...]] = []
    for name, o in comparison.outputs.items():
        s = o.summary
        drift = s["energy"]["max_drift"]
        rows.append(
            (
                name,
                str(s.get("elastic_coordinates", "")),
                str(s["steps"]),
                str(s["rhs_calls"]),
                f"{s['wall_s']:.2f}",
                "not conserved" if drift is None else f"{drift:.1e}",
                f"{o.deflection:.3g}",
            )
        )
    return header, rows


def distance_rows(p: Pair) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of all distances of a pair."""
    rows = []
    for kind, label, unit in _HISTORIES:
        found: dict[str, Distance] = getattr(p, kind)
        rows += [_row(f"{label} {name}", d, unit) for name, d in found.items()]
    rows.append(_row("energy since the start", p.energy, "J"))
    return ("quantity", "largest", "rms", "peak value", "unit"), rows


def _row(name: str, d: Distance, unit: str) -> tuple[str, ...]:
    return name, f"{d.largest:.3g}", f"{d.rms:.3g}", f"{d.peak:.3g}", unit


def _peak_rows(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    rows = []
    for name, o in comparison.outputs.items():
        for point, a in o.accelerations.items():
            for p in peaks(amplitude_spectrum(o.times, a)):
                rows.append((point, name, f"{p.frequency:.3f}", f"{p.amplitude:.3g}"))
    return ("point", "formulation", "frequency [Hz]", "amplitude [m/s²]"), sorted(rows)


def _plots(comparison: Comparison) -> list[Plot]:
    """Coordinates in time and their differences, distances, accelerations in time and frequency."""
    outputs = comparison.outputs
    if not outputs:
        return []
    first = next(iter(outputs.values()))
    plots = []
    for point in first.points:
        for axis, letter in enumerate("xyz"):
            if np.ptp(first.points[point][:, axis]) < 1e-9:
                continue
            curves = [
                Curve(name, o.times, o.points[point][:, axis], dashed=k > 0)
                for k, (name, o) in enumerate(outputs.items())
            ]
            plots.append(Plot(f"{letter} coordinate of {point}", "t [s]", f"{letter} [m]", curves))
            if len(curves) > 1:
                beside = [Curve(c.label, c.x, c.y - curves[0].y) for c in curves[1:]]
                title = f"{letter} coordinate of {point}: how far from that of {curves[0].label}"
                plots.append(Plot(title, "t [s]", f"difference in {letter} [m]", beside))
        apart = [
            Curve(
                f"{p.a} - {p.b}",
                first.times[1:],
                np.maximum(np.linalg.norm(outputs[p.a].points[point] - outputs[p.b].points[point], axis=1)[1:], _LEAST),
            )
            for p in comparison.pairs
        ]
        if apart:
            plots.append(
                Plot(f"distance of {point} between formulations", "t [s]", "distance [m]", apart, logarithmic="y")
            )
        plots += _acceleration_plots(comparison, point)
    energies = [Curve(name, o.times, o.energy - o.energy[0]) for name, o in outputs.items()]
    plots.append(Plot("total energy since the start", "t [s]", "energy [J]", energies))
    return plots


def _acceleration_plots(comparison: Comparison, point: str) -> list[Plot]:
    times, lines = [], []
    for k, (name, o) in enumerate(comparison.outputs.items()):
        a = o.accelerations[point]
        times.append(Curve(name, o.times, np.linalg.norm(a, axis=1), dashed=k > 0))
        s = amplitude_spectrum(o.times, a)
        lines.append(Curve(name, s.frequencies[1:], np.maximum(s.amplitudes[1:], 1e-12), dashed=k > 0))
    return [
        Plot(f"acceleration of {point}", "t [s]", "acceleration [m/s²]", times),
        Plot(f"spectrum of the acceleration of {point}", "frequency [Hz]", "amplitude [m/s²]", lines, logarithmic="xy"),
    ]
