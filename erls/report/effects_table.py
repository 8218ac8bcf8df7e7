"""The table of ``erls effects``: what is there, how large it is, what leaving it out costs and saves."""

from __future__ import annotations

import textwrap
from typing import Any

from erls.auto.sizes import FAILS, UNSTABLE, EffectSize
from erls.auto.survey import Survey
from erls.mechanism.effects import EFFECTS
from erls.report.tables import table

_LARGEST = 1e12  # N: beyond, a motion means nothing
_MOST = 10.0  # times the peak


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
                "why": found.why(s) or None,
                "force": s.force if s.force < _LARGEST else None,
                "error": None if s.outcome else s.error,
                "outcome": s.outcome or None,
                "effort_error": s.effort_error,
                "share": s.share,
            }
            for s in found.sizes
        ],
        "left_out": found.left,
        "missing": list(found.missing),
        "decision": found.choice.note,
    }


def effects_text(found: Survey) -> str:
    """The table with a short explanation."""
    settings = found.scene.record.simulation
    drives = any(s.effort_error is not None for s in found.sizes)
    header = ("effect", "auto", "force [N]", "error [m]", *(("drives",) if drives else ()), "time", "kept")
    rows = [
        (
            s.name if not s.link else f"  of {s.link}",
            _state(s, found),
            f"{s.force:.2g}" if s.present and s.force < _LARGEST else "-",
            (s.outcome or f"{s.error:.2g}") if s.present else "-",
            *((_percent(None if s.outcome else s.effort_error),) if drives else ()),
            _percent(s.share),
            found.why(s),
        )
        for s in found.sizes
    ]
    lines = table(header, rows).split("\n")
    summaries = ["", *("" if s.link else EFFECTS[s.name].summary for s in found.sizes)]
    width = max(len(line) for line in lines)
    shown = "\n".join(f"{a.ljust(width)}  {b}".rstrip() for a, b in zip(lines, summaries, strict=True))
    parts = [f"{found.scene.name} ({settings.formulation}): physical effects", shown]
    if found.left:
        parts.append(_filled(f"not asked for by the scene: {', '.join(found.left)}"))
    parts += [_filled(text) for text in found.missing]
    outcomes = {s.outcome for s in found.sizes}
    parts.append(
        _filled(
            f'auto: what effects = "auto" does at a tolerance of {settings.effects_tolerance:.2g} m. force: largest '
            "generalized force, as one on all mass alike. error: largest distance of named points without the effect, "
            "in coarse runs"
            + ("; fails: no motion without it, or none that four times the work follows" if FAILS in outcomes else "")
            + ("; unstable: points leave their links" if UNSTABLE in outcomes else "")
            + (". drives: change of drive forces, relative to their peak" if drives else "")
            + ". time: part of an evaluation of the equations that leaving it out saves, with effects that share its "
            "products. kept: why; effects that save nothing, or only with others that are needed, stay on."
        )
    )
    parts.append("\n".join(_filled(line) for line in found.choice.note.split("\n")))
    return "\n\n".join(parts)


def _filled(text: str) -> str:
    return textwrap.fill(text, 116, break_on_hyphens=False)


def _state(size: EffectSize, found: Survey) -> str:
    if not size.present:
        return "not there"
    return "on" if found.keeps(size) else "off"


def _percent(value: float | None) -> str:
    if value is None:
        return "-"
    if not value < _MOST:
        return f"> {100 * _MOST:.0f} %"
    return f"{100 * value:.2g} %" if value < 0.995 else f"{100 * value:.0f} %"
