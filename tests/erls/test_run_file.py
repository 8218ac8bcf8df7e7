"""Run files: equal answers after reading, without the files they came from; damage is reported; writing is atomic."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.run.chain.run import ChainRun
from erls.run.file import load_run, save_run
from erls.scene.read import load_scene
from fe_import.errors import ReportedError
from fe_import.files.hdf5.files import write_strings

TIMES = np.linspace(0.0, 0.02, 11)
BODY = {"mass": 0.5, "centre_of_mass": [0.2, 0, 0], "inertia": [1e-3, 2e-3, 2e-3]}


def chain(folder: Path) -> Path:
    """A prescribed joint from a table, a torque table, a rigid link between two flexible ones, a payload."""
    scenes.arm_link(folder)
    (folder / "motion.csv").write_text("time; degrees\n0; 0\n0,005; 1,5\n0,01; 4\n0,02; 7\n", encoding="utf-8")
    (folder / "torque.csv").write_text("0, 9, 0.1\n0.01, 9, -0.2\n0.02, 9, 0.3\n", encoding="utf-8")
    motion = {"shape": "table", "file": "motion.csv", "degrees": True, "rates_deg": [1.0, 2.0]}
    load = {"shape": "table", "file": "torque.csv", "column": 2, "interpolation": "linear"}
    constant = {"shape": "constant", "value": 0.05}
    dh = {"convention": "standard", "a": 0.4, "alpha_deg": 40.0}
    pose = {"mesh_pose": {"frame": "joint"}}
    data = {
        "simulation": {"duration": 0.02, "step": 5e-4, "gauge": "minimum-norm"},
        "joints": [
            {"name": "j1", "dh": dh, "drive": {"type": "motion", "motion": motion}},
            {"name": "j2", "dh": dh, "drive": {"type": "torque", "profiles": [load, constant]}},
            {"name": "j3", "dh": dh, "stiffness": 2.0, "rest_deg": 5.0, "friction": {"force": 0.01}},
        ],
        "links": [
            {"name": "a", "model": "arm.toml", **pose},
            {"name": "b", "rigid": {**BODY, "points": {"in": [0, 0, 0], "out": [0.4, 0, 0]}}, **pose},
            {"name": "c", "model": "arm.toml", "damping": {"ratio": 0.01}, **pose},
        ],
        "points": [{"name": "end", "link": "c", "node": "tip"}, {"name": "Ende ü 1", "link": "b", "node": "out"}],
        "payloads": [{"point": "end", "mass": 0.1, "offset": [0.01, 0, 0]}],
    }
    return scenes.write_toml(folder / "chain.toml", data)


@pytest.fixture(scope="module", autouse=True)
def _few_output_times() -> Iterator[None]:
    """Files are written often here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("erls.run.file._OUTPUT_TIMES", 51)
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> ChainRun:
    return erls.simulate(chain(tmp_path_factory.mktemp("chain")))


@pytest.fixture(scope="module")
def file(run: ChainRun) -> Path:
    """Its run file; the files that the scene names are gone."""
    folder = run.scene.folder
    save_run(folder / "run.h5", run)
    for name in ("chain.toml", "arm.toml", "motion.csv", "torque.csv"):
        (folder / name).unlink()
    return folder / "run.h5"


def answers(run: ChainRun) -> dict[str, Any]:
    """Whatever can be asked."""
    found: dict[str, Any] = {f"position {n}": run.position(n, TIMES) for n in run.point_names}
    for name in run.joint_names:
        force, moment = run.reaction(name, TIMES)
        found |= {f"force {name}": force, f"moment {name}": moment, f"effort {name}": run.joint_effort(name, TIMES)}
        found |= {f"angle {name}": run.joint_angle(name, TIMES), f"rate {name}": run.joint_rate(name, TIMES)}
        found[f"coordinate {name}"] = run.joint_coordinate(name, TIMES)
    for name in run.link_names:
        found[f"modal {name}"] = run.modal_coordinates(name, TIMES)
    energy = run.energy(TIMES)
    return found | {kind: getattr(energy, kind) for kind in ("kinetic", "elastic", "gravity", "springs", "total")}


def assert_equal_runs(a: ChainRun, b: ChainRun) -> None:
    """To rounding: BLAS adds in another order where an array lies otherwise in memory, 1e-16 seen."""
    expected = answers(b)
    for question, answer in answers(a).items():
        largest = np.abs(expected[question]).max()
        np.testing.assert_allclose(answer, expected[question], rtol=0, atol=1e-14 * largest, err_msg=question)


def test_equal_answers_without_the_files(run: ChainRun, file: Path) -> None:
    """Positions, angles, energies, reactions; also the summary, warnings and work."""
    loaded = load_run(file)
    assert_equal_runs(run, loaded)
    assert loaded.summary([0.01]) == run.summary([0.01])
    assert (loaded.scene.name, loaded.warnings, loaded.wall_s) == ("chain", run.warnings, run.wall_s)
    assert loaded.solution.work == run.solution.work
    assert loaded.failure is None
    assert loaded.conservative == run.conservative
    np.testing.assert_array_equal(loaded.times, run.times)


def test_reading_and_writing_is_the_identity(file: Path, tmp_path: Path) -> None:
    """A run that was read writes the same bytes."""
    save_run(tmp_path / "again.h5", load_run(file))
    assert (tmp_path / "again.h5").read_bytes() == file.read_bytes()


def test_a_run_file_may_be_moved_and_renamed(file: Path, tmp_path: Path) -> None:
    """The scene keeps its name; no answer depends on where the file lies."""
    moved = tmp_path / "other folder" / "überholt.dat"
    moved.parent.mkdir()
    moved.write_bytes(file.read_bytes())
    loaded = load_run(moved)
    assert loaded.scene.name == "chain"
    np.testing.assert_array_equal(loaded.position("end", TIMES), load_run(file).position("end", TIMES))


def test_tables_are_those_of_the_start(tmp_path: Path) -> None:
    """A table that changes or disappears while the run computes does not matter."""
    path = chain(tmp_path)

    def remove(t: float, end: float) -> None:
        (tmp_path / "motion.csv").unlink(missing_ok=True)
        (tmp_path / "torque.csv").write_text("0, 9, 9\n1, 9, 9\n", encoding="utf-8")

    run = erls.simulate(path, progress=remove)
    save_run(tmp_path / "run.h5", run)
    assert_equal_runs(run, load_run(tmp_path / "run.h5"))


def test_models_are_stored_once(file: Path) -> None:
    """Links of one source share a group, and share one model after reading."""
    with h5py.File(file) as f:
        assert list(f["models"]) == ["0001", "0002"]
        assert f["model_of_link"][()].tolist() == [1, 2, 1]
    links = load_run(file).formulation.mechanism.links
    assert links[0].model is links[2].model


def test_output_group_for_other_programs(run: ChainRun, file: Path) -> None:
    """Plain h5py reads points, joints and energies at even times; they are the run's."""
    with h5py.File(file) as f:
        output = f["output"]
        times = output["time"][()]
        assert times[0] == 0.0
        assert times[-1] == run.end
        np.testing.assert_allclose(np.diff(times), run.end / 50, rtol=1e-9)
        assert set(output["points"]) == set(run.point_names)
        assert set(output["joints"]) == set(run.joint_names)
        for name in run.point_names:
            np.testing.assert_array_equal(output["points"][name][()], run.position(name, times))
        for name in run.joint_names:
            joint = output["joints"][name]
            np.testing.assert_array_equal(joint["angles"][()], run.joint_angle(name, times))
            np.testing.assert_array_equal(joint["coordinates"][()], run.joint_coordinate(name, times))
            np.testing.assert_array_equal(joint["rates"][()], run.joint_rate(name, times))
        np.testing.assert_array_equal(output["energy/total"][()], run.energy(times).total)
        assert output["points/end"].attrs["unit"] == b"m"
        assert f.attrs["units"] == b"SI"
        assert f.attrs["status"] == b"complete"
        assert json.loads(f["scene"][()])["simulation"]["duration"] == run.end


def failed(run: ChainRun, cause: Cause = Cause.NEWTON_FAILED, knots: int = 20) -> ChainRun:
    """The run as if it had stopped early."""
    s = run.solution
    failure = SimulationError(cause, "it stopped", where="t = 0.01 s", value="step 1e-9 s", remedy="try again")
    cut = replace(s, t=s.t[:knots], y=s.y[:knots], v=s.v[:knots], a=s.a[:knots], failure=failure)
    return replace(run, solution=cut, warnings=("careful", "zweite ü"))


@pytest.mark.parametrize(("cause", "knots"), [(Cause.INTERRUPTED, 20), (Cause.NEWTON_FAILED, 1), (Cause.NOT_FINITE, 5)])
def test_status_and_failure_survive(run: ChainRun, tmp_path: Path, cause: Cause, knots: int) -> None:
    """Cause, whole message, warnings and the knots up to then."""
    stopped = failed(run, cause, knots)
    save_run(tmp_path / "r.h5", stopped)
    loaded = load_run(tmp_path / "r.h5")
    assert loaded.failure is not None
    assert loaded.failure.cause == cause
    assert loaded.failure.exit_code == (130 if cause == Cause.INTERRUPTED else 3)
    for part in ("t = 0.01 s: it stopped", "step 1e-9 s", "try again"):
        assert part in str(loaded.failure)
    assert loaded.warnings == ("careful", "zweite ü")
    assert loaded.end == run.solution.t[knots - 1]
    np.testing.assert_array_equal(loaded.solution.a, stopped.solution.a)
    save_run(tmp_path / "again.h5", loaded)
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "r.h5").read_bytes()


def test_an_unfinished_run_counts_as_interrupted(run: ChainRun, tmp_path: Path) -> None:
    """What a checkpoint leaves behind when the process is killed."""
    save_run(tmp_path / "r.h5", run, "unfinished")
    failure = load_run(tmp_path / "r.h5").failure
    assert failure is not None
    assert failure.cause == Cause.INTERRUPTED
    assert "unfinished" in str(failure)


# writing


def test_a_failing_write_leaves_the_old_file(run: ChainRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Disk full in the middle, an interrupt, a missing folder: the old file is whole, nothing else lies there."""
    path = tmp_path / "r.h5"
    save_run(path, run)
    before = path.read_bytes()

    for problem, expected in ((OSError(28, "No space left"), SceneError), (KeyboardInterrupt(), KeyboardInterrupt)):

        def fail(*_: Any, problem: BaseException = problem) -> None:
            raise problem

        with monkeypatch.context() as patch:
            patch.setattr("erls.run.file._fill_output", fail)
            with pytest.raises(expected) as caught:
                save_run(path, failed(run))
        if isinstance(caught.value, SceneError):
            assert caught.value.cause == Cause.NOT_WRITABLE
            assert caught.value.remedy
        assert path.read_bytes() == before
        assert [p.name for p in tmp_path.iterdir()] == ["r.h5"]
    with pytest.raises(SceneError, match="make the folder first") as missing:
        save_run(tmp_path / "nix" / "r.h5", run)
    assert missing.value.cause == Cause.NOT_WRITABLE


# damage


def test_what_is_no_run_file(tmp_path: Path, file: Path) -> None:
    """Missing, a folder, text, and the HDF5 file of something else."""
    model = tmp_path / "m.h5"
    (tmp_path / "text.h5").write_text("hello", encoding="utf-8")
    with h5py.File(file) as source, h5py.File(model, "w") as target:
        for name, value in source["models/0001"].attrs.items():
            target.attrs[name] = value
    for path, cause in (
        (tmp_path / "nix.h5", Cause.FILE_NOT_FOUND),
        (tmp_path, Cause.NOT_READABLE),
        (tmp_path / "text.h5", Cause.NOT_READABLE),
        (model, Cause.RUN_FILE),
    ):
        with pytest.raises(SceneError) as caught:
            load_run(path)
        assert caught.value.cause == cause
        assert str(path) in caught.value.where
        assert caught.value.remedy


def _rename(name: str, other: str) -> Callable[[h5py.File], None]:
    return lambda f: f.move(name, other)


def _attribute(name: str, value: Any) -> Callable[[h5py.File], None]:
    return lambda f: f.attrs.modify(name, value)


def _data(name: str, change: Callable[[np.ndarray], Any]) -> Callable[[h5py.File], None]:
    def apply(f: h5py.File) -> None:
        values = change(f[name][()])
        del f[name]
        f.create_dataset(name, data=values)

    return apply


def _scene(change: Callable[[dict[str, Any]], Any]) -> Callable[[h5py.File], None]:
    def apply(f: h5py.File) -> None:
        data = json.loads(f["scene"][()])
        data = change(data) or data
        del f["scene"]
        write_strings(f, "scene", data if isinstance(data, str) else json.dumps(data), "")

    return apply


def _with(values: np.ndarray, place: Any, value: float) -> np.ndarray:
    values[place] = value
    return values


TAMPERED = {
    "other schema": _attribute("schema", b"erls modal model"),
    "newer version": _attribute("schema_version", np.int64(99)),
    "version in words": lambda f: f.attrs.create("schema_version", np.bytes_(b"one")),
    "no status": lambda f: f.attrs.__delitem__("status"),
    "wall time NaN": _attribute("wall_s", np.nan),
    "no scene": lambda f: f.__delitem__("scene"),
    "no models": lambda f: f.__delitem__("models"),
    "no knots": _rename("knots", "knotss"),
    "no positions": _rename("knots/position", "knots/positions"),
    "model renamed": _rename("models/0002", "models/0003"),
    "link of no model": _data("model_of_link", lambda v: _with(v, 0, 7)),
    "link of model 0": _data("model_of_link", lambda v: _with(v, 0, 0)),
    "models of two links": _data("model_of_link", lambda v: v[:2]),
    "another model for the rigid link": _data("model_of_link", lambda v: _with(v, 2, 2)),
    "times as text": _data("knots/time", lambda v: np.array([b"x"] * len(v))),
    "times fall": _data("knots/time", lambda v: v[::-1].copy()),
    "time NaN": _data("knots/time", lambda v: _with(v, 3, np.nan)),
    "no times": _data("knots/time", lambda v: v[:0]),
    "position inf": _data("knots/position", lambda v: _with(v, (2, 1), np.inf)),
    "a position too few": _data("knots/position", lambda v: v[:-1]),
    "a coordinate too few": _data("knots/velocity", lambda v: v[:, :-1]),
    "velocity as integers": _data("knots/velocity", lambda v: v.astype(np.int64)),
    "scene not JSON": _scene(lambda data: "{"),
    "scene a list": _scene(lambda data: "[]"),
    "scene nested without end": _scene(lambda data: "[" * 100_000),
    "scene with an unknown key": _scene(lambda data: {**data, "grav": 1}),
    "a joint too few": _scene(lambda data: data["joints"].pop() and None),
    "no joints": _scene(lambda data: data.update(joints=[], links=[])),
    "unknown formulation": _scene(lambda data: data["simulation"].update(formulation="x")),
    "unknown gauge": _scene(lambda data: data["simulation"].update(gauge="x")),
    "unknown joint type": _scene(lambda data: data["joints"][0].update(type="x")),
    "unknown convention": _scene(lambda data: data["joints"][0]["dh"].update(convention="x")),
    "unknown interface": _scene(lambda data: data["links"][0].update(inboard="x")),
    "unknown node": _scene(lambda data: data["points"][0].update(node="x")),
    "gravity beyond reason": _scene(lambda data: data.update(gravity=[1e300, 0, 0])),
    "another gauge": _scene(lambda data: data["simulation"].update(gauge="joint-angle")),
    "one more free joint": _scene(lambda data: data["joints"][0].update(drive={"type": "free"})),
    "a table that is gone": _scene(
        lambda data: data["joints"][1]["drive"].update(profiles=[{"shape": "table", "file": "torque.csv"}])
    ),
}


@pytest.mark.parametrize("kind", TAMPERED)
def test_tampered(kind: str, file: Path, tmp_path: Path) -> None:
    """Renamed, missing, of another type or shape, inconsistent: refused with the name of the file, or harmless."""
    path = tmp_path / "t.h5"
    path.write_bytes(file.read_bytes())
    with h5py.File(path, "r+") as f:
        TAMPERED[kind](f)
    if kind in ("another gauge", "another model for the rigid link"):  # may be consistent
        _accepted_or_reported(path)
        return
    with pytest.raises(ReportedError) as caught:
        load_run(path)
    assert caught.value.remedy
    assert str(path) in caught.value.where


def _accepted_or_reported(path: Path) -> bool:
    try:
        run = load_run(path)
    except ReportedError as problem:
        return not problem.remedy
    with np.errstate(all="ignore"):  # numbers may be absurd, answers come all the same
        assert run.position("end", run.end).shape == (3,)
        assert run.energy(0.0).total.shape == ()
    return True


def test_scene_of_a_run_is_a_scene(file: Path, tmp_path: Path) -> None:
    """The stored scene says what was run: drives with their tables, all defaults."""
    record = load_run(file).scene.record
    motion, profile = record.joints[0].drive.motion, record.joints[1].drive.profiles[0]
    assert (motion.file, motion.times, motion.values_deg) == (None, (0.0, 0.005, 0.01, 0.02), (0.0, 1.5, 4.0, 7.0))
    assert (profile.file, profile.values) == (None, (0.1, -0.2, 0.3))
    assert load_scene(chain(tmp_path)).record.joints[2] == record.joints[2]
