"""The table of ``erls effects``: what is there, how large it is, what leaving it out costs and saves."""

from __future__ import annotations

from typing import Any

from erls.effects import EFFECTS
from erls.report.tables import table
from erls.selection.sizes import EffectSize
from erls.selection.survey import Survey


def effects_summary(found: Survey) -> dict[str, Any]:
    """The JSON of ``erls effects``."""
    settings = found.scene.record.simulation
    return {
        "scene": found.scene.name,
        "formulation": settings.formulation,
        "tolerance": settings.effects_tolerance,
        "effort_tolerance": settings.effects_effort_tolerance,
        "effects": [
            {
                "name": s.name,
                "summary": EFFECTS[s.name].summary,
                "present": s.present,
                "link": s.link or None,
                "auto": found.keeps(s),
                "force": s.force,
                "error": s.error,
                "effort_error": s.effort_error,
                "share": s.share,
            }
            for s in found.sizes
        ],
        "left_out": found.left,
        "decision": found.note,
    }


def effects_text(found: Survey) -> str:
    """The table with a short explanation."""
    settings = found.scene.record.simulation
    drives = any(s.effort_error is not None for s in found.sizes)
    header = ("effect", "auto", "force [N]", "error [m]", *(("drives",) if drives else ()), "time")
    rows = [
        (
            s.name if not s.link else f"  of {s.link}",
            _state(s, found),
            *((f"{s.force:.2g}", f"{s.error:.2g}") if s.present else ("-", "-")),
            *((_percent(s.effort_error),) if drives else ()),
            _percent(s.share),
        )
        for s in found.sizes
    ]
    lines = table(header, rows).split("\n")
    summaries = ["", *("" if s.link else EFFECTS[s.name].summary for s in found.sizes)]
    width = max(len(line) for line in lines)
    shown = "\n".join(f"{a.ljust(width)}  {b}".rstrip() for a, b in zip(lines, summaries, strict=True))
    parts = [f"{found.scene.name} ({settings.formulation}): physical effects", shown]
    if found.left:
        parts.append(f"not asked for by the scene: {', '.join(found.left)}")
    parts.append(
        f'auto: what effects = "auto" has to keep at a tolerance of {settings.effects_tolerance:.2g} m. '
        "force: largest generalized force, as one\n"
        "on all mass alike. error: largest distance of named points without the effect, in coarse runs. "
        + ("drives: change\nof drive forces, relative to their peak. time: part" if drives else "time: part\n")
        + " of an evaluation of the equations that leaving it out saves, with effects\n"
        "that share its products. Effects that save nothing stay on."
    )
    parts.append(found.note)
    return "\n\n".join(parts)


def _state(size: EffectSize, found: Survey) -> str:
    if not size.present:
        return "not there"
    return "on" if found.keeps(size) else "off"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.2g} %"
