"""Identification: what was put in comes out, with intervals that mean something; what is not told is named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import ROOT

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError
from erls.identify.keys import fitted_keys
from erls.maths.so3 import Array
from erls.scene.read import load_chain

PENDULUM = """
[simulation]
duration = 2.0
[base]
rotation_deg = [90.0, 0.0, 0.0]
[[joints]]
name = "hinge"
dh = { convention = "standard", a = 0.5 }
initial = { position_deg = 20.0 }
damping = 0.05
stiffness = 3.0
[[links]]
name = "bar"
rigid = { mass = 1.0, inertia = [1e-3, 1e-2, 1e-2], points = { root = [-0.5, 0.0, 0.0], tip = [0.0, 0.0, 0.0] } }
[[points]]
name = "tip"
link = "bar"
node = "tip"
"""
NOISE = {"hinge.angle": 2e-3, "tip.z": 5e-4}


def scene(folder: Path) -> Path:
    """A pendulum with a spring."""
    path = folder / "pendulum.toml"
    path.write_text(PENDULUM, encoding="utf-8")
    return path


def record(folder: Path, path: Path, seed: int, rows: int = 200, more: str = "", **noise: float) -> Path:
    """What sensors with white noise would say of it."""
    run = erls.simulate(erls.load_chain(path), verdict=False)
    t = np.linspace(0.0, run.end, rows)
    rng, table = np.random.default_rng(seed), {k.rpartition(" [")[0]: v for k, v in run.columns(t).items()}
    columns = [table[name] + size * rng.standard_normal(rows) for name, size in (noise or NOISE).items()]
    file = folder / f"record_{seed}.csv"
    lines = [",".join(["t", *(noise or NOISE)]) + more]
    lines += [",".join(map(repr, row)) for row in np.column_stack([t, *columns]).tolist()]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


AWAY = ["joints.hinge.damping=0.08", "joints.hinge.stiffness=2.6"]
FIT = ["joints.hinge.damping,joints.hinge.stiffness"]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A fit that begins away from the truth."""
    folder = tmp_path_factory.mktemp("identify")
    path = scene(folder)
    return erls.identify(path, record(folder, path, 1), FIT, overrides=AWAY)


def test_values_come_back_within_their_intervals(found: Any) -> None:
    """Seeded noise; the fit begins half off. Noise is found to the tenth that 200 rows allow (1/√(2·200) = 5 %)."""
    for key, true in (("joints.hinge.damping", 0.05), ("joints.hinge.stiffness", 3.0)):
        one = found.parameters[key]
        assert abs(one.value - true) < 1.5 * one.half_width
        assert one.half_width < 0.05 * true
    noise = {name.rpartition(" [")[0]: column.noise for name, column in found.columns.items()}
    for name, true in NOISE.items():
        assert noise[name] == pytest.approx(true, rel=0.15)
    assert found.not_told == ()
    assert found.warnings == ()


def test_intervals_are_those_of_the_cramer_rao_bound(found: Any, tmp_path: Path) -> None:
    """Which differences of runs give: (Σ gᵀ g / σ²)⁻¹ at the truth, to the scatter of what was found (noise to 5 %)."""
    path = scene(tmp_path)
    t = np.linspace(0.0, 2.0, 200)

    def columns(changes: list[str]) -> Array:
        run = erls.simulate(erls.load_chain(path, ["simulation.tolerance=1e-8", *changes]), verdict=False)
        return np.concatenate([run.joint_angle("hinge", t) / 2e-3, run.position("tip", t)[:, 2] / 5e-4])

    slopes = []
    for key, value in (("damping", 0.05), ("stiffness", 3.0)):
        step = 1e-3 * value
        ends = [columns([f"joints.hinge.{key}={value + side * step!r}"]) for side in (-1, 1)]
        slopes.append((ends[1] - ends[0]) / (2 * step))
    bound = np.sqrt(np.diag(np.linalg.inv(np.array(slopes) @ np.array(slopes).T)))
    widths = [one.half_width / 1.966 for one in found.parameters.values()]  # Student's, 398 rows too many
    np.testing.assert_allclose(widths, bound, rtol=0.15)


def test_a_record_without_noise_gives_the_truth(tmp_path: Path) -> None:
    """To the rounding of the table."""
    path = scene(tmp_path)
    clean = record(tmp_path, path, 2, 60, **{"hinge.angle": 0.0, "tip.z": 0.0})
    exact = erls.identify(path, clean, FIT, overrides=[*AWAY, "simulation.tolerance=1e-7"])
    assert exact.parameters["joints.hinge.stiffness"].value == pytest.approx(3.0, rel=1e-5)
    assert exact.parameters["joints.hinge.damping"].value == pytest.approx(0.05, rel=1e-4)


def test_what_cannot_be_told_is_named(tmp_path: Path) -> None:
    """Two masses on one point: their sum alone moves it. The others keep their intervals."""
    path = scene(tmp_path)
    masses = ['payloads=[{point="tip",mass=0.1},{point="tip",mass=0.2}]']
    run = erls.simulate(erls.load_chain(path, masses), verdict=False)
    t = np.linspace(0.0, run.end, 100)
    angle = run.joint_angle("hinge", t) + 1e-3 * np.random.default_rng(3).standard_normal(100)
    file = tmp_path / "r.csv"
    rows = np.column_stack([t, angle]).tolist()
    file.write_text("t,hinge.angle\n" + "\n".join(f"{a!r},{b!r}" for a, b in rows) + "\n", encoding="utf-8")
    found = erls.identify(path, file, ["payloads.0.mass", "payloads.1.mass", "joints.hinge.damping"], overrides=masses)
    assert found.not_told == (("payloads.0.mass", "payloads.1.mass"),)
    assert found.parameters["payloads.0.mass"].half_width is None
    assert found.parameters["payloads.0.mass"].value + found.parameters["payloads.1.mass"].value == pytest.approx(
        0.3, rel=0.05
    )
    damping = found.parameters["joints.hinge.damping"]
    assert damping.half_width is not None
    assert abs(damping.value - 0.05) < 2 * damping.half_width


def test_a_model_that_lacks_something_is_told(tmp_path: Path) -> None:
    """Friction in the record, none in the model: what is left is no noise."""
    path = scene(tmp_path)
    rough = tmp_path / "rough.toml"
    rough.write_text(PENDULUM.replace("damping = 0.05", "friction = { force = 0.2 }\ndamping = 0.05"), encoding="utf-8")
    found = erls.identify(path, record(tmp_path, rough, 4, 100, **{"hinge.angle": 5e-4}), ["joints.hinge.damping"])
    assert any("no white noise" in text for text in found.warnings)


def test_patterns_name_all_that_fit(tmp_path: Path) -> None:
    """Numbers that are not zero."""
    loaded = load_chain(ROOT / "data/robot/flexible_joint.toml")
    assert fitted_keys(loaded, ["joints.*.damping"]) == ["joints.motor.damping", "joints.gear.damping"]
    assert fitted_keys(loaded, ["payloads.0.mass, joints.g*.stiffness"]) == ["payloads.0.mass", "joints.gear.stiffness"]
    for asked, cause in ((["joints.*.mass"], Cause.BAD_REFERENCE), (["a,a"], Cause.BAD_FIELD), ([], Cause.BAD_FIELD)):
        with pytest.raises(SceneError) as refused:
            fitted_keys(loaded, asked)
        assert refused.value.cause == cause


def test_the_command_reports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """JSON, page, bounds; bad input is one line."""
    path = scene(tmp_path)
    file, page = record(tmp_path, path, 5, 60), tmp_path / "fit.html"
    command = ["identify", str(path), "--measured", str(file), "--fit", "joints.hinge.stiffness"]
    command += ["--set", AWAY[1]]
    assert main([*command, "-o", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["parameters"]["joints.hinge.stiffness"]["value"] == pytest.approx(3.0, rel=0.02)
    assert "joints.hinge.stiffness" in page.read_text(encoding="utf-8")
    assert main([*command, "--bounds", "joints.hinge.stiffness=2.5:2.8"]) == 0
    assert "stopped at a bound" in capsys.readouterr().out
    faults = {
        "--bounds": [*command, "--bounds", "joints.hinge.stiffness=3"],
        "below the upper": [*command, "--bounds", "joints.hinge.stiffness=3:1"],
        "not between": [*command, "--bounds", "joints.hinge.stiffness=2.7:3.5"],
        "--fit": command[:4],
        "no such file": [*command[:3], str(tmp_path / "none.csv"), *command[4:]],
        "begin at zero": [*command[:4], "--fit", "joints.hinge.rest", "--set", "joints.hinge.rest=0.0"],
    }
    for words, arguments in faults.items():
        assert main(arguments) == 2, words
        assert words in capsys.readouterr().err


def test_feed_forward_of_what_is_fitted_is_refused(tmp_path: Path) -> None:
    """A controller that an inversion leads would follow the parameters."""
    file = tmp_path / "measured.csv"
    file.write_text("t,hub.angle\n0,0\n1,0\n", encoding="utf-8")
    with pytest.raises(SceneError, match="would follow what is fitted"):
        erls.identify(ROOT / "data/inverse/led_arm.toml", file, ["joints.hub.damping"])
