"""Warnings of motors that reach their limit and leave it again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import scenes

import erls

SWING = {"shape": "sine", "amplitude_deg": 90.0, "frequency_hz": 5.0}


def _told(folder: Path, drive: dict[str, Any], *changes: str) -> list[str]:
    scenes.l_link(folder)
    joint = {**scenes.L_SCENE["joints"][0], "drive": {"type": "pd", "motion": SWING, **drive}}
    path = scenes.l_scene(folder, joints=[joint])
    told: list[str] = []
    erls.simulate(erls.load_scene(path, ["simulation.duration=0.15", *changes]), tell=told.append)
    return [text for text in told if "reaches its limit" in text]


@pytest.mark.parametrize("lead", [False, True])
def test_a_motor_that_switches_between_its_limits_is_told_of(lead: bool, tmp_path: Path) -> None:
    """With its joint, its limit and what to do, where nobody locates when."""
    drive = {"proportional_gain": 200.0, "derivative_gain": 4.0, "torque_limit": 3.0, "feed_forward": lead}
    lobatto = ("simulation.integrator=lobatto", "simulation.tolerance=1e-2")
    (text,) = _told(tmp_path, drive, "simulation.gauge=minimum-norm", *lobatto)
    assert "its limit of 3" in text
    assert "tolerance of 0.001 m" in text


@pytest.mark.parametrize(
    ("drive", "changes"),
    [
        ({}, ("simulation.integrator=lobatto",)),
        ({"torque_limit": 1e4}, ("simulation.integrator=lobatto", "simulation.gauge=minimum-norm")),
        ({"torque_limit": 3.0}, ("simulation.integrator=lobatto",)),  # located
        ({"torque_limit": 3.0}, ("simulation.integrator=generalized_alpha", "simulation.step=1e-3")),
    ],
)
def test_others_are_not(drive: dict[str, Any], changes: tuple[str, ...], tmp_path: Path) -> None:
    """No limit, a distant one, one that is located, and fixed steps, whose error is that of the step."""
    gains = {"proportional_gain": 200.0, "derivative_gain": 4.0}
    if drive.get("torque_limit") == 1e4:
        gains = {"proportional_gain": 1.0, "derivative_gain": 0.1}
    assert _told(tmp_path, {**gains, **drive}, *changes) == []
