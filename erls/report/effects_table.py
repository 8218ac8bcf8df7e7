"""The table of ``erls effects``: what is there, how large it is, what leaving it out costs and saves."""

from __future__ import annotations

from typing import Any

from erls.effects import EFFECTS
from erls.report.tables import table
from erls.selection.probe import EffectSize
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
                "auto": s.name not in found.off,
                "force": s.force,
                "error": s.error,
                "effort_error": s.effort_error,
                "share": s.share,
            }
            for s in found.sizes
        ],
        "left_out": found.left,
    }


def effects_text(found: Survey) -> str:
    """The table with a short explanation."""
    settings = found.scene.record.simulation
    drives = any(s.effort_error is not None for s in found.sizes)
    header = ("effect", "auto", "force [N]", "error [m]", *(("drives",) if drives else ()), "time", "")
    rows = [
        (
            s.name,
            _state(s, found),
            *((f"{s.force:.2g}", f"{s.error:.2g}") if s.present else ("-", "-")),
            *((_percent(s.effort_error),) if drives else ()),
            _percent(s.share),
        )
        for s in found.sizes
    ]
    widths = [(*row, EFFECTS[row[0]].summary) for row in rows]
    parts = [f"{found.scene.name} ({settings.formulation}): physical effects", _left(table(header, widths), header)]
    if found.left:
        parts.append(f"not asked for by the scene: {', '.join(found.left)}")
    parts.append(
        "auto: on or off with effects = \"auto\" at a tolerance of "
        f"{settings.effects_tolerance:.2g} m; force: largest generalized force,\n"
        "as one on the whole mechanism; error: largest distance of named points without the effect, in coarse runs;\n"
        + ("drives: change of drive forces\nrelative to their peak; " if drives else "")
        + "time: part of an evaluation of the equations that leaving it\nout saves. Effects that save nothing stay on."
    )
    return "\n\n".join(parts)


def _state(size: EffectSize, found: Survey) -> str:
    if not size.present:
        return "not there"
    return "off" if size.name in found.off else "on"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.2g} %"


def _left(text: str, header: tuple[str, ...]) -> str:
    """The last column aligned to the left."""
    lines = text.split("\n")
    width = max(len(line) for line in lines)
    column = max(len(EFFECTS[name].summary) for name in EFFECTS if any(EFFECTS[name].summary in line for line in lines))
    result = []
    for line in lines:
        line = line.ljust(width)
        result.append((line[: width - column] + line[width - column :].strip()).rstrip())
    return "\n".join(result)
