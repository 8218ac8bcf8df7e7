"""Plain-text tables of modal models and runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from operator import getitem
from typing import Any

import numpy as np

from erls.mechanism.sensors.base import Sensor
from erls.run.accuracy import PARTS
from erls.run.chain.run import ChainRun
from erls.run.readings import output_names
from erls.run.record import Run
from fe_import.modal.inertia import MassProperties
from fe_import.modal.model import HealthCheck, ModalModel

_SHOWN_MODES = 40


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns aligned to the right, the first one to the left."""
    widths = [max(len(r[k]) for r in [header, *rows]) for k in range(len(header))]
    lines = []
    for row in [header, *rows]:
        cells = [row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def modal_report(model: ModalModel) -> str:
    """Modes, mass properties and health of a modal model."""
    p = model.provenance
    head = (
        f"{model.name}: {p.get('kind', 'link')} model, {p.get('dofs', '?')} dofs, "
        f"{len(model.interface_nodes)} interfaces ({', '.join(i.name for i in model.interface_nodes)}), "
        f"reduced by {p.get('method', '?')} to {model.modes} coordinates (solver {p.get('solver', '?')})"
    )
    parts = [head]
    if model.form == "orthonormal":
        modes = [
            (str(k - 5), f"{f:.3f}", model.kinds[k], _percent(model, k), _residual(model, k))
            for k, f in enumerate(model.frequencies_hz[6:], start=6)
        ][:_SHOWN_MODES]
        header = ("mode", "frequency [Hz]", "kind", "damping", "too high by")
        parts.append("Elastic modes of the free link\n" + table(header, modes))
    if len(model.fixed_interface.frequencies_hz):
        parts.append(_effective_mass_table(model))
    parts.append(_mass_table(model.mass_properties, model.full_mass_properties))
    failed = [c for c in model.health if not c.ok]
    rows = [(c.name, f"{c.value:.2e}", *_verdict(c)) for c in model.health]
    parts.append("Health: " + ("ok" if not failed else f"{len(failed)} checks FAILED"))
    if rows:
        parts[-1] += "\n" + table(("check", "value", "limit", ""), rows)
    return "\n\n".join(parts)


def family_report(summary: Mapping[str, Any]) -> str:
    """Parameters and bounds of a family of links, from its summary."""
    rows = [(name, f"{low:.6g}", f"{high:.6g}") for name, (low, high) in summary["parameters"].items()]
    bound, first = summary["bound"], ", ".join(f"{f:.6g}" for f in summary["frequencies_hz"])
    said = [
        f"{summary['link']}: a family on {summary['fields']} elastic fields, from {summary['samples']} samples",
        table(("parameter", "from", "to"), rows),
        f"Frequencies in the middle, inboard interface held [Hz]: {first}",
        f"In the whole range within {100 * bound['frequencies']:.2g} % (frequencies) and "
        f"{100 * bound['flexibility']:.2g} % (static flexibility): three times what was found at {summary['places']} "
        "places that gave nothing to it, and the corners",
    ]
    if not summary["healthy"]:
        said.append("Health in the middle: checks FAILED; reduce the description alone to see them")
    return "\n\n".join(said)


def _residual(model: ModalModel, mode: int) -> str:
    """Those of members of families are not known."""
    return "-" if "residuals" in model.provenance else f"{model.residuals[mode]:.1e}"


def _percent(model: ModalModel, mode: int) -> str:
    ratio = model.damping_ratios[mode]
    return f"{100 * ratio:.3g} %" if ratio else "-"


def _verdict(check: HealthCheck) -> tuple[str, str]:
    if not check.judged:
        return "-", ""
    return f"{check.limit:.0e}", "ok" if check.ok else "FAILED"


def _effective_mass_table(model: ModalModel) -> str:
    fixed = model.fixed_interface
    axes = ("x", "y", "z", "about x", "about y", "about z")
    rows = [
        (str(k + 1), f"{f:.3f}", *(f"{100 * share:.2f}" for share in shares))
        for k, (f, shares) in enumerate(zip(fixed.frequencies_hz, fixed.effective_mass, strict=True))
    ][:_SHOWN_MODES]
    rows.append(("all", "", *(f"{100 * share:.2f}" for share in fixed.effective_mass.sum(axis=0))))
    return "Modes with clamped interfaces, effective mass and inertia [%]\n" + table(
        ("mode", "frequency [Hz]", *axes), rows
    )


def _mass_table(reduced: MassProperties, full: MassProperties) -> str:
    def row(name: str, a: np.ndarray | float, b: np.ndarray | float) -> tuple[str, str, str, str]:
        def show(v: np.ndarray | float) -> str:
            return " ".join(f"{x:.9g}" for x in np.atleast_1d(v))

        difference = np.abs(np.atleast_1d(a) - np.atleast_1d(b)).max()
        return name, show(a), show(b), f"{difference:.1e}"

    rows = [
        row("mass [kg]", reduced.mass, full.mass),
        row("centre of mass [m]", np.round(reduced.centre_of_mass, 12), np.round(full.centre_of_mass, 12)),
        row("principal inertia [kg m²]", np.linalg.eigvalsh(reduced.inertia), np.linalg.eigvalsh(full.inertia)),
    ]
    return "Mass properties\n" + table(("", "reduced", "full model", "difference"), rows)


def statement_lines(run: Run) -> list[str]:
    """What a run states of its error, and its verdict."""
    if run.accuracy is None or run.trust is None:
        return []
    total = run.accuracy.total
    parts = [(name, getattr(run.accuracy, name)) for name in PARTS]
    shown = ", ".join(f"{name} {'not known' if part is None else f'{part:.1e}'}" for name, part in parts)
    lines = [f"error: {'not known' if total is None else f'at most {total:.1e} m'} ({shown})"]
    return [*lines, f"verdict: {run.trust.verdict}", *(f"  {reason}" for reason in run.trust.reasons)]


def chain_report(run: ChainRun, times: Sequence[float] = ()) -> str:
    """Summary of a chain's run, and joints and points at given times (its end unless given)."""
    s = run.summary(times or [run.end])
    drift = s["energy"]["max_drift"]
    if "nodes" in s:
        model = f"{s['elements']} elements, {s['nodes']} nodes, {s['formulation']}"
    else:
        variant = next(f"{name.replace('_', ' ')} {s[name]}" for name in ("gauge", "body_frame") if name in s)
        model = f"{s['elastic_coordinates']} elastic coordinates "
        model += f"(highest {s['highest_frequency_hz']:.4g} Hz), {s['formulation']}, {variant}"
    lines = [
        f"{s['scene']}: {s['joints']} joints, {model}",
        f"{s['integrator']}: {s['duration']:.6g} s in {s['steps']} steps, {s['rhs_calls']} evaluations, "
        f"{s['newton_iterations']} iterations, {s['factorizations']} factorizations, {s['wall_s']:.2f} s",
        f"energy: {s['energy']['initial']:.6g} J at the start, {s['energy']['final']:.6g} J at the end"
        + (f", drift at most {drift:.2g} J" if drift is not None else " (driven, loaded or damped: not conserved)"),
    ]
    if run.stability is not None:
        lines.append(run.stability.line)
    lines += statement_lines(run)
    if run.failure is not None:
        lines.append(f"stopped early: {run.failure}")
    lines += [
        f"event {happening.name!r} at t = {happening.time:.6g} s, {'rising' if happening.rising else 'falling'}"
        for happening in run.events
    ]
    rows = []
    for sample in s["samples"]:
        for name, moved in zip(run.joint_names, run.formulation.mechanism.joints, strict=True):
            revolute, joint = moved.freedom.turns, reduce(getitem, name.split("/"), sample["joints"])

            def show(value: float, revolute: bool = revolute, unit: str = moved.freedom.units[0]) -> str:
                return f"{np.degrees(value):.4f} deg" if revolute else f"{value:.6f} {unit}"

            same = abs(joint["angle"] - joint["coordinate"]) < 1e-12
            coordinate = "" if same else f"theta {show(joint['coordinate'])}"
            rows.append((f"{sample['t']:g}", name, show(joint["angle"]), coordinate, ""))
        for name, point in sample["points"].items():
            rows.append((f"{sample['t']:g}", name, *(f"{x:.6f}" for x in point)))
    parts = ["\n".join(lines), table(("t [s]", "", "x [m]", "y [m]", "z [m]"), rows)]
    return "\n\n".join([*parts, *readings_tables(run.sensors, s["samples"])])


def readings_tables(sensors: Sequence[Sensor], samples: Sequence[dict[str, Any]]) -> list[str]:
    """What sensors read at the times of samples, a row for each component; nothing of scenes without sensors."""
    rows = []
    for sample in samples if sensors else ():
        found = [x if isinstance(x, list) else [x] for x in sample["sensors"].values()]
        values = (f"{value:.6g}" for parts in found for value in parts)
        rows += [(f"{sample['t']:g}", *row) for row in zip(output_names(sensors), values, strict=True)]
    return [table(("t [s]", "sensor", "reading"), rows)] if rows else []
