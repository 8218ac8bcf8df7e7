"""Exact sticking and limited motors in nodal scenes: closed forms, the other formulations, closing joints."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from test_limited_motors import DRIVE, END, GOAL, bang_bang, places
from test_sticking import FORCE, OMEGA, START, STIFFNESS, arm, block_on_spring, sliding, switches
from test_sticking_loops import INERTIA, LEVEL, on_spring, parallelogram, pin, run_scene, stick

import erls

NODAL: dict[str, Any] = {"formulation": "nodal", "integrator": "generalized_alpha"}


@pytest.mark.parametrize("settings", [{"step": 2e-4}, {"integrator": "auto", "tolerance": 1e-6}])
def test_block_on_a_spring(settings: dict[str, Any], tmp_path: Path) -> None:
    """Places to 1e-6 m, times of rest to 1e-6 s, and the stated error holds."""
    joint = {"stiffness": STIFFNESS, "initial": {"position": START}}
    run = sliding(tmp_path, {"force": FORCE}, joint, **{**NODAL, **settings})
    times = np.linspace(0.0, run.end, 151)
    off = float(np.abs(run.position("block", times)[:, 2] - [block_on_spring(t)[0] for t in times.tolist()]).max())
    assert off < 1e-6
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off <= run.accuracy.integration
    found = switches(run)
    assert found == pytest.approx([math.pi / OMEGA * k for k in (1, 2, 3)], abs=1e-6)
    assert not run.joint_rate("slide", np.linspace(found[-1], run.end, 7)).any()
    before, after = run.joint_effort("slide", [0.1, 1.0])
    assert before == pytest.approx(-STIFFNESS * block_on_spring(0.1)[0] + FORCE, abs=1e-4)
    assert after == pytest.approx(0.0, abs=1e-6)


def test_block_behind_a_spring_that_is_pulled(tmp_path: Path) -> None:
    """It breaks away where the spring pulls by the static force, and rests for as long as in the closed form."""
    static, pull = 5.0, 0.05
    motion = {"shape": "spin_up", "rate": pull, "duration": 0.02}
    drive = {"type": "pd", "proportional_gain": STIFFNESS, "derivative_gain": 0.0, "motion": motion}
    friction = {"force": FORCE, "static_force": static}
    run = sliding(tmp_path, friction, {"drive": drive}, duration=1.1, step=2e-4, **NODAL)
    first = static / (STIFFNESS * pull) + 0.01
    slides = (2 * math.pi - 2 * math.atan((static - FORCE) * OMEGA / (STIFFNESS * pull))) / OMEGA
    rests = 2 * (static - FORCE) / (STIFFNESS * pull)
    expected = np.cumsum([first, *[slides, rests] * 3])
    found = [t for t in switches(run) if t > 0.03]
    assert found == pytest.approx(expected[expected < run.end], abs=1e-6)
    assert len(found) >= 2


def test_four_bar_comes_to_rest(tmp_path: Path) -> None:
    """Four joints of a linkage with one coordinate: one of them is held, the others rest with it."""
    spring, rub = 40.0, 0.12
    rubs = {"friction": stick(rub)}
    crank, force = {"stiffness": spring, "rest": LEVEL, **rubs}, 4 * rub
    settings = {"duration": 0.9, "step": 1e-3, **NODAL}
    run = run_scene(tmp_path, {**parallelogram(crank, rubs, rubs, LEVEL + 0.07), "simulation": settings})
    times = np.linspace(0.0, run.end, 101)
    omega = math.sqrt(spring / INERTIA)
    exact = LEVEL + np.array([on_spring(t, 0.07, force / spring, omega) for t in times.tolist()])
    off = float(np.abs(run.position("pin", times) - pin(exact)).max())
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off <= run.accuracy.integration < 1e-4
    found = switches(run)
    assert found == pytest.approx([math.pi / omega * (k + 1) for k in range(len(found))], abs=3e-5)  # steps of 1 ms
    assert len(found) >= 2
    rest = np.linspace(found[-1], run.end, 5)
    assert np.ptp(run.position("pin", rest), axis=0).max() < 1e-10
    assert all(not run.joint_rate(f"j{k}", rest).any() for k in range(3))


def test_linkage_under_its_limit(tmp_path: Path) -> None:
    """A motor where the linkage closes."""
    closing = {"drive": {**DRIVE, "motion": {**DRIVE["motion"], "values": [GOAL] * 4}}}
    settings = {"duration": END, "step": 5e-4, **NODAL}
    data = {**parallelogram({}, {}, closing, LEVEL - GOAL), "simulation": settings}
    run = run_scene(tmp_path, data, False)
    pieces = bang_bang(INERTIA, -GOAL)
    times = np.linspace(0.0, END, 101)
    assert np.abs(run.position("pin", times) - pin(LEVEL + places(pieces, times))).max() < 2e-5  # second order
    assert switches(run) == pytest.approx([piece.start for piece in pieces[1:]], abs=2e-5)


def test_flexible_arm(tmp_path: Path) -> None:
    """Beams against modes that hold all that these steps see: both joints stick and slide."""
    first = {"friction": stick(1.5), "initial": {"position_deg": 60.0}}
    second = {"friction": stick(0.3, 0.4), "initial": {"rate": 4.0}}
    swing = {
        "joints": [
            {"name": "first", "dh": {"convention": "modified"}, **first},
            {"name": "second", "dh": {"convention": "modified", "a": 0.5}, **second},
        ],
    }
    ends = {}
    for name, settings in {"erls": {"tolerance": 1e-4}, "nodal": {**NODAL, "step": 5e-4}}.items():
        path = arm(tmp_path, (1.5, 0.3), True, simulation={"duration": 0.25, **settings}, **swing)
        scenes.arm_link(tmp_path)
        run = erls.simulate(erls.load_scene(path), verdict=False)
        times = np.linspace(0.0, 0.25, 51)
        ends[name] = run.position("end", times)
        looks = np.linspace(0.0, 0.25, 501)
        resting = [float(np.mean(run.joint_rate(joint, looks) == 0)) for joint in ("first", "second")]
        assert all(0.02 < share < 0.9 for share in resting), (name, resting)
    moved = float(np.ptp(ends["erls"], axis=0).max())
    assert np.abs(ends["nodal"] - ends["erls"]).max() < 2e-3 * moved


def test_small_motions_leave_out_what_sticks(tmp_path: Path) -> None:
    """As many poles as in independent coordinates, where one joint sticks, and where it slides."""
    joints = [
        {"name": "first", "dh": {"convention": "modified"}, "friction": {}},
        {"name": "second", "dh": {"convention": "modified", "a": 1.0}, "stiffness": 50.0},
    ]
    joints[1]["initial"] = {"position_deg": 90.0}
    for force in (200.0, 20.0):
        joints[0]["friction"] = stick(force)
        poles = {}
        for formulation in ("erls", "nodal"):
            settings = {"formulation": formulation, "integrator": "auto"}
            path = arm(tmp_path, (force, 1.0), simulation=settings, joints=joints)
            poles[formulation] = np.sort_complex(erls.linearize(erls.load_scene(path)).poles)
        assert poles["nodal"] == pytest.approx(poles["erls"], abs=1e-5)
        assert len(poles["erls"]) == (2 if force == 200.0 else 4)
