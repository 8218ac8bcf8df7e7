"""Reports of planned motions for the terminal."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from erls.report.tables import table
from erls.tracking.plan import Planned
from erls.tracking.plan_files import drive_lines

_HEAD = ("joint", "from", "to", "peak effort", "bound", "peak rate", "bound", "units")
_SHOWN = 6  # frequencies


def plan_text(planned: Planned, output: Path | None) -> str:
    """What was found."""
    goal, settings = planned.goal, planned.run.scene.record.simulation
    hz = ", ".join(f"{mode.omega / (2 * np.pi):.4g}" for mode in goal.modes[:_SHOWN])
    parts = [
        f"{goal.scene.name}: {', '.join(goal.names)} from rest to rest in {planned.law.duration:.4g} s "
        f"({planned.method}, {planned.passes} laws run, {planned.wall_s:.2f} s)",
        f"vibrations at the end, joints held: {hz or 'none that count'}" + (" Hz" if hz else ""),
        f"forward run ({settings.formulation}): points swing on by {1e3 * planned.swing:.3g} mm, "
        f"bound {1e3 * goal.scene.record.plan.swing:.3g} mm",
        table(_HEAD, _rows(planned)),
    ]
    if output is not None and output.suffix == ".csv":
        parts.append("As drives of a scene beside the table:\n" + "\n".join(drive_lines(planned, output)))
    return "\n\n".join(parts)


def _rows(planned: Planned) -> list[tuple[str, ...]]:
    goal = planned.goal
    units = [goal.mechanism.joints[k].freedom.units for k in goal.joints.tolist()]
    numbers = zip(
        planned.angles[0], planned.angles[-1], planned.peaks, goal.efforts, planned.rates, goal.rates, strict=True
    )
    return [
        (name, *(f"{x:.4g}" if np.isfinite(x) else "none" for x in row), f"{unit[0]}, {unit[1]}")
        for name, row, unit in zip(goal.names, numbers, units, strict=True)
    ]
