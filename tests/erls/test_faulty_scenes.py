"""Faulty scenes through the command line: one message with file, field and remedy; exit code 2; nothing written."""

from __future__ import annotations

import copy
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import scenes
from faulty_scenes import FAULTS, GONE

from erls.cli.main import main
from erls.errors import Cause
from fe_import.description.link import load_link
from fe_import.errors import Cause as FECause
from fe_import.modal.file import write_modal_file
from fe_import.reduce import reduce_link


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the scenes name: a frame link, a solid one, modal files in both forms, tables."""
    folder = tmp_path_factory.mktemp("faulty")
    link = scenes.l_link(folder)
    write_modal_file(folder / "good.modal.h5", reduce_link(load_link(link)))
    write_modal_file(folder / "physical.modal.h5", reduce_link(load_link(link, {"form": "physical"})))
    solid = scenes.read_toml(scenes.ROOT / "data/l_shape/links/solid.toml")
    solid["solid"]["mesh"] = str(scenes.ROOT / "data/l_shape/meshes/l_hex20.msh")
    solid["reduction"] = {"fixed_interface_modes": 1, "elastic_modes": 2}
    write_modal_file(folder / "solid.modal.h5", reduce_link(scenes.write_toml(folder / "solid.toml", solid)))
    single = {**scenes.L_LINK, "interfaces": scenes.L_LINK["interfaces"][:1]}
    scenes.write_toml(folder / "single.toml", single)
    for name, text in {
        "load.csv": "t, x\n0, 1\n1, 2\n2, nan\n",
        "unsorted.csv": "0, 1\n1, 2\n0.5, 3\n",
        "short.csv": "0, 1\n",
        "words.csv": "0, 1\n1, one\n",
        "ragged.csv": "0, 1\n1, 2, 3\n",
        "empty.csv": "# nothing\n",
        "text.h5": "not HDF5",
        "bad_link.toml": "interfaces = []\nframes = 1\n",
    }.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "cut.modal.h5").write_bytes((folder / "good.modal.h5").read_bytes()[:3000])
    (folder / "subfolder").mkdir()
    return folder


def edit(data: Any, path: str, value: Any) -> None:
    """Set a field, or remove it."""
    *before, last = [int(s) if s.isdigit() else s for s in path.split(".")]
    for step in before:
        data = data.setdefault(step, {}) if isinstance(data, dict) else data[step]
    if value is GONE:
        del data[last]
    elif isinstance(data, list) and last == len(data):
        data.append(value)
    else:
        data[last] = value


def base() -> dict[str, Any]:
    """A sound scene."""
    data: dict[str, Any] = json.loads(json.dumps(scenes.L_SCENE))
    data["simulation"] = {"duration": 0.001, "step": 5e-4}
    return data


def refused(
    arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str], code: int = 2
) -> dict[str, str | None]:
    """Run a command twice, as text and as JSON; check what every refusal has in common; the JSON error."""
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*")}
    assert main(arguments) == code
    out, text = capsys.readouterr()
    told = [line for line in text.splitlines() if "reduc" not in line or line.startswith("error: ")]
    assert out == ""
    assert len(told) == 1, text
    assert told[0].startswith("error: ")
    assert main([*arguments, "--json"]) == code
    out, text = capsys.readouterr()
    assert "error" not in text
    assert out.count("\n") == 1
    found = json.loads(out)
    assert list(found) == ["error"]
    error = found["error"]
    assert list(error) == ["cause", "message", "where", "value", "limit", "remedy"]
    assert error["cause"] in {*map(str, Cause), *map(str, FECause)}
    assert error["remedy"]
    for part in (error["message"], error["where"], error["remedy"]):
        assert part.replace("\n", "\\n") in told[0]
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*")} == before
    return error


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_scene(fault: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Named with file and field, by text and by JSON; no reduction, run or temporary file appears."""
    edits, where, words = FAULTS[fault]
    data = base()
    for path, value in edits:
        edit(data, path, copy.deepcopy(value))
    scene = scenes.write_toml(folder / "scene.toml", data)
    error = refused(["simulate", str(scene), "-o", str(folder / "out.h5")], folder, capsys)
    told = " ".join(str(v) for v in error.values())
    assert words in told
    assert str(folder) in error["where"]
    assert where in error["where"] or (where in error["remedy"] and "scene.toml" in error["remedy"])


def test_the_sound_scene_runs(folder: Path) -> None:
    """So that the faults above are what is refused."""
    scene = scenes.write_toml(folder / "scene.toml", base())
    assert main(["simulate", str(scene), "-o", str(folder / "sound.h5")]) == 0


def _file(text: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(text) and None


FILES = {
    "missing": (lambda path: None, Cause.FILE_NOT_FOUND, "no such file"),
    "folder": (Path.mkdir, Cause.NOT_READABLE, "cannot be read"),
    "empty": (_file(b"\n"), Cause.BAD_FIELD, "simulation"),
    "not TOML": (_file(b"simulation = {"), Cause.SYNTAX, "not valid TOML"),
    "not UTF-8": (_file(b"name = '\xff\xfe'"), Cause.NOT_READABLE, "UTF-8"),
    "HDF5": (_file(b"\x89HDF\r\n\x1a\n" + bytes(99)), Cause.NOT_READABLE, "UTF-8"),
    "key twice": (_file(b"name = 'a'\nname = 'b'"), Cause.SYNTAX, "not valid TOML"),
    "nested without end": (_file(b"name = " + b"[" * 5000), Cause.SYNTAX, "not valid TOML"),
    "digits without end": (_file(b"name = " + b"9" * 5000), Cause.SYNTAX, "not valid TOML"),
}


@pytest.mark.parametrize("kind", FILES)
def test_what_is_no_scene_file(kind: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Missing, empty, a folder, or not TOML."""
    make, cause, words = FILES[kind]
    path = folder / "strange.toml"
    make(path)
    try:
        error = refused(["simulate", str(path), "-o", str(folder / "out.h5")], folder, capsys)
    finally:
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    assert error["cause"] == str(cause)
    assert str(path) in str(error["where"])
    assert words in " ".join(str(v) for v in error.values())


ARGUMENTS = {
    "time after the end": (["--at", "0,0.5"], "--at", "within the run"),
    "negative time": (["--at=-0.001"], "--at", "within the run"),
    "time NaN": (["--at", "nan"], "--at", "within the run"),
    "time in words": (["--at", "end"], "--at", "seconds"),
    "set without value": (["--set", "simulation.step"], "--set simulation.step", "KEY=VALUE"),
    "set a member that is not": (["--set", "links.arm.flexible=false"], "--set", "known: 0, l"),
    "set an unknown key": (["--set", "simulation.stp=1"], "simulation.stp", "'step'"),
    "set of two lines": (["--set", "a\nb.c=1"], "a\nb", "known fields"),
    "unknown formulation": (["--formulation", "nodel"], "simulation.formulation", "known: erls"),
    "quoted formulation": (["--formulation", 'a"b'], "simulation.formulation", "known: erls"),
    "unknown option": (["--ad", "1"], "command line", "--at"),
    "option without value": (["--at"], "command line", "--at"),
    "one scene too many": (["other.toml"], "command line", "other.toml"),
}


@pytest.mark.parametrize("kind", ARGUMENTS)
def test_faulty_arguments(kind: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What the options of ``erls simulate`` refuse."""
    arguments, where, words = ARGUMENTS[kind]
    scene = scenes.write_toml(folder / "scene.toml", base())
    error = refused(["simulate", str(scene), "-o", str(folder / "out.h5"), *arguments], folder, capsys)
    assert where in str(error["where"])
    assert words in " ".join(str(v) for v in error.values())


@pytest.mark.parametrize(
    ("output", "words"),
    [("nix/out.h5", "make the folder first"), ("subfolder", "name of a file"), ("scene.toml", "another name")],
)
def test_outputs_that_cannot_be(output: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that does not exist, a folder, and the scene itself."""
    scene = scenes.write_toml(folder / "scene.toml", base())
    error = refused(["simulate", str(scene), "-o", str(folder / output)], folder, capsys)
    assert error["cause"] == str(Cause.NOT_WRITABLE)
    assert words in str(error["remedy"])


def test_a_faulty_joint_is_found_before_links_are_reduced(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reduction may take minutes; what does not depend on it is checked first."""
    monkeypatch.setattr("erls.scene.build.reduce_cached", lambda *_, **__: pytest.fail("reduced too early"))
    for fault in ("table with NaN", "alpha twice", "point on an unknown link", "payload on an unknown point"):
        test_faulty_scene(fault, folder, capsys)
