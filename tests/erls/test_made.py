"""Scenes made in Python and scenes written as files: the same as those that were read."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from scenes import ROOT

import erls
import fe_import
from erls.errors import Cause, SceneError
from fe_import.modal.file import read_modal_file

DATA = ROOT / "data"
SCENES = ["robot/three_link.toml", "four_bar/flexible.toml", "heavy_top/slow.toml", "statics/roll_up.toml",
          "shells/hemisphere.toml", "spin_up/beam.toml"]  # fmt: skip
LINK: dict[str, Any] = {"name": "arm", "model": "links/arm.toml", "mesh_pose": {"frame": "joint"}}
TABLES: dict[str, Any] = {
    "name": "arm / 1",
    "simulation": {"duration": 0.02},
    "base": {"rotation_deg": np.array([90.0, 0.0, 0.0])},
    "joints": [{"name": "hip", "dh": {"convention": "standard", "a": 0.5}, "damping": 0.1}],
    "points": [{"name": "end", "link": "arm", "node": "tip"}],
}


@pytest.mark.parametrize("name", SCENES)
def test_what_is_written_reads_as_it_was(name: str, tmp_path: Path) -> None:
    """Every field, of chains, loops, bodies and shells, from another folder; a second time over the first."""
    shutil.copytree((DATA / name).parent, tmp_path / "first", ignore=shutil.ignore_patterns("*.png"))
    scene = erls.load_scene(tmp_path / "first" / Path(name).name)
    for target in (tmp_path / "first/again.toml", tmp_path / "first/again.toml"):
        assert erls.save_scene(target, scene) == [target]
    again = erls.load_scene(target)
    assert msgspec.to_builtins(again.record) == msgspec.to_builtins(scene.record)
    elsewhere = tmp_path / "elsewhere.toml"
    erls.save_scene(elsewhere, scene)
    assert "../" not in elsewhere.read_text(encoding="utf-8")
    erls.load_scene(elsewhere)


def test_a_table_in_a_file_is_found_from_elsewhere(tmp_path: Path) -> None:
    """Its path starts at the file that is written."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in/t.csv").write_text("t,q\n0,0\n1,0.5\n2,1\n3,0\n", encoding="utf-8")
    motion = {"shape": "table", "file": "t.csv", "column": 1}
    joint = {**TABLES["joints"][0], "drive": {"type": "motion", "motion": motion}}
    rigid = {"mass": 1.0, "points": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]}}
    links = [{"name": "arm", "rigid": rigid, "mesh_pose": {"frame": "joint"}}]
    scene = erls.make_scene(folder=tmp_path / "in", **{**TABLES, "joints": [joint], "links": links})
    erls.save_scene(tmp_path / "out.toml", scene)
    assert 'file = "in/t.csv"' in (tmp_path / "out.toml").read_text(encoding="utf-8")
    ends = [erls.simulate(s, verdict=False).position("end", 0.02) for s in (scene, tmp_path / "out.toml")]
    assert (ends[0] == ends[1]).all()


def test_tables_of_single_coordinates_are_found_too(tmp_path: Path) -> None:
    """Of a joint with several."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in/t.csv").write_text("t,q\n0,0\n1,0.5\n2,1\n3,0\n", encoding="utf-8")
    drive = {"type": "motion", "motion": {"shape": "table", "file": "t.csv", "column": 1}}
    joint = {**TABLES["joints"][0], "type": "universal", "coordinates": {"x": {"drive": drive}}}
    for name in ("initial", "drive", "damping"):
        joint.pop(name, None)
    rigid = {"mass": 1.0, "inertia": [0.1] * 3, "points": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]}}
    links = [{"name": "arm", "rigid": rigid, "mesh_pose": {"frame": "joint"}}]
    scene = erls.make_scene(folder=tmp_path / "in", **{**TABLES, "joints": [joint], "links": links})
    erls.save_scene(tmp_path / "out.toml", scene)
    assert 'file = "in/t.csv"' in (tmp_path / "out.toml").read_text(encoding="utf-8")


def test_models_of_others_are_not_replaced(tmp_path: Path) -> None:
    """Links whose names are files of one name have one each; one that is none of ours stays."""
    models = [
        fe_import.reduce_link(fe_import.load_link(DATA / "robot/links/arm.toml", {"elastic_modes": n})) for n in (2, 3)
    ]
    hip = TABLES["joints"][0]
    joints = [hip, {**hip, "name": "knee"}]
    links = [{**LINK, "name": name, "model": model} for name, model in zip(("a b", "a:b"), models, strict=True)]
    points = [{"name": "end", "link": "a:b", "node": "tip"}]
    made = erls.make_scene(folder=tmp_path, **{**TABLES, "joints": joints, "points": points}, links=links)
    files = erls.save_scene(tmp_path / "arm.toml", made)
    assert [path.name for path in files] == ["a_b.modal.h5", "a_b_1.modal.h5", "arm.toml"]
    assert [read_modal_file(path).elastic_modes for path in files[:2]] == [2, 4]
    files[0].write_bytes(b"of somebody else")
    with pytest.raises(SceneError, match="a_b"):
        erls.save_scene(tmp_path / "arm.toml", made)
    assert files[0].read_bytes() == b"of somebody else"


def test_links_may_be_models(tmp_path: Path) -> None:
    """As a reduction gives them: the run of the scene that names the description; written, they lie beside the file."""
    model = fe_import.reduce_link(fe_import.load_link(DATA / "robot/links/arm.toml"))
    made = erls.make_scene(folder=tmp_path, **TABLES, links=[{**LINK, "model": model}])
    named = erls.make_scene(folder=DATA / "robot", **TABLES, links=[LINK])
    files = erls.save_scene(tmp_path / "arm.toml", made)
    assert [str(path.relative_to(tmp_path)) for path in files] == ["links/arm.modal.h5", "arm.toml"]
    ends = [erls.simulate(s, verdict=False).position("end", 0.02) for s in (made, named, tmp_path / "arm.toml")]
    assert (ends[0] == ends[1]).all()
    assert (ends[0] == ends[2]).all()


def test_records_of_another_scene_serve() -> None:
    """Changed with msgspec, or as they are."""
    other = erls.load_chain(DATA / "robot/two_link.toml")
    longer = msgspec.structs.replace(other.record.simulation, duration=0.5)
    parts = {name: getattr(other.record, name) for name in ("joints", "links", "points")}
    scene = erls.make_scene(folder=other.folder, simulation=longer, **parts)
    assert isinstance(scene, erls.Scene)
    assert scene.record.joints == other.record.joints
    assert scene.record.simulation.duration == 0.5


def test_functions_of_time_drive(tmp_path: Path) -> None:
    """A motion as the shape that is the same function, a torque as the effort that it is; and as a file they stay."""
    rate, hip = 2 * np.pi * 3.0, TABLES["joints"][0]
    rigid = {"mass": 1.0, "inertia": [0.1] * 3, "points": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]}}
    links = [{"name": "arm", "rigid": rigid, "mesh_pose": {"frame": "joint"}}]

    def made(drive: dict[str, Any]) -> Any:
        return erls.make_scene(**{**TABLES, "simulation": {"duration": 0.3}, "joints": [{**hip, "drive": drive}]},
                               links=links)  # fmt: skip

    times = np.linspace(0.0, 0.3, 40)
    shape = {"shape": "sine", "amplitude": 0.4, "frequency_hz": 3.0}
    scene = made({"type": "motion", "motion": lambda t: 0.4 * np.sin(rate * t)})
    own, same = (erls.simulate(s, verdict=False) for s in (scene, made({"type": "motion", "motion": shape})))
    np.testing.assert_allclose(own.joint_angle("hip", times), same.joint_angle("hip", times), rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.joint_rate("hip", times), same.joint_rate("hip", times), rtol=0, atol=1e-6)
    pushed = made({"type": "torque", "profiles": [lambda t: np.exp(-5 * t), {"shape": "constant", "value": 1.0}]})
    erls.save_scene(tmp_path / "pushed.toml", pushed)
    for each in (pushed, tmp_path / "pushed.toml"):
        run = erls.simulate(each, verdict=False)
        effort = run.joint_effort("hip", times) + hip["damping"] * run.joint_rate("hip", times)
        np.testing.assert_allclose(effort, 1 + np.exp(-5 * times), rtol=0, atol=1e-8)
    brief = made({"type": "motion", "motion": lambda t: float(np.exp(-(((t - 0.0803) / 3e-3) ** 2)))})
    assert max(brief.record.joints[0].drive.motion.values) > 0.99  # over in a thirtieth of the time
    for fault, words in ((lambda t: float(t > 0.1), "not smooth"), (lambda t: None, "no number"),
                         (lambda t: np.nan, "no finite number")):  # fmt: skip
        with pytest.raises(SceneError, match=rf"make_scene: joints\[0\].drive.motion.*{words}"):
            made({"type": "motion", "motion": fault})


def test_faults_name_the_field(tmp_path: Path) -> None:
    """And a file of somebody else stays."""
    with pytest.raises(SceneError, match=r"make_scene: joints\[0\].dampng.*did you mean 'damping'"):
        erls.make_scene(**{**TABLES, "joints": [{**TABLES["joints"][0], "dampng": 1.0}]}, links=[LINK])
    robot = shutil.copytree(DATA / "robot", tmp_path / "robot")
    scene = erls.make_scene(folder=robot, **TABLES, links=[LINK])
    mine = tmp_path / "mine.toml"
    mine.write_text("# mine\n", encoding="utf-8")
    for target in (mine, tmp_path / "none/x.toml", robot / "links/arm.toml"):
        with pytest.raises(SceneError) as refused:
            erls.save_scene(target, scene)
        assert refused.value.cause == Cause.NOT_WRITABLE
    assert mine.read_text(encoding="utf-8") == "# mine\n"
    erls.save_scene(mine, scene, force=True)
    assert "arm / 1" in mine.read_text(encoding="utf-8")
