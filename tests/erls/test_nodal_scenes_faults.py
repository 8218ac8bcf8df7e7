"""Scenes of bodies that cannot be meant, and the command line around them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from body_scenes_data import PENDULUM, STRIP, body_scene

from erls import simulate
from erls.cli.main import main
from erls.errors import Cause, SceneError, SimulationError
from erls.report.info import file_info
from erls.run.file import load_run
from erls.scene.read import load_chain
from erls.view import write_view
from fe_import.errors import ReportedError

CLAMP, BEAM, LOAD = STRIP["connections"][0], STRIP["beams"][0], STRIP["loads"][0]
PIN, BOB = PENDULUM["connections"][0], PENDULUM["bodies"][0]
MOTION = {"shape": "polynomial", "from": 0.1, "to": 0.3, "duration": 1.0}

FAULTS: list[tuple[dict[str, Any], dict[str, Any], str, str]] = [
    (STRIP, {"beams": [{**BEAM, "element": 3}]}, "UNKNOWN_FIELD", "beams[0].element"),
    (STRIP, {"simulation": {"type": "motion"}}, "BAD_FIELD", "simulation.type"),
    (STRIP, {"simulation": {"type": "statics", "duration": 1.0}}, "UNKNOWN_FIELD", "simulation.duration"),
    (STRIP, {"simulation": {"tangent": "secant"}}, "BAD_REFERENCE", "simulation.tangent"),
    (STRIP, {"simulation": {"load_steps": 0}}, "BAD_FIELD", "simulation.load_steps"),
    (STRIP, {"simulation": {"type": "buckling", "count": 0}}, "BAD_FIELD", "simulation.count"),
    (STRIP, {"simulation": {"type": "frequencies", "load": -1.0}}, "BAD_FIELD", "simulation.load"),
    (STRIP, {"name": "a\nb"}, "BAD_FIELD", "name"),
    (STRIP, {"gravity": [0.0, 0.0, float("inf")]}, "BAD_FIELD", "gravity[2]"),
    (STRIP, {"materials": {"rubber": {"youngs_modulus": 0.0}}}, "BAD_FIELD", "materials.rubber.youngs_modulus"),
    (STRIP, {"materials": {"rubber": {"poissons_ratio": 0.6}}}, "BAD_FIELD", "materials.rubber.poissons_ratio"),
    (STRIP, {"materials": {"rubber": {"density": -1.0}}}, "BAD_FIELD", "materials.rubber.density"),
    (STRIP, {"sections": {"strip": {"width": 0.0}}}, "BAD_FIELD", "sections.strip.width"),
    (STRIP, {"nodes": {"ground": [0.0, 0.0, 0.0]}}, "BAD_FIELD", "nodes.ground"),
    (STRIP, {"nodes": {"alone": [0.0, 0.0, 0.0]}}, "BAD_FIELD", "nodes.alone"),
    (STRIP, {"nodes": {"tip": [0.0, 0.0, 0.0]}}, "BAD_FIELD", "beams[0].to"),
    (STRIP, {"beams": [{**BEAM, "to": "end"}]}, "BAD_REFERENCE", "beams[0].to"),
    (STRIP, {"beams": [{**BEAM, "to": "root"}]}, "BAD_FIELD", "beams[0].to"),
    (STRIP, {"beams": [{**BEAM, "section": "bar"}]}, "BAD_REFERENCE", "beams[0].section"),
    (STRIP, {"beams": [{**BEAM, "material": "steel"}]}, "BAD_REFERENCE", "beams[0].material"),
    (STRIP, {"beams": [{**BEAM, "elements": 0}]}, "BAD_FIELD", "beams[0].elements"),
    (STRIP, {"beams": [{**BEAM, "local_z": [0, 0, 0]}]}, "BAD_FIELD", "beams[0].local_z"),
    (STRIP, {"beams": [{**BEAM, "local_z": [1, 0, 0]}]}, "BAD_FIELD", "beams[0].local_z"),
    (STRIP, {"beams": [{**BEAM, "through": [1.0, 0.0, 0.0]}]}, "BAD_FIELD", "beams[0].through"),
    (STRIP, {"beams": [{**BEAM, "name": "a"}, {**BEAM, "name": "a"}]}, "BAD_FIELD", "beams[1].name"),
    (STRIP, {"masses": [{"node": "strip/9", "mass": 1.0}]}, "BAD_REFERENCE", "masses[0].node"),
    (STRIP, {"masses": [{"node": "tip", "mass": -1.0}]}, "BAD_FIELD", "masses[0].mass"),
    (STRIP, {"masses": [{"node": "tip", "mass": 1.0, "inertia": [-1, 0, 0]}]}, "BAD_FIELD", "masses[0].inertia"),
    (STRIP, {"loads": [{**LOAD, "node": "top"}]}, "BAD_REFERENCE", "loads[0].node"),
    (STRIP, {"loads": [{"node": "tip"}]}, "BAD_FIELD", "loads[0]"),
    (STRIP, {"loads": [{**LOAD, "factor": [{"shape": "wave"}]}]}, "BAD_FIELD", "loads[0].factor[0].shape"),
    (STRIP, {"report": ["strip/8"]}, "BAD_REFERENCE", "report[0]"),
    (STRIP, {"connections": [{**CLAMP, "type": "glued"}]}, "BAD_REFERENCE", "connections[0].type"),
    (STRIP, {"connections": [{**CLAMP, "node": "tap"}]}, "BAD_REFERENCE", "connections[0].node"),
    (STRIP, {"connections": [{**CLAMP, "to": "wall"}]}, "BAD_REFERENCE", "connections[0].to"),
    (STRIP, {"connections": [{**CLAMP, "to": "root"}]}, "BAD_FIELD", "connections[0].to"),
    (STRIP, {"connections": [{**CLAMP, "axis": [0, 0, 1]}]}, "BAD_FIELD", "connections[0].axis"),
    (STRIP, {"connections": [{**CLAMP, "motion": MOTION}]}, "BAD_FIELD", "connections[0].motion"),
    (PENDULUM, {"connections": [{**PIN, "axis": [0, 0, 0]}]}, "BAD_FIELD", "connections[0].axis"),
    (PENDULUM, {"connections": [{**PIN, "type": "universal"}]}, "BAD_FIELD", "connections[0].second_axis"),
    (PENDULUM, {"connections": [{**PIN, "type": "universal", "second_axis": [0, 1, 1]}]}, "BAD_FIELD",
     "connections[0].second_axis"),
    (PENDULUM, {"connections": [{**PIN, "motion": MOTION}]}, "BAD_FIELD", "connections[0].motion"),
    (PENDULUM, {"bodies": [{**BOB, "name": "ground"}]}, "BAD_FIELD", "bodies[0].name"),
    (PENDULUM, {"bodies": [{**BOB, "mass": -2.0}]}, "BAD_FIELD", "bodies[0].mass"),
    (PENDULUM, {"bodies": [{**BOB, "inertia": [1.0, 1.0, -1.0]}]}, "BAD_FIELD", "bodies[0].inertia"),
    (PENDULUM, {"bodies": []}, "BAD_FIELD", "bodies"),
    (PENDULUM, {"simulation": {"group": "SO(3)"}}, "BAD_REFERENCE", "simulation.group"),
    (PENDULUM, {"simulation": {"iteration_matrix": "old"}}, "BAD_REFERENCE", "simulation.iteration_matrix"),
    (PENDULUM, {"simulation": {"duration": 0.0}}, "BAD_FIELD", "simulation.duration"),
    (PENDULUM, {"simulation": {"duration": 1e10}}, "BAD_FIELD", "simulation.duration"),
    (PENDULUM, {"simulation": {"step": 1e-12}}, "BAD_FIELD", "simulation.step"),
    (PENDULUM, {"simulation": {"spectral_radius": 1.5}}, "BAD_FIELD", "simulation.spectral_radius"),
    (PENDULUM, {"simulation": {"newton_tolerance": -1.0}}, "BAD_FIELD", "simulation.newton_tolerance"),
    (PENDULUM, {"simulation": {"residual_tolerance": 1.0}}, "BAD_FIELD", "simulation.residual_tolerance"),
]  # fmt: skip


@pytest.mark.parametrize(("base", "change", "cause", "field"), FAULTS)
def test_faults_are_named(tmp_path: Path, base: dict[str, Any], change: dict[str, Any], cause: str, field: str) -> None:
    """Every one has its cause, file and field, and says what to do."""
    path = body_scene(tmp_path, base, **change)
    with pytest.raises(ReportedError) as caught:
        simulate(path)
    assert caught.value.cause.name == cause
    assert caught.value.where.startswith(f"{path}: {field}")
    assert caught.value.remedy
    assert caught.value.exit_code == 2


def test_no_equilibrium(tmp_path: Path) -> None:
    """A beam that nothing holds; what was found is kept."""
    with pytest.raises(SimulationError) as caught:
        simulate(body_scene(tmp_path, STRIP, connections=[]))
    assert caught.value.cause is Cause.NO_EQUILIBRIUM
    assert caught.value.run.statics.path == ()


def test_chains_and_bodies_are_told_apart(tmp_path: Path) -> None:
    """What needs a chain says so."""
    path = body_scene(tmp_path, STRIP)
    with pytest.raises(SceneError, match=r"no chain"):
        load_chain(path)


def _json(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> dict[str, Any]:
    assert main([*arguments, "--json"]) == code
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    found: dict[str, Any] = json.loads(out)
    return found


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """simulate, info and view of a motion and of an equilibrium; JSON and text say the same."""
    pendulum, output = str(body_scene(tmp_path, PENDULUM)), str(tmp_path / "motion.h5")
    found = _json(capsys, "simulate", pendulum, "-o", output, "--at", "0.1,0.2")
    assert [s["t"] for s in found["samples"]] == [0.1, 0.2]
    assert found["analysis"] == "dynamics"
    with h5py.File(output) as file:
        assert file["knots/position"].shape == (201, 12)
        np.testing.assert_allclose(file["output/points/bob"][-1], found["samples"][1]["points"]["bob"], atol=1e-12)
    loaded = load_run(output)
    assert _json(capsys, "info", output) == {
        "file": "run", **loaded.summary(), "failure": None
    }  # fmt: skip
    assert loaded.summary([0.1, 0.2]) == {k: v for k, v in found.items() if k != "output"}
    assert _json(capsys, "info", pendulum)["bodies"][0]["name"] == "bob"
    strip, output = str(body_scene(tmp_path, STRIP)), str(tmp_path / "rest.h5")
    assert main(["simulate", strip, "-o", output, "--set", "simulation.load_steps=3"]) == 0
    text = capsys.readouterr().out
    assert "tangent full" in text
    assert "0.333333" in text
    assert _json(capsys, "info", output)["load_steps"] == 3
    for wrong, where in ((["--at", "0.5"], "--at"), (["--formulation", "erls"], f"{strip}: simulation.formulation")):
        assert _json(capsys, "simulate", strip, *wrong, code=2)["error"]["where"] == where
    for command in ("effects", "compare"):
        assert "no chain" in _json(capsys, command, strip, code=2)["error"]["message"]


def test_failures_keep_what_was_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A beam that nothing holds: exit code 3; the file says why there is no more."""
    output = tmp_path / "rest.h5"
    path = body_scene(tmp_path, STRIP, connections=[])
    assert main(["simulate", str(path), "-o", str(output)]) == 3
    run = load_run(output)
    assert run.failure is not None
    assert run.failure.cause is Cause.NO_EQUILIBRIUM
    assert run.summary()["samples"] == []
    with pytest.raises(SceneError, match="nothing to draw"):
        write_view(run, tmp_path / "a.png")
    assert "what was computed" in capsys.readouterr().err


def test_files_of_earlier_versions_are_refused(tmp_path: Path) -> None:
    """With what to do; scenes of bodies gave other files once."""
    with h5py.File(tmp_path / "old.h5", "w") as file:
        file.attrs["schema"], file.attrs["schema_version"] = b"erls result of bodies", np.int64(1)
    for read in (load_run, file_info):
        with pytest.raises(SceneError, match="simulate again") as caught:
            read(tmp_path / "old.h5")
        assert caught.value.cause is Cause.RUN_FILE
        assert str(tmp_path / "old.h5") in caught.value.where
