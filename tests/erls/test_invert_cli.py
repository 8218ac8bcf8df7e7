"""The command ``erls invert``: what it prints and writes, and that scenes take its tables as they are."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import scenes

import erls
from erls.cli.main import main

PASSIVE = scenes.ROOT / "data" / "inverse" / "passive_arm.toml"
QUICK = ("--set", "simulation.step=0.01")


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A copy that may be changed."""
    return Path(shutil.copy(PASSIVE, tmp_path / "arm.toml"))


def told(capsys: pytest.CaptureFixture[str], *words: Any, code: int = 0) -> tuple[str, str]:
    """Stdout and stderr."""
    assert main(["invert", *map(str, words)]) == code
    found = capsys.readouterr()
    return found.out, found.err


def test_a_scene_takes_the_table_as_it_is(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The drive that is printed, put into the scene, gives the forward run: both miss the same."""
    out, _ = told(capsys, arm, "-o", arm.with_name("drives.csv"), *QUICK)
    line = next(text for text in out.splitlines() if text.startswith("hub: initial"))
    text = arm.read_text(encoding="utf-8")
    drive = 'drive = { type = "torque", profiles = [{ shape = "constant", value = 0.0 }] }'
    arm.write_text(text.replace(drive, line.removeprefix("hub: ").replace(" }, drive", " }\ndrive")), encoding="utf-8")
    run: Any = erls.simulate(erls.load_scene(arm, ["simulation.step=0.0025"]), verdict=False)
    turned = run.joint_angle("hub", 2.9) + run.joint_angle("passive", 2.9) / 2
    assert turned == pytest.approx(3.141592653589793 / 3, abs=2e-5)


def test_json_and_files(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All keys of the design; the same in a file; a table is replaced by a table, and by nothing else."""
    table = arm.with_name("drives.csv")
    out, _ = told(capsys, arm, "--json", "-o", table, *QUICK)
    found = json.loads(out)
    expected = "forward_error rigid_forward_error peak_efforts pre_actuation_s zeros steps iterations wall_s output"
    assert set(expected.split()) <= set(found)
    assert found["forward_error"] is None  # no point is demanded
    assert found["forward_misses"][0] < 2e-5 < 0.01 < found["rigid_forward_misses"][0]
    assert sorted(round(re, 1) for re, _ in found["zeros"]) == [-23.0, 26.0]
    assert (found["steps"], found["output"]) == (290, str(table))
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    assert head.startswith("t [s],hub.inverse_effort [N m],hub.rigid_effort [N m],hub.angle [rad],passive.angle [rad]")
    assert len(rows) == 291
    told(capsys, arm, "-o", table, "--confirm", "none", *QUICK)
    page = arm.with_name("page.html")
    told(capsys, arm, "-o", page, *QUICK)
    assert "What forward runs miss" in page.read_text(encoding="utf-8")
    other = arm.with_name("mine.csv")
    other.write_text("a,b\n1,2\n", encoding="utf-8")
    _, err = told(capsys, arm, "-o", other, *QUICK, code=2)
    assert "--force" in err


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["--method", "guess"], "collocation"),
        (["--confirm", "rigid"], "nodal"),
        (["-o", "drives.txt"], ".csv"),
        (["--set", "simulation.gauge=minimum-norm"], "gauge"),
        (["--set", "simulation.bandwidth=100.0"], "bandwidth"),
        (["--set", "simulation.effects=auto"], "effects"),
        (["--set", "joints.1.friction={ force = 0.1, law = 'stick' }"], "passive"),
        (["--set", "joints.1.stops={ upper_deg = 20.0, stiffness = 1e3, restitution = 0.5 }"], "passive"),
        (["--set", "servo.0.motion.duration=0.0"], "servo[0].motion.duration"),
    ],
)
def test_what_cannot_be_inverted_is_refused(
    arm: Path, words: list[str], names: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """One message, exit code 2."""
    _, err = told(capsys, arm, *words, code=2)
    assert names in err
    assert "Traceback" not in err


def test_a_motion_cut_off_is_told(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Little room before the motion, and a motion that is not over."""
    short = ["--set", "servo.0.motion.start=0.1", "--set", "simulation.duration=1.2", "--confirm", "none"]
    _, err = told(capsys, arm, *short, *QUICK)
    assert "only 0.1 s before the motion" in err
    assert "moves at the end of the run" in err
    assert "jumps" not in err
    _, err = told(capsys, arm, "--set", "servo.0.motion.degree=3", "--confirm", "none", *QUICK)
    assert "jumps at t = 0.7 s" in err


def test_corrections_that_do_not_help_are_told(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 4, with the best that there was: what is cut off before the motion, nothing brings back."""
    little = ["--set", "servo.0.motion.start=0.05", "--set", "simulation.tolerance=1e-9", *QUICK]
    out, err = told(capsys, arm, "--correct", "--json", *little, code=4)
    assert json.loads(out)["forward_misses"][0] > 1e-9
    assert "do not bring the forward run to simulation.tolerance" in err
    told(capsys, arm, "--correct", "--confirm", "none", code=2)


def test_what_has_no_mass_is_named(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A passive link without any: exit code 3."""
    empty = "{ mass = 0.0, points = { root = [0.0, 0.0, 0.0], tip = [1.0, 0.0, 0.0] } }"
    _, err = told(capsys, arm, "--set", f"links.1.rigid={empty}", *QUICK, code=3)
    assert "no mass" in err


def test_more_knots_than_memory_are_refused(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With how many there may be."""
    _, err = told(capsys, arm, "--set", "simulation.step=1e-7", code=2)
    assert "simulation.step: too many steps for 2 coordinates" in err
    _, err = told(capsys, arm, "--set", "simulation.step=5.0", code=2)
    assert "simulation.step: too few steps for the duration" in err
