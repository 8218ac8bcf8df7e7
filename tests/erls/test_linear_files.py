"""Files and reports of linear models, and the command: what they hold, what they refuse."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from scipy.io import loadmat
from scipy.linalg import expm

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError
from erls.linear.files import write_model
from erls.linear.model import LinearModel

JOINT = scenes.ROOT / "data/robot/flexible_joint.toml"


def run(capsys: pytest.CaptureFixture[str], *words: str | Path, code: int = 0) -> tuple[str, str]:
    """Stdout and stderr of ``erls linearize``."""
    assert main(["linearize", *map(str, words)]) == code
    found = capsys.readouterr()
    return found.out, found.err


@pytest.fixture(scope="module")
def model() -> LinearModel:
    """Of the flexible joint, with a motor that is driven and a force on the hand."""
    inputs, outputs = ["joint.motor.effort", "point.hand.force.y"], ["joint.motor.angle", "point.hand.velocity.y"]
    return erls.linearize(JOINT, at="equilibrium", inputs=inputs, outputs=outputs)


def test_rigid_arm_behind_a_gear_is_in_closed_form() -> None:
    """Pole √(k / J + k / J_m), zero √(k / J) of the motor's angle; J with the hand at 0.5 m; without damping, 1e-9."""
    changes = ["links.arm.flexible=false", "joints.motor.damping=0", "joints.gear.damping=0"]
    found = erls.linearize(
        erls.load_scene(JOINT, changes), inputs=["joint.motor.effort"], outputs=["joint.motor.angle"], at="equilibrium"
    )
    bar = 2700.0 * 1e-4 * 0.5
    j, motor, k = bar * 0.25 / 3 + bar * 2e-4 / 12 / 2 + 0.2 * 0.25, 0.02, 300.0
    own = [mode.pole.imag for mode in found.modes if mode.pole.imag]
    np.testing.assert_allclose(own, [np.sqrt(k / j + k / motor)], rtol=1e-4)
    np.testing.assert_allclose(np.abs(found.zeros().imag), [np.sqrt(k / j)] * 2, rtol=1e-4)
    assert own[0] ** 2 - np.abs(found.zeros()[0]) ** 2 == pytest.approx(k / motor, rel=1e-9)


@pytest.mark.parametrize("ending", [".json", ".npz", ".mat"])
def test_files_hold_the_model(model: LinearModel, ending: str, tmp_path: Path) -> None:
    """Every matrix to the last bit, names, poles and shapes; what was written may be replaced, and nothing else."""
    path = tmp_path / f"model{ending}"
    write_model(path, model)
    found: Any
    if ending == ".json":
        found = json.loads(path.read_text(encoding="utf-8"))
        poles = np.array(found["poles"]) @ [1, 1j]
        names = found["inputs"], found["outputs"]
    elif ending == ".npz":
        with np.load(path) as file:  # nothing in it is pickled
            found = dict(file)
        poles, names = found["poles"], (found["inputs"].tolist(), found["outputs"].tolist())
    else:
        found = loadmat(path)
        poles = found["poles"].ravel()
        names = tuple([str(cell[0][0]) for cell in found[key]] for key in ("inputs", "outputs"))
    for name in ("A", "B", "C", "D", "mass", "damping", "stiffness", "ways"):
        np.testing.assert_array_equal(found[name], getattr(model, name))
    np.testing.assert_array_equal(poles, model.poles)
    assert names == (["joint.motor.effort", "point.hand.force.y"], ["joint.motor.angle", "point.hand.velocity.y"])


def test_state_space_objects(model: LinearModel) -> None:
    """SciPy's has the same matrices; python-control is asked for by name where it is missing."""
    system = model.state_space()
    np.testing.assert_array_equal(system.A, model.A)
    with pytest.raises(SceneError, match=r"erls\[control\]") as caught:
        model.control()
    assert caught.value.cause == Cause.BAD_FIELD


def test_motor_is_damped_by_a_controller_from_the_model(model: LinearModel) -> None:
    """A, B and C are those of one system: torque = -k angle - c rate moves the poles as the closed matrix says."""
    gain = np.array([[20.0, 0.0]])
    closed = model.A - model.B[:, :1] @ gain @ model.C
    drive = 'joints.motor.drive={type="pd", motion={shape="sine", amplitude=0.0, frequency_hz=1.0}, '
    changes = [drive + "proportional_gain=20.0, derivative_gain=0.0}"]
    held = erls.linearize(erls.load_scene(JOINT, changes), at="equilibrium", inputs=[], outputs=[])
    x = np.random.default_rng(0).standard_normal(len(closed))
    np.testing.assert_allclose(expm(1e-3 * closed) @ x, expm(1e-3 * held.A) @ x, rtol=1e-8, atol=1e-10)


def test_command_prints_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Text, one JSON object, a page; a file of somebody else stays."""
    asked = "--equilibrium", "--inputs", "joint.motor.effort", "--outputs", "joint.motor.angle"
    out, _ = run(capsys, JOINT, *asked, "-o", tmp_path / "joint.html")
    assert "16.65" in out
    page = (tmp_path / "joint.html").read_text(encoding="utf-8")
    for words in ("Bode: amplitude from joint.motor.effort", "Nichols", "After a step", "transmission zeros"):
        assert words in page
    found = json.loads(run(capsys, JOINT, *asked, "--json", "-o", tmp_path / "m.npz")[0])
    assert found["inputs"] == ["joint.motor.effort"]
    assert (tmp_path / "m.npz").exists()
    assert len(found["zeros"]) > 4
    assert found["output"] == str(tmp_path / "m.npz")
    run(capsys, JOINT, "--equilibrium", "-o", tmp_path / "m.npz")  # its own may be replaced
    (tmp_path / "mine.mat").write_bytes(b"MATLAB 5.0 my own")
    assert "--force" in run(capsys, JOINT, "-o", tmp_path / "mine.mat", code=2)[1]
    assert (tmp_path / "mine.mat").read_bytes() == b"MATLAB 5.0 my own"


def test_command_draws_diagrams(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a parameter and of a speed; JSON and page."""
    locus = "--locus", "joints.gear.stiffness=100:500:3"
    found = json.loads(run(capsys, JOINT, "--equilibrium", *locus, "--json")[0])
    assert found["values"] == [100.0, 300.0, 500.0]
    swings = [complex(*poles[3]).imag / (2 * np.pi) for poles in found["poles"]]
    assert swings[0] < swings[1] < swings[2]
    assert swings[1] == pytest.approx(16.65, abs=0.01)
    speed = "--campbell", "motor=0:20:3"
    run(capsys, JOINT, *speed, "-o", tmp_path / "speed.html")
    assert "Campbell diagram" in (tmp_path / "speed.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--at", "0.1", "--equilibrium"], "two states at once"),
        (["--at", "-1"], "0 or later"),
        (["--inputs", "joint.nobody.effort"], "no such input"),
        (["--campbell", "motor=0:10"], "not a range of values"),
        (["--campbell", "motor=0:10:1"], "not a range of values"),
        (["--campbell", "motor=nan:10:4"], "not a range of values"),
        (["--campbell", "motor=0:10:2", "-o", "model.npz"], "decides its form"),
        (["--campbell", "nobody=0:10:3"], "no such joint"),
        (["--campbell", "motor=0:1:2", "--locus", "joints.gear.stiffness=1:2:2"], "two diagrams at once"),
        (["--campbell", "motor=0:1:2", "--at", "0.1"], "equilibrium"),
        (["--locus", "joints.nobody.stiffness=1:2:2"], "nobody"),
        (["-o", "model.xml"], "decides its form"),
        (["--campbell", "motor=0:1:2", "-o", "model.mat"], "decides its form"),
    ],
)
def test_faulty_commands(words: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One line on stderr, exit code 2, nothing written."""
    own = [str(tmp_path / word) if word.startswith("model") else word for word in words]
    out, err = run(capsys, JOINT, *own, code=2)
    lines = [line for line in err.splitlines() if line.startswith("error: ")]
    assert not out
    assert len(lines) == 1
    assert told in lines[0]
    assert not list(tmp_path.iterdir())


def test_mode_is_drawn_from_a_run_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One period in a second, a tenth of the link at its largest displacement; the hand as the model says, to 1 %."""
    path = tmp_path / "mode.run.h5"
    assert "mode 4, 16.65 Hz" in run(capsys, JOINT, "--equilibrium", "--mode", "4", "-o", path)[0]
    found = erls.load_run(path)
    model = erls.linearize(JOINT, at="equilibrium", inputs=[], outputs=["point.hand.y"])
    swing = found.position("hand", [0.0, 0.5])[:, 1]
    assert np.ptp(swing) == pytest.approx(2 * 0.1 * 0.5 * abs(model.modes[3].seen[0].real), rel=0.01)
    assert "there is no such mode" in run(capsys, JOINT, "--mode", "99", "-o", path, code=2)[1]
    assert "-o MODE.run.h5" in run(capsys, JOINT, "--mode", "1", code=2)[1]
