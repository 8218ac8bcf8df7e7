"""Co-simulation units, in FMPy and over their door: runs, inputs, states, what is refused."""

from __future__ import annotations

import json
import shutil
import socket
import struct
import threading
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

import erls
from erls.cli.main import main
from erls.fmi.serve import serve

STEP = 2.0**-7  # s
ARM = """
name = "arm 1"
gravity = [0.0, 0.0, 0.0]
[simulation]
duration = 0.5
step = 0.0078125
[[joints]]
name = "hinge"
dh = { convention = "standard", a = 0.5 }
drive = { type = "torque", profiles = [{ shape = "step", start = 0.25, value = 2.0 }] }
[[links]]
name = "bar"
rigid = { mass = 1.0, inertia = [1e-3, 1e-2, 1e-2], points = { root = [-0.5, 0.0, 0.0], tip = [0.0, 0.0, 0.0] } }
[[points]]
name = "tip"
link = "bar"
node = "tip"
[[sensors]]
name = "acc"
type = "accelerometer"
point = "tip"
"""
INERTIA = 0.25 + 1e-2  # kg m², about the hinge

pytestmark = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="there is no C compiler, so that no unit can be opened"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene and its units."""
    path = tmp_path_factory.mktemp("fmi")
    (path / "arm.toml").write_text(ARM, encoding="utf-8")
    for version in (2, 3):
        unit = str(path / f"arm{version}.fmu")
        assert main(["export", str(path / "arm.toml"), "-o", unit, "--fmi", str(version)]) == 0
    return path


class Opened:
    """A unit in FMPy, past its initialization; what it said, of FMI 3 (FMPy shows the formats of the other's alone)."""

    def __init__(self, unit: Path, folder: Path, token: str = "", start: float = 0.0) -> None:
        text = fmpy.read_model_description(str(unit))
        self.second = text.fmiVersion.startswith("2")
        self.said: list[str] = []
        self.numbers = {variable.name: variable.valueReference for variable in text.modelVariables}
        self.fmu = (FMU2Slave if self.second else FMU3Slave)(
            guid=token or text.guid, unzipDirectory=fmpy.extract(str(unit), str(folder)),
            modelIdentifier=text.coSimulation.modelIdentifier, instanceName="one",
        )  # fmt: skip
        if self.second:
            self.fmu.instantiate()
            self.fmu.setupExperiment(startTime=start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.instantiate(logMessage=lambda environment, status, category, text: self.said.append(text.decode()))
            self.fmu.enterInitializationMode(startTime=start)
        self.fmu.exitInitializationMode()
        self.get, self.set = (
            (self.fmu.getReal, self.fmu.setReal) if self.second else (self.fmu.getFloat64, self.fmu.setFloat64)
        )

    def read(self, *names: str) -> list[float]:
        """Values of variables."""
        return list(self.get([self.numbers[name] for name in names]))

    def step(self, t: float, h: float) -> None:
        """One step."""
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=h)


@pytest.fixture(scope="module", params=[2, 3])
def started(request: pytest.FixtureRequest, folder: Path) -> Iterator[Opened]:
    """A unit of either version; its process starts once."""
    unit = Opened(folder / f"arm{request.param}.fmu", folder / f"unit{request.param}")
    yield unit
    unit.fmu.freeInstance()


@pytest.fixture
def opened(started: Opened) -> Opened:
    """The same at its start."""
    started.fmu.reset()
    return started


@pytest.mark.parametrize("version", [2, 3])
def test_descriptions_are_valid(version: int, folder: Path) -> None:
    """For the program that other programs are checked with; the unit holds all that it needs."""
    unit = folder / f"arm{version}.fmu"
    assert validate_fmu(str(unit)) == []
    text = fmpy.read_model_description(str(unit))
    units = {variable.name: variable.unit for variable in text.modelVariables}
    assert units["hinge.added_effort"] == "N m"
    assert units["acc.x"] == "m/s2"
    assert text.coSimulation.modelIdentifier == "arm_1"
    assert text.defaultExperiment.stopTime == "0.5"
    with zipfile.ZipFile(unit) as package:
        assert {"resources/start.run.h5", "sources/unit.c", "sources/unit.h"} <= set(package.namelist())


def test_a_unit_makes_the_run_of_its_scene(opened: Opened, folder: Path) -> None:
    """Bit for bit but for the rounding of what is read, the jump of the scene's torque included, whatever the steps of
    the program are; states that are kept are gone back to; and a reset begins again.
    """
    run = erls.simulate(erls.load_chain(folder / "arm.toml"), verdict=False)
    names = ["tip.x", "tip.y", "tip.z", "hinge.angle", "hinge.rate"]
    state, at, t = None, 16 * STEP, 0.0
    for h in (*[STEP] * 16, *[4 * STEP] * 12):
        if t == at:
            state = opened.fmu.getFMUState()
        opened.step(t, h)
        t += h
        values = opened.read("time", *names)
        expected = [t, *run.position("tip", t), run.joint_angle("hinge", t), run.states([t])[0].rates[0]]
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-14)
    opened.fmu.setFMUState(state)
    assert opened.read("time") == [at]
    assert opened.read("hinge.angle")[0] == pytest.approx(float(run.joint_angle("hinge", at)), abs=1e-15)
    opened.fmu.freeFMUState(state)
    for k in range(48):
        opened.step(at + k * STEP, STEP)
    assert opened.read(*names) == values[1:]
    opened.fmu.reset()
    assert opened.read("time", "hinge.angle") == [0.0, 0.0]


def test_inputs_are_held_from_sample_to_sample(opened: Opened) -> None:
    """Torques that jump from step to step move a bar as a staircase does, exactly: θ'' = τ/I in each; and they are
    added to what the scene drives it with.
    """
    angle, rate, t = 0.0, 0.0, 0.0
    for k, torque in enumerate((0.5, -1.0, 0.0, 2.0) * 12):
        opened.set([opened.numbers["hinge.added_effort"]], [torque])
        opened.step(t, STEP)
        whole = (torque + (2.0 if t >= 0.25 else 0.0)) / INERTIA
        angle, rate, t = angle + rate * STEP + whole * STEP**2 / 2, rate + whole * STEP, (k + 1) * STEP
        np.testing.assert_allclose(opened.read("hinge.angle", "hinge.rate"), [angle, rate], rtol=0, atol=1e-12)


def test_what_a_unit_refuses(opened: Opened) -> None:
    """With a message to the program, which goes on."""
    unit = opened
    faults: dict[str, Any] = {
        "only inputs can be set": lambda: unit.set([unit.numbers["tip.x"]], [1.0]),
        "not a finite number": lambda: unit.set([1], [float("inf")]),
        "no variable": lambda: unit.get([99]),
        "stands at another time": lambda: unit.step(0.3, STEP),
        "nothing of the kind": lambda: unit.fmu.serializeFMUState(unit.fmu.getFMUState()),
        "not a finite number of plausible": lambda: (unit.set([1], [1e99]), unit.step(0.0, STEP)),
    }
    for words, fault in faults.items():
        with pytest.raises(fmpy.fmi1.FMICallException):
            fault()
        assert unit.second or words in unit.said[-1]
    unit.set([1], [0.0])
    unit.step(0.0, STEP)


def test_what_cannot_be_opened(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A description that belongs to another unit, and a Python that is not there."""
    with pytest.raises(Exception, match="instantiate"):
        Opened(folder / "arm3.fmu", tmp_path / "b", token="{other}")
    monkeypatch.setenv("ERLS_PYTHON", str(tmp_path / "none"))
    with pytest.raises(Exception, match="instantiate"):
        Opened(folder / "arm3.fmu", tmp_path / "c")


def test_damaged_resources_are_told(tmp_path: Path) -> None:
    """Over the door, before anything is asked."""
    mine, other = socket.socketpair()
    (tmp_path / "start.run.h5").write_bytes(b"none")
    serving = threading.Thread(target=serve, args=(other, tmp_path))
    serving.start()
    status, size = struct.unpack("=II", mine.recv(8))
    assert status == 1
    assert b"start.run.h5" in mine.recv(size)
    mine.close()
    serving.join()
    other.close()


def test_the_command(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It names what goes in and comes out; bad input is one line and leaves nothing."""
    scene, unit = str(folder / "arm.toml"), tmp_path / "unit.fmu"
    for _ in range(2):
        assert main(["export", scene, "-o", str(unit), "--set", "sensors=[]", "--json"]) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["inputs"] == {"hinge.added_effort": "N m"}
    assert list(told["outputs"]) == ["tip.x", "tip.y", "tip.z", "hinge.angle", "hinge.rate"]
    unit.write_bytes(b"PK mine")
    twice = '{name="hinge.rate",type="joint_rate",joint="hinge"}'
    faults = {
        "is no .fmu file": ["-o", str(unit)],
        "no such version": ["-o", str(tmp_path / "a.fmu"), "--fmi", "1"],
        "end the output in .fmu": ["-o", str(tmp_path / "a.mtx"), "--fmi", "2"],
        "have this name": ["-o", str(tmp_path / "a.fmu"), "--set", f"sensors=[{twice}]"],
        "takes no choice": ["-o", str(tmp_path / "a.fmu"), "--set", "simulation.effects=auto"],
    }
    for words, arguments in faults.items():
        assert main(["export", scene, *arguments]) == 2
        assert words in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["unit.fmu"]


def test_without_a_compiler_there_are_sources(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Which is said, and is a unit all the same."""
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["export", str(folder / "arm.toml"), "-o", str(tmp_path / "unit.fmu")]) == 0
    assert "no C compiler" in capsys.readouterr().err
    with zipfile.ZipFile(tmp_path / "unit.fmu") as package:
        assert not [name for name in package.namelist() if name.startswith("binaries")]
    assert validate_fmu(str(tmp_path / "unit.fmu")) == []
