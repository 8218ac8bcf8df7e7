"""Plain text about runs of bodies and beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from erls.report.tables import readings_tables, statement_lines, table
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.run import BodyRun


def body_report(run: BodyRun, times: Sequence[float] = ()) -> str:
    """Summary of a run of bodies, nodes and connections at given times: its end, or all load steps, unless given."""
    s = run.summary(times or ([run.end] if isinstance(run, BodyMotion) else ()))
    lines = [
        f"{s['scene']}: {s['analysis']} on {s['group']}, {s['bodies']} bodies, {s['elements']} elements, "
        f"{s['nodes']} nodes, {s['conditions']} conditions"
    ]
    dynamic = s["analysis"] == "dynamics"
    if dynamic:
        lines.append(
            f"{s['integrator']}: {s['duration']:.6g} s in {s['steps']} steps, "
            f"{s['iterations_per_step']:.3f} iterations per step, {s['factorizations']} factorizations, "
            f"{s['wall_s']:.2f} s"
        )
        drift = s["energy"]["max_drift"]
        lines.append(
            f"energy: {s['energy']['initial']:.6g} J at the start, {s['energy']['final']:.6g} J at the end"
            + (f", drift at most {drift:.2g} J" if drift is not None else " (loaded or driven: not conserved)")
        )
    else:
        lines.append(_work(f"tangent {s['tangent']}", s) + f", {s['wall_s']:.2f} s")
    lines += statement_lines(run)
    if run.failure is not None:
        lines.append(f"stopped early: {run.failure}")
    parts = ["\n".join(lines)]
    if s.get("tangents"):
        parts.append("\n".join(_work(f"tangent {name}", w) for name, w in s["tangents"].items()))
    if s.get("modes"):
        rows = [
            (str(k), *(f"{m[name]:.9g}" for name in ("load", "frequency_hz") if name in m))
            for k, m in enumerate(s["modes"], start=1)
        ]
        parts.append(table(("mode", "load parameter" if "load" in s["modes"][0] else "frequency [Hz]"), rows))
    if s.get("turns"):
        rows = [(x["kind"], f"{x['load']:.9g}", f"{x['arc']:.6g}", str(x["ways"])) for x in s["turns"]]
        parts.append(table(("point of the path", "load parameter", "arc", "ways"), rows))
    head = "t [s]" if dynamic else run.axis.name
    places = [
        (f"{x['t']:g}", name, *(f"{c:.6f}" for c in place)) for x in s["samples"] for name, place in x["points"].items()
    ]
    parts.append(table((head, "node", "x [m]", "y [m]", "z [m]"), places))
    forces = [
        (f"{x['t']:g}", name, *(f"{c:.6g}" for c in (*wrench["force"], *wrench["moment"])))
        for x in s["samples"]
        for name, wrench in x["connections"].items()
    ]
    if forces:
        axes = ("Fx [N]", "Fy [N]", "Fz [N]", "Mx [N m]", "My [N m]", "Mz [N m]")
        parts.append("On the node of each connection\n" + table((head, "connection", *axes), forces))
    if isinstance(run, BodyMotion):
        parts += readings_tables(run.sensors, s["samples"])
    return "\n\n".join(parts)


def _work(name: str, w: dict[str, Any]) -> str:
    end = "" if w["converged"] else ", NOT converged"
    return (
        f"{name}: {w['iterations']} iterations in {w['load_steps']} load steps, {w['factorizations']} factorizations, "
        f"{w['cut_steps']} load steps halved{end}"
    )
