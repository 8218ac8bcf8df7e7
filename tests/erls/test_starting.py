"""What is there for who begins: starts, examples, schemas, completion."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import scenes
from jsonschema import Draft202012Validator

from erls.cli.main import main
from erls.report.schema import KINDS, json_schema

DATA = scenes.ROOT / "data"
STARTS = sorted(path.name for path in (DATA / "start").iterdir())


def _kind(tables: dict[str, Any]) -> str:
    if "variables" in tables:
        return "problem"
    if "simulation" not in tables:
        return "link"
    return "scene" if "joints" in tables else "bodies"


@pytest.fixture(scope="module")
def validators() -> dict[str, Any]:
    """Of each kind of file."""
    return {kind: Draft202012Validator(json_schema(kind)) for kind in KINDS}


@pytest.mark.parametrize("kind", STARTS)
def test_starts_are_written_and_run(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command that is printed; comments say what to change."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", kind]) == 0
    command = capsys.readouterr().out.splitlines()[-1].removeprefix("next: erls ").split()
    assert main([*command, "--set", "simulation.duration=0.01", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["trust"]["verdict"] == "good"
    text = (tmp_path / kind / "scene.toml").read_text(encoding="utf-8")
    assert "# What to change" in text.replace("\n# ", " # ")
    for file in (tmp_path / kind).rglob("*.toml"):
        name = file.read_text(encoding="utf-8").splitlines()[0].removeprefix("#:schema ")
        schema = json.loads((file.parent / name).read_text(encoding="utf-8"))
        assert name.rpartition("/")[2] == f"{_kind(_read(file))}.schema.json"
        assert Draft202012Validator(schema).is_valid(_read(file))
    assert main(["new", kind]) == 2
    assert "there is a file or folder of that name" in capsys.readouterr().err


def test_examples_are_listed_and_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every scene with a line; groups with all that they read."""
    monkeypatch.chdir(tmp_path)
    assert main(["examples", "list", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["examples"]
    scenes = [p for p in DATA.rglob("*.toml") if _kind(_read(p)) not in ("link", "problem")]
    own = {str(p.relative_to(DATA).with_suffix("")) for p in scenes}
    assert set(found) == own
    assert all(len(text) > 10 for text in found.values()), found
    assert main(["examples", "copy", "robot/two_link"]) == 0
    capsys.readouterr()
    assert main(["info", "robot/two_link.toml", "--json"]) == 0
    assert main(["examples", "copy", "all", "there/all"]) == 0
    assert len(list((tmp_path / "there/all").rglob("*.toml"))) == len(list(DATA.rglob("*.toml")))
    capsys.readouterr()
    for name, words in {"robto": "'robot'", "robot/two_lnk.toml": "'two_link'"}.items():
        assert main(["examples", "copy", name, "none"]) == 2
        assert f"did you mean {words}" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_a_folder_that_cannot_be_made_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing half-written."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert main(["new", "chain", str(tmp_path / "file" / "chain")]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", sorted(DATA.rglob("*.toml")), ids=lambda p: str(p.relative_to(DATA)))
def test_schemas_accept_what_is_shipped(path: Path, validators: dict[str, Any]) -> None:
    """Scenes of both kinds, links, problems."""
    tables = _read(path)
    assert [error.message for error in validators[_kind(tables)].iter_errors(tables)] == []


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (["joints", 0, "tpye"], "revolute"),
        (["joints", 0, "type"], "revolut"),
        (["joints", 0, "drive", "type"], "motoin"),
        (["simulation", "duration"], "1 s"),
        (["simulation", "formulation"], "fem"),
        (["points", 0, "position"], [0.0, 1.0]),
    ],
)
def test_schemas_refuse_what_is_misspelt(place: Sequence[Any], value: object, validators: dict[str, Any]) -> None:
    """Fields, names and values."""
    tables = _read(DATA / "robot/two_link.toml")
    inner: Any = tables
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    assert not validators["scene"].is_valid(tables)


@pytest.mark.parametrize("kind", KINDS)
def test_schemas_describe_every_field(kind: str) -> None:
    """Editors show it beside the cursor; the schema is one itself."""
    found = json_schema(kind)
    Draft202012Validator.check_schema(found)
    for name, table in found["$defs"].items():
        assert table["description"], name
        tag = {"type", "shape"}
        bare = {field for field, said in table["properties"].items() if not said.get("description")} - tag
        assert not bare, (name, bare)


def test_a_schema_is_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Written again, but never over something else."""
    file = tmp_path / "scene.schema.json"
    for _ in range(2):
        assert main(["schema", "scene", "-o", str(file)]) == 0
    assert json.loads(file.read_text(encoding="utf-8"))["title"] == "scene"
    file.write_text('{"mine": 1}', encoding="utf-8")
    assert main(["schema", "scene", "-o", str(file)]) == 2
    assert json.loads(file.read_text(encoding="utf-8")) == {"mine": 1}


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_and_options(tmp_path: Path) -> None:
    """What is installed for bash knows them."""
    program = "import sys; from erls.cli.main import main; sys.argv[0] = 'erls'; sys.exit(main())"
    environment = {**os.environ, "HOME": str(tmp_path), "SHELL": "/bin/bash", "PYTHONPATH": str(scenes.ROOT)}
    subprocess.run(
        [sys.executable, "-c", program, "--install-completion", "--shell", "bash"], env=environment, check=True
    )
    (script,) = [path for path in tmp_path.rglob("erls*") if path.is_file()]
    asked = f"""
        source {script}
        function=$(complete -p erls | sed 's/.*-F \\([^ ]*\\).*/\\1/')
        COMP_WORDS=(erls lin); COMP_CWORD=1; $function; echo "${{COMPREPLY[@]}}"
        COMP_WORDS=(erls simulate --form); COMP_CWORD=2; $function; echo "${{COMPREPLY[@]}}"
    """
    told = subprocess.run(["bash", "-c", asked], env=environment, check=True, capture_output=True, text=True).stdout
    assert told.split() == ["linearize", "--formulation"]


def test_wheels_hold_examples_and_types(tmp_path: Path) -> None:
    """What is installed outside a checkout: scenes, stubs, marks."""
    hatchling = pytest.importorskip("hatchling.build", reason="the build backend is not installed")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(scenes.ROOT)
        name = hatchling.build_wheel(str(tmp_path))
    with zipfile.ZipFile(tmp_path / name) as wheel:
        names = set(wheel.namelist())
    assert {"erls/__init__.pyi", "erls/py.typed", "fe_import/__init__.pyi", "fe_import/py.typed"} <= names
    shipped = {f"erls/examples/{path.relative_to(DATA)}" for path in DATA.rglob("*") if path.is_file()}
    assert shipped <= names
    assert not any(name.startswith(("tests/", "benchmarks/", "data/")) for name in names)
