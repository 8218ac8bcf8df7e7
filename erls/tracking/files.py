"""Results of an inversion: the table of drives and motions, and the JSON of ``erls invert``."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.inverse.inversion import Inversion
from erls.maths.so3 import Array
from erls.tracking.confirm import Confirmation


def columns(inversion: Inversion) -> dict[str, Array]:
    """Of the table: times, efforts, those of rigid links, joint coordinates, what is demanded, elastic displacement."""
    servoed = inversion.problem.flexible
    units = {joint.name: joint.freedom.units for joint in servoed.tree.mechanism.joints}
    found = {"t [s]": inversion.t}
    found |= {f"{name}.inverse_effort [{units[name][1]}]": x for name, x in inversion.efforts.items()}
    found |= {f"{name}.rigid_effort [{units[name][1]}]": x for name, x in _cut(inversion).items()}
    found |= {f"{name}.angle [{units[name][0]}]": x for name, x in inversion.angles.items()}
    demand = inversion.problem.conditions.demand(inversion.t)
    for k, each in enumerate(inversion.problem.conditions.every):
        found[f"{each.name} demanded [{each.unit}]"] = demand.value[:, k]
    found["deflection [m]"] = inversion.deflection
    return found


def _cut(inversion: Inversion) -> dict[str, Array]:
    return {name: x[: len(inversion.t)] for name, x in inversion.rigid_efforts.items()}


def summary(inversion: Inversion, elastic: Confirmation | None, rigid: Confirmation | None) -> dict[str, Any]:
    """The JSON of ``erls invert``; errors are None where no run was made, or no point is demanded."""
    nature, points = inversion.nature, bool(inversion.problem.conditions.points)
    return {
        "scene": inversion.problem.scene.name,
        "method": inversion.method,
        "minimum_phase": nature.minimum_phase,
        "conditions": [{"name": each.name, "unit": each.unit} for each in inversion.problem.conditions.every],
        "forward_error": elastic.error if elastic is not None and points else None,
        "rigid_forward_error": rigid.error if rigid is not None and points else None,
        "forward_misses": None if elastic is None else elastic.largest,
        "rigid_forward_misses": None if rigid is None else rigid.largest,
        "forward_formulation": None if elastic is None else elastic.run.scene.record.simulation.formulation,
        "peak_efforts": _peaks(inversion.efforts),
        "rigid_peak_efforts": _peaks(_cut(inversion)),
        "pre_actuation_s": inversion.pre_actuation(),
        "zeros": [[zero.real, zero.imag] for zero in nature.zeros.tolist()],
        "fast_from_hz": nature.limit / (2 * np.pi),
        "start": inversion.start,
        "deflection": float(inversion.deflection.max(initial=0.0)),
        "fast_left": inversion.left,
        "steps": len(inversion.t) - 1,
        "iterations": inversion.iterations,
        "wall_s": inversion.wall_s,
        "warnings": list(inversion.warnings),
    }


def _peaks(efforts: dict[str, Array]) -> dict[str, float]:
    return {name: float(np.abs(x).max(initial=0.0)) for name, x in efforts.items()}
