"""Sensors of scenes that tests vary: one of each type, and what is said of one that is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import erls
from erls.errors import Cause, ReportedError

FORCES = ["N [N]", "Vy [N]", "Vz [N]", "T [N m]", "My [N m]", "Mz [N m]"]

# of each type: its fields, and the heads of its columns
KINDS: dict[str, tuple[dict[str, Any], list[str]]] = {
    "position": ({"point": "tip"}, ["s.x [m]", "s.y [m]", "s.z [m]"]),
    "velocity": ({"point": "tip", "direction": [0, 0, 2]}, ["s [m/s]"]),
    "accelerometer": ({"point": "tip", "axes": "link"}, ["s.x [m/s2]", "s.y [m/s2]", "s.z [m/s2]"]),
    "gyroscope": ({"point": "tip"}, ["s.x [rad/s]", "s.y [rad/s]", "s.z [rad/s]"]),
    "strain_gauge": ({"point": "tip", "offset": [0.0, 0.005, 0.0]}, ["s [1]"]),
    "section_force": ({"point": "tip"}, [f"s.{c}" for c in FORCES]),
    "stress": ({"point": "tip", "component": "von_mises"}, ["s [Pa]"]),
    "joint_angle": ({"joint": "shoulder"}, ["s [rad]"]),
    "joint_rate": ({"joint": "shoulder"}, ["s [rad/s]"]),
    "effort": ({"joint": "shoulder", "side": "motor"}, ["s [N m]"]),
}  # fmt: skip
ENDS = {"recovery": {"nodes": ["root", "tip"]}}


def sensor(kind: str, **more: Any) -> dict[str, Any]:
    """One of `KINDS`, as a table of a scene."""
    return {"name": "s", "type": kind, **KINDS[kind][0], **more}


def refused(path: Path, changes: list[str]) -> str:
    """What is said of a scene that is not run."""
    with pytest.raises(ReportedError) as caught:
        erls.simulate(erls.load_scene(path, changes), verdict=False)
    assert caught.value.exit_code == 2
    assert str(caught.value.cause) in {str(Cause.BAD_FIELD), str(Cause.BAD_REFERENCE)}
    return str(caught.value)
