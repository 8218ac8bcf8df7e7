"""Results of planning: the table of a motion, and the JSON of ``erls plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from erls.maths.so3 import Array
from erls.tracking.plan import Planned


def columns(planned: Planned) -> dict[str, Array]:
    """Of the table: times, coordinates of the planned joints, then their rates and the efforts of the forward run."""
    goal, law = planned.goal, planned.law
    units = [goal.mechanism.joints[k].freedom.units for k in goal.joints.tolist()]
    rates = np.outer(law.rate, goal.moved)
    found = {"t [s]": planned.t}
    for name, unit, angle in zip(goal.names, units, planned.angles.T, strict=True):
        found[f"{name}.angle [{unit[0]}]"] = angle
    for name, unit, rate, effort in zip(goal.names, units, rates.T, planned.efforts.T, strict=True):
        found |= {f"{name}.rate [{unit[0]}/s]": rate, f"{name}.planned_effort [{unit[1]}]": effort}
    return found


def drive_lines(planned: Planned, table_file: Path) -> list[str]:
    """``drive`` of each joint, as a scene beside the table takes it."""
    shape = f'shape = "table", file = "{table_file.name}", column = {{}}'
    names = enumerate(planned.goal.names, start=1)
    return [f'{name}: drive = {{ type = "motion", motion = {{ {shape.format(k)} }} }}' for k, name in names]


def summary(planned: Planned) -> dict[str, Any]:
    """The JSON of ``erls plan``; bounds are None where there are none."""
    goal = planned.goal
    first, last = planned.angles[0], planned.angles[-1]
    return {
        "scene": goal.scene.name,
        "method": planned.method,
        "start": float(planned.t[0]),
        "duration": planned.law.duration,
        "kept": planned.kept,
        "joints": {
            name: {
                "from": float(first[k]),
                "to": float(last[k]),
                "peak_effort": float(planned.peaks[k]),
                "effort_limit": _bound(goal.efforts[k]),
                "peak_rate": float(planned.rates[k]),
                "rate_limit": _bound(goal.rates[k]),
            }
            for k, name in enumerate(goal.names)
        },
        "swing": planned.swing,
        "swing_limit": goal.scene.record.plan.swing,
        "vibrations_hz": [mode.omega / (2 * np.pi) for mode in goal.modes],
        "forward_formulation": planned.run.scene.record.simulation.formulation,
        "passes": planned.passes,
        "wall_s": planned.wall_s,
    }


def _bound(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
