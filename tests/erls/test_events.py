"""Events: crossings at their closed-form times, whatever the formulation; runs that end there; refused scenes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.cli.main import main
from erls.errors import SceneError
from erls.run.file import load_run, save_run

SPRING, LENGTH = 40.0, 0.1
FOUR_BAR = scenes.ROOT / "data/four_bar/flexible.toml"


def slide(folder: Path, *events: dict[str, Any], **settings: Any) -> Path:
    """A rigid arm on a horizontal slide with a spring, released from 0.1 m: s = 0.1 cos ωt."""
    scenes.arm_link(folder)
    joint = {
        "name": "slide",
        "type": "prismatic",
        "dh": {"convention": "standard"},
        "stiffness": SPRING,
        "initial": {"position": LENGTH},
    }
    data = {
        "simulation": {"duration": 1.0, **settings},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": [joint],
        "links": [{"name": "arm", "model": "arm.toml", "flexible": False, "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "arm", "node": "tip"}],
        "events": list(events),
    }
    return scenes.write_toml(folder / "slide.toml", data)


def omega(run: erls.Run) -> float:
    """Frequency of the slide [rad/s]."""
    mass = run.formulation.mechanism.links[0].invariants.rigid_mass_matrix[0, 0]
    return float(np.sqrt(SPRING / mass))


@pytest.mark.parametrize("settings", [{"step": 1e-3}, {"tolerance": 1e-6}, {"formulation": "ffr", "step": 1e-3}])
def test_crossings_of_a_cosine(tmp_path: Path, settings: dict[str, Any]) -> None:
    """cos ωt = 1/2 at ±π/3; the rate's zeros; to the error of second order of the steps, (ω h)²/12 of the time."""
    half = {"joint": "slide", "coordinate": "angle", "value": LENGTH / 2}
    scene = slide(
        tmp_path,
        {"name": "both", **half},
        {"name": "down", "direction": "falling", **half},
        {"name": "turn", "joint": "slide", "coordinate": "rate", "value": 0.0},
        **settings,
    )
    run = erls.simulate(scene, verdict=False)
    w = omega(run)
    found = {name: [(h.time, h.rising) for h in run.events if h.name == name] for name in ("both", "down", "turn")}
    every = sorted(t for k in range(9) for t in (2 * np.pi * k + np.pi / 3, 2 * np.pi * (k + 1) - np.pi / 3))
    expected = [t / w for t in every if t / w < 1]
    assert len(expected) >= 3
    tolerance = 2 * (w * 1e-3) ** 2
    np.testing.assert_allclose([t for t, _ in found["both"]], expected, atol=tolerance)
    assert [rising for _, rising in found["both"]] == [k % 2 == 1 for k in range(len(expected))]
    assert [t for t, _ in found["down"]] == [t for t, rising in found["both"] if not rising]
    np.testing.assert_allclose([t for t, _ in found["turn"]], np.arange(1, len(found["turn"]) + 1) * np.pi / w,
                               atol=tolerance)  # fmt: skip
    assert [h.time for h in run.events] == sorted(h.time for h in run.events)
    assert run.joint_angle("slide", found["down"][0][0]) == pytest.approx(LENGTH / 2, abs=1e-12)


@pytest.mark.parametrize("settings", [{"step": 1e-3}, {}, {"step": 1e-3, "output_step": 0.01}])
def test_a_run_ends_at_an_event(tmp_path: Path, settings: dict[str, Any]) -> None:
    """In the step in which it happens; what was computed up to there is that of the whole run."""
    event = {"name": "middle", "joint": "slide", "coordinate": "angle", "value": 0.0, "stop": True}
    told: list[str] = []
    run = erls.simulate(erls.load_scene(slide(tmp_path, event, **settings)), tell=told.append, verdict=False)
    assert run.failure is None
    (happening,) = run.events
    assert happening.time == pytest.approx(np.pi / 2 / omega(run), rel=1e-4)
    assert happening.time <= run.end <= happening.time + 0.05
    assert run.joint_angle("slide", happening.time) == pytest.approx(0.0, abs=1e-10)
    assert any("event 'middle' at t = " in text for text in told)
    whole = erls.simulate(erls.load_scene(slide(tmp_path, **settings)), verdict=False)
    times = np.linspace(0, happening.time, 5)
    np.testing.assert_allclose(run.position("tip", times), whole.position("tip", times), atol=1e-9)
    assert run.summary()["events"] == [{"name": "middle", "time": happening.time, "rising": False}]
    save_run(tmp_path / "r.h5", run)
    assert load_run(tmp_path / "r.h5").events == run.events


def test_other_formulations_and_loops() -> None:
    """A flexible L, nodal, and a closed loop stop at a height of a point."""
    event = '[{name="low", point="%s", coordinate="%s", value=%s, stop=true}]'
    for scene, change, point, axis, value in (
        (scenes.ROOT / "data/l_shape/steel_flat.toml", "simulation.formulation=nodal", "tip", "z", -0.002),
        (scenes.ROOT / "data/l_shape/steel_flat.toml", "simulation.formulation=erls", "tip", "z", -0.01),
        (FOUR_BAR, "simulation.duration=0.2", "", "", 0.0),
    ):
        if not point:
            loaded = erls.load_scene(scene, [change])
            whole = erls.simulate(loaded, verdict=False)
            point, axis = whole.point_names[0], "x"
            value = float(whole.position(point, 0.1)[0])
        run = erls.simulate(erls.load_scene(scene, [change, f"events={event % (point, axis, value)}"]), verdict=False)
        assert run.failure is None
        assert 0 < run.events[0].time <= run.end < 0.25
        assert run.position(point, run.events[0].time)["xyz".index(axis)] == pytest.approx(value, abs=1e-9)


def test_the_command_line_tells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    event = {"name": "middle", "joint": "slide", "coordinate": "angle", "value": 0.0, "stop": True}
    scene = str(slide(tmp_path, event))
    assert main(["simulate", scene]) == 0
    assert "event 'middle' at t = " in capsys.readouterr().out
    assert main(["simulate", scene, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["events"][0]["name"] == "middle"


GOOD = {"name": "e", "joint": "slide", "coordinate": "angle", "value": 0.0}
BAD = [
    ({"point": "tip"}, "exactly one of 'joint' and 'point'"),
    ({"joint": "slid"}, "slide"),
    ({"coordinate": "x"}, "angle"),
    ({"direction": "up"}, "rising"),
    ({"value_deg": 3.0}, "exactly one of 'value'"),
    ({"value": float("inf")}, "finite"),
]


@pytest.mark.parametrize(("change", "words"), BAD, ids=[words for _, words in BAD])
def test_events_that_cannot_be_meant(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words) as caught:
        erls.load_scene(slide(tmp_path, {**GOOD, **change}))
    assert "events[0]" in str(caught.value)


def test_degrees_are_of_revolute_joints(tmp_path: Path) -> None:
    event = {"name": "e", "joint": "slide", "coordinate": "angle", "value_deg": 10.0}
    with pytest.raises(SceneError, match="revolute"):
        erls.load_scene(slide(tmp_path, event))
    with pytest.raises(SceneError, match="events"):
        erls.load_scene(slide(tmp_path, GOOD, GOOD))
