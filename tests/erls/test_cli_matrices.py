"""The command ``erls export``: files, summary, what it refuses."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from erls.cli.main import main

ROOT = Path(__file__).parents[2]
LINK = ROOT / "data" / "l_shape" / "links" / "steel_tall.toml"


@pytest.fixture(scope="module")
def modal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("modal") / "l.modal.h5"
    assert main(["reduce", str(LINK), "-o", str(path)]) == 0
    return path


def exported(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    capsys.readouterr()
    assert main(["export", *words]) == code
    found = capsys.readouterr()
    return found.err if code else found.out


def test_a_superelement_and_the_full_model(modal: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = json.loads(exported(capsys, str(modal), "-o", str(tmp_path / "l.mtx"), "--json"))
    assert (told["dofs"], told["nodes"], told["modal_coordinates"]) == (24, 2, 12)
    assert told["interfaces"] == {"root": 1, "tip": 2}
    assert [Path(f).name for f in told["files"]] == ["l.mtx", "l.mass.mtx", "l.rows.txt", "l.nodes.txt", "l.toml"]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(Path(f).name for f in told["files"])
    assert main(["reduce", str(tmp_path / "l.toml"), "-o", str(tmp_path / "again.modal.h5")]) == 0
    assert "246 dofs, 41 nodes, 0 modal" in exported(capsys, str(LINK), "-o", str(tmp_path / "full.pch"))


def test_what_is_replaced(modal: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Earlier exports are, but for OUTPUT4, which has no place for a mark; never what is read, or another's file."""
    target = tmp_path / "l.mtx"
    for _ in range(2):
        exported(capsys, str(modal), "-o", str(target))
    target.write_text("%%MatrixMarket matrix coordinate real general\n", encoding="ascii")
    assert "no .mtx file that erls wrote" in exported(capsys, str(modal), "-o", str(target), code=2)
    exported(capsys, str(modal), "-o", str(target), "--force")
    exported(capsys, str(modal), "-o", str(tmp_path / "l.op4"))
    assert "--force" in exported(capsys, str(modal), "-o", str(tmp_path / "l.op4"), code=2)
    own = tmp_path / "own.toml"
    shutil.copy(LINK, own)
    text = own.read_bytes()
    assert "a file that is read" in exported(capsys, str(own), "-o", str(tmp_path / "own.mtx"), "--force", code=2)
    assert own.read_bytes() == text
    assert not (tmp_path / "own.mtx").exists()


def test_faults(modal: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words, message in (
        ([str(modal), "-o", str(tmp_path / "l.xyz")], "names no format"),
        ([str(modal), "-o", str(tmp_path / "l.op4"), "--format", "op4"], "unknown name 'op4'"),
        ([str(modal), "-o", str(tmp_path / "nowhere" / "l.op4")], "no folder"),
        ([str(tmp_path / "nix.h5"), "-o", str(tmp_path / "l.op4")], "no such file"),
        ([str(modal)], "output"),
    ):
        assert message in exported(capsys, *words, code=2)
    assert not list(tmp_path.iterdir())


def test_a_body_for_exudyn(modal: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a modal file and of the description that it came from, alike; earlier ones are replaced, others are not."""
    target = tmp_path / "l.hdf5"
    told = [json.loads(exported(capsys, str(source), "-o", str(target), "--json")) for source in (modal, LINK)]
    assert told[0] == told[1]
    assert told[0]["modes"] == 18
    assert told[0]["interfaces"]["tip"] == list(range(47, 53))
    shutil.copy(modal, tmp_path / "mine.hdf5")
    assert "no .hdf5 file that erls wrote" in exported(capsys, str(modal), "-o", str(tmp_path / "mine.hdf5"), code=2)


def test_standard_input_data(modal: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a modal file and of the description that it came from, alike; earlier ones are replaced, others are not."""
    texts = []
    for source in (modal, LINK):
        told = json.loads(exported(capsys, str(source), "-o", str(tmp_path / "l.SID_FEM"), "--json"))
        assert (told["modes"], told["nodes"]["root"], told["nodes"]["tip"]) == (18, 1, 2)
        texts.append((tmp_path / "l.SID_FEM").read_text("ascii"))
    assert texts[0] == texts[1]
    told = exported(capsys, str(modal), "-o", str(tmp_path / "l.SID_FEM"))
    assert "18 modes, in which root rests" in told
    assert "left out" not in told  # no recovery in that file
    bimetal = ROOT / "data" / "thermal" / "links" / "bimetal.toml"
    assert "left out: stress" in exported(capsys, str(bimetal), "-o", str(tmp_path / "b.sid_fem"))
    other = tmp_path / "mine.SID_FEM"
    other.write_text("    3   3    :No. nodes, No. modes\n", encoding="ascii")
    assert "no .sid_fem file that erls wrote" in exported(capsys, str(modal), "-o", str(other), code=2)
    assert "no folder" in exported(capsys, str(modal), "-o", str(tmp_path / "nowhere" / "l.sid_fem"), code=2)
    assert "is for units of scenes" in exported(capsys, str(modal), "-o", str(other), "--fmi", "2", code=2)
