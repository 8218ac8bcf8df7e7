"""Redundant connections: found, named, left out, their forces the smallest; special positions told from redundancy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from body_scenes_data import STRIP, body_scene

from erls import simulate
from erls.cli.main import main
from erls.errors import Cause, SimulationError
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest

BEND = np.radians(30.0)


def _body(name: str, position: list[float], **more: Any) -> dict[str, Any]:
    return {"name": name, "mass": 1.0, "inertia": [0.1, 0.1, 0.1], "position": position, **more}


def _shafts() -> dict[str, Any]:
    """Two shafts at 30°, joined by a universal joint at the origin; the first one turns as prescribed."""
    out = [float(np.cos(BEND)), float(np.sin(BEND)), 0.0]
    turn = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 150.0, "duration": 0.4}
    return {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"type": "dynamics", "duration": 0.4, "step": 2e-3},
        "bodies": [_body("in", [-1.0, 0.0, 0.0]), _body("out", out)],
        "connections": [
            {"name": "first", "type": "revolute", "node": "in", "axis": [1, 0, 0], "motion": turn},
            {"name": "cross", "type": "universal", "node": "out", "to": "in", "position": [0, 0, 0],
             "axis": [0, 0, 1], "second_axis": [-out[1], out[0], 0.0]},
            {"name": "second", "type": "revolute", "node": "out", "axis": out},
        ],
    }  # fmt: skip


def test_hookes_joint(tmp_path: Path) -> None:
    """Twelve freedoms, fifteen conditions, of which three follow; tan α₂ = tan α₁ cos 30°."""
    found = simulate(body_scene(tmp_path, _shafts()))
    assert isinstance(found, BodyMotion)
    assert len(found.assembly.left_out) == 3
    (warning,) = found.warnings
    assert "3 conditions follow from the others" in warning
    assert found.assembly.left_out[0] in warning
    y = found.solution.y.reshape(len(found.solution.t), 2, 12)[:, :, 3:].reshape(-1, 2, 3, 3)
    first = np.unwrap(np.arctan2(y[:, 0, 2, 1], y[:, 0, 1, 1]))
    out = np.array([np.cos(BEND), np.sin(BEND), 0.0])
    across = np.array([-out[1], out[0], 0.0])
    carried = y[:, 1] @ across
    second = np.unwrap(np.arctan2(carried[:, 2], carried @ across))
    assert first[-1] == pytest.approx(np.radians(150.0), abs=1e-6)
    middle = np.abs(first - np.radians(60)).argmin()
    expected = np.arctan(np.tan(first[middle]) * np.cos(BEND))
    assert second[middle] == pytest.approx(expected, abs=1e-5)
    assert second[middle] != pytest.approx(first[middle], abs=1e-2)


def test_three_bearings_share_the_load(tmp_path: Path) -> None:
    """A rigid bar on two equal hinges: each carries half of the weight, and no couple."""
    scene = {
        "simulation": {"type": "dynamics", "duration": 0.02, "step": 1e-3},
        "bodies": [_body("bar", [0.0, 0.0, 0.0])],
        "connections": [
            {"name": name, "type": "revolute", "node": "bar", "axis": [1, 0, 0], "position": [x, 0, 0]}
            for name, x in (("left", -1.0), ("right", 1.0))
        ],
    }
    found = simulate(body_scene(tmp_path, scene))
    assert isinstance(found, BodyMotion)
    assert len(found.assembly.left_out) == 5
    forces = found.samples([0.01])[0]["connections"]
    np.testing.assert_allclose(forces["left"]["force"], [0, 0, 9.81 / 2], atol=1e-9)
    np.testing.assert_allclose(forces["right"]["force"], [0, 0, 9.81 / 2], atol=1e-9)


def test_statics_and_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A clamp given twice carries half each; the warning goes to stderr and into the JSON."""
    clamps = [{**STRIP["connections"][0], "name": name} for name in ("one", "two")]
    path = body_scene(tmp_path, STRIP, connections=clamps)
    found = simulate(path)
    assert isinstance(found, BodyRest)
    single = simulate(body_scene(tmp_path, STRIP))
    assert isinstance(single, BodyRest)
    np.testing.assert_allclose(found.position("tip", 1.0), single.position("tip", 1.0), atol=1e-12)
    path = body_scene(tmp_path, STRIP, connections=clamps)
    assert main(["simulate", str(path), "--json"]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    for name in ("one", "two"):
        np.testing.assert_allclose(summary["samples"][0]["connections"][name]["force"], [0, 0, -5e-4], atol=1e-12)
    assert "6 conditions follow from the others" in summary["warnings"][0]
    assert "warning: 6 conditions" in err


def test_a_special_position_is_no_redundancy(tmp_path: Path) -> None:
    """A rod stretched out between two fixed pins could not move; built bent it is found to be more than redundant."""
    rods = [_body("a", [0.5, 0.0, 0.0]), _body("b", [1.5, 0.0, 0.0])]
    connections = [
        {"name": "left", "type": "revolute", "node": "a", "axis": [0, 1, 0], "position": [0, 0, 0]},
        {"name": "middle", "type": "revolute", "node": "b", "to": "a", "axis": [0, 1, 0], "position": [1, 0, 0]},
        {"name": "right", "type": "revolute", "node": "b", "axis": [0, 1, 0], "position": [2, 0, 0]},
    ]
    scene = {"simulation": {"type": "dynamics", "duration": 0.2, "step": 2e-3}, "bodies": rods}
    with pytest.raises(SimulationError) as caught:
        simulate(body_scene(tmp_path, scene, connections=connections))
    assert caught.value.cause is Cause.REDUNDANT_CONSTRAINTS
    assert "as built" in str(caught.value)
