"""What a command writes over: an earlier result of its own kind, nothing that it reads, nothing else unless forced."""

from __future__ import annotations

import csv
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
import scenes

from erls.cli.main import main
from erls.errors import Cause, SceneError
from erls.files.csv_table import write_table
from erls.files.results import RUN, claim
from erls.run.file import load_run
from erls.scene.inputs import files_of
from erls.scene.read import load_scene

TABLE = "t [s],q [rad]\n0,0\n0.1,0.2\n0.5,0.4\n1,0.5\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder with a scene, its link, a table of its drive and links of both kinds to its files."""
    monkeypatch.chdir(tmp_path)
    scenes.l_link(tmp_path)
    (tmp_path / "drive.csv").write_text(TABLE, encoding="utf-8")
    motion = {"shape": "table", "file": "drive.csv"}
    scenes.l_scene(
        tmp_path,
        simulation={"duration": 0.01, "step": 1e-3},
        joints=[{**scenes.L_SCENE["joints"][0], "drive": {"type": "motion", "motion": motion}}],
    )
    (tmp_path / "soft").symlink_to("scene.toml")
    os.link(tmp_path / "link.toml", tmp_path / "hard")
    (tmp_path / "there").symlink_to(tmp_path)
    return tmp_path


def _refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one message of a refused command."""
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    return str(err)


INPUTS = ["scene.toml", "link.toml", "drive.csv", "soft", "hard", "there/drive.csv", "../{}/link.toml"]


@pytest.mark.parametrize("name", INPUTS)
@pytest.mark.parametrize("force", [(), ("--force",)])
def test_nothing_that_is_read(
    name: str, force: tuple[str, ...], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Scene, link and table by any name, forced or not; everything stays as it was."""
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    err = _refused(capsys, "simulate", "scene.toml", "-o", name.format(folder.name), *force)
    assert "cannot be written: it is a file that is read" in err
    assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_files_of_a_scene(folder: Path) -> None:
    """Those that it names, and those that these name."""
    assert {path.name for path in files_of(load_scene("scene.toml"))} == {"scene.toml", "link.toml", "drive.csv"}
    shutil.copy("scene.toml", "other.toml")
    data = scenes.read_toml(folder / "other.toml")
    data["links"][0] = {"name": "l", "modal_file": "l.modal.h5"}
    found = files_of(load_scene(scenes.write_toml(folder / "other.toml", data)))
    assert {path.name for path in found} == {"other.toml", "l.modal.h5", "drive.csv"}


@pytest.mark.parametrize(
    "arguments",
    [
        ("reduce", "link.toml", "-o", "hard"),
        ("compare", "scene.toml", "-o", "there/drive.csv"),
        ("study", "cost", "scene.toml", "-o", "drive.csv"),
        ("study", "cost", "scene.toml", "--apply", "link.toml", "--force"),
        ("study", "modes", "scene.toml", "-o", "printed.json", "--beside", "printed.json", "--force"),
    ],
)
def test_other_commands(arguments: tuple[str, ...], folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same rule."""
    (folder / "printed.json").write_text("elastic_modes,t\n1,0\n", encoding="utf-8")
    assert "it is a file that is read" in _refused(capsys, *arguments)


def test_results_are_replaced_by_their_kind(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A run by a run, each form of a view by the same; none by another, nor what somebody else wrote, unless forced."""
    simulate = ("simulate", "scene.toml", "--no-verdict", "-o")
    for _ in range(2):
        assert main([*simulate, "r.h5"]) == 0
        assert main(["reduce", "link.toml", "-o", "m.h5"]) == 0
    capsys.readouterr()
    assert "no run file" in _refused(capsys, *simulate, "m.h5")
    assert "no modal file" in _refused(capsys, "reduce", "link.toml", "-o", "r.h5")
    assert "--force" in _refused(capsys, "view", "r.h5", "-o", "drive.csv")
    assert (folder / "drive.csv").read_text(encoding="utf-8") == TABLE
    for name in ("r.csv", "r.pvd"):
        for _ in range(2):
            assert main(["view", "r.h5", "-o", name, "--at", "0,0.01"]) == 0
    capsys.readouterr()
    (folder / "x.h5").write_bytes(b"\x89HDF\r\n\x1a\n somebody's")
    (folder / "y.h5.partial").write_bytes(b"somebody's")
    assert "no run file" in _refused(capsys, *simulate, "x.h5")
    assert "y.h5.partial: " in _refused(capsys, *simulate, "y.h5")
    assert main([*simulate, "x.h5", "--force"]) == 0
    assert load_run("x.h5").end == 0.01


def test_remarks_tell(tmp_path: Path) -> None:
    """What carries the remark is a result; without it, it is somebody else's, whatever its ending says."""
    for begin, remark in ((b"\x89PNG..", b"written by erls"), (b"{", b'"written_by": "erls", ')):
        path, kind = tmp_path / "file", {b"{": ".json"}.get(begin, ".png")
        path.write_bytes(begin + bytes(100) + remark)
        claim(path, kind, [])
        for other in (begin, begin + remark[:-6], b"." + begin + remark):
            path.write_bytes(other)
            with pytest.raises(SceneError, match="--force"):
                claim(path, kind, [])
        claim(path, kind, [], force=True)


@pytest.mark.parametrize("length", [255, 252])
def test_too_long_a_name(length: int, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Found before the run: the file's own, and that of its checkpoints."""
    name = "x" * (length - 3) + ".h5"
    assert "File name too long" in _refused(capsys, "simulate", "scene.toml", "-o", name)
    assert "File name too long" in _refused(capsys, "simulate", "scene.toml", "-o", "r." + "x" * length)
    assert not list(folder.glob("*.h5*"))


def test_a_folder_that_takes_no_file(folder: Path) -> None:
    """Whatever its permissions say (those of /proc let root in)."""
    if not Path("/proc/self").is_dir():
        pytest.skip("no such folder")
    with pytest.raises(SceneError) as caught:
        claim(Path("/proc/self/r.h5"), RUN, [])
    assert caught.value.cause == Cause.NOT_WRITABLE


def test_names_are_no_formulas(tmp_path: Path) -> None:
    """What a spreadsheet would execute; numbers stay numbers."""
    rows: list[list[Any]] = [
        ["=1+1", "-2.5", -2.5, "+x", "@SUM(A1)", "\tx", "a=b", "-"],
        ["+1e-3", "-inf", "", 0, 1, 2, 3, 4],
    ]
    with (tmp_path / "t.csv").open("w", newline="", encoding="utf-8") as file:
        write_table(file, ["=HYPERLINK(1).x [m]", "t [s]"], rows)
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        head, *found = csv.reader(file)
    assert head == ["'=HYPERLINK(1).x [m]", "t [s]"]
    assert found[0] == ["'=1+1", "-2.5", "-2.5", "'+x", "'@SUM(A1)", "'\tx", "a=b", "'-"]
    assert found[1] == ["+1e-3", "-inf", "", "0", "1", "2", "3", "4"]


def test_names_of_points_in_tables_of_runs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A point called like a formula."""
    data = scenes.read_toml(folder / "scene.toml")
    data["points"] = [{"name": "=cmd|' calc'!A0", "link": "l", "node": "tip"}]
    scenes.write_toml(folder / "formula.toml", data)
    assert main(["simulate", "formula.toml", "--no-verdict", "-o", "f.h5"]) == 0
    assert main(["view", "f.h5", "-o", "f.csv", "--at", "0,0.01"]) == 0
    with Path("f.csv").open(newline="", encoding="utf-8") as file:
        head = next(csv.reader(file))
    assert not [name for name in head if name.startswith("=")]
    assert head[1].startswith("'=cmd")
    claim(folder / "f.csv", ".csv", [])
