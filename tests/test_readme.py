"""Every command and example of the README runs, and its facts about the repository hold."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def _blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


SHELL = [line for block in _blocks("sh") for line in block.splitlines() if line.strip()]
SETUP = [line for line in SHELL if line.startswith("python3 -m venv")]
COMMANDS = [line for line in SHELL if line.startswith("erls ")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that looks like a checkout to the commands."""
    path = tmp_path_factory.mktemp("readme")
    shutil.copytree(ROOT / "data", path / "data")
    return path


def _run(command: str, folder: Path) -> None:
    words = shlex.split(command)
    code = "import sys; from erls.cli.main import main; sys.exit(main())"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code, *words[1:]], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "error" not in done.stderr
    if "-o" in words:
        assert (folder / words[words.index("-o") + 1]).exists()


def test_shell_blocks_hold_only_what_is_run_here() -> None:
    """Two lines of set-up and commands of erls; nothing else can hide."""
    assert len(SETUP) == 2
    assert len(SETUP) + len(COMMANDS) == len(SHELL)
    assert SETUP[1].endswith("pip install -q -e '.[test]' && .venv/bin/pytest")


def test_first_line_does_the_main_job(folder: Path) -> None:
    """The part of the first line that follows the installation, as it stands."""
    steps = [s.strip() for s in SETUP[0].split("&&")]
    assert steps[:2] == ["python3 -m venv .venv", ".venv/bin/pip install -q -e ."]
    for step in steps[2:]:
        assert step.startswith(".venv/bin/erls ")
        _run(step, folder)
    assert (folder / "l_shape.png").stat().st_size > 10_000


def test_commands_run_in_order(folder: Path) -> None:
    """All further commands, word for word."""
    assert len(COMMANDS) >= 8
    for command in COMMANDS:
        _run(command, folder)


def test_python_example_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The Python block, with the numbers that its comments promise."""
    (block,) = _blocks("python")
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    exec(compile(block, "README.md", "exec"), names)
    run = names["run"]
    assert run.position("tip", [0.1, 0.2, 0.3]).shape == (3, 3)  # type: ignore[attr-defined]
    assert run.elastic_coordinates("l", 0.25).shape == (18,)  # type: ignore[attr-defined]
    assert (names["again"].position("tip", 0.25) == run.position("tip", 0.25)).all()  # type: ignore[attr-defined]


def test_example_scene_and_link_run(tmp_path: Path) -> None:
    """The annotated link description and scene are valid as printed, and simulate."""
    import erls

    blocks = _blocks("toml")
    link = next(b for b in blocks if "[frame.nodes]" in b)
    scene = next(b for b in blocks if 'name = "pick and place"' in b)
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "arm.toml").write_text(link, encoding="utf-8")
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    run = erls.simulate(erls.load_scene(tmp_path / "scene.toml", ["simulation.duration=0.1"]))
    assert run.end == 0.1
    fields = tomllib.loads(scene)
    assert set(fields) == {
        *("name", "gravity", "simulation", "base", "initial", "joints", "links", "points", "payloads", "events")
    }


def test_defaults_are_as_printed() -> None:
    """Fields marked #= in the annotated scene and link hold the default of the schema."""
    from erls.scene.settings import Simulation
    from fe_import.description.records import Frame, Member

    simulation = Simulation(duration=1.0)
    assert (simulation.formulation, simulation.gauge) == ("erls", "joint-angle")
    assert (simulation.rtol, simulation.atol, simulation.spectral_radius) == (1e-8, 1e-12, 0.8)
    frame = Frame(nodes={}, members=[])
    assert (frame.theory, frame.mass, frame.rotary_inertia, frame.torsion) == (
        *("timoshenko", "consistent", True, "saint-venant"),
    )
    assert Member(start="a", end="b").elements == 1


def test_drive_examples_are_valid() -> None:
    """The torque drive with every profile decodes and builds."""
    from erls.errors import SceneError
    from erls.mechanism.drives import DriveRecord, build_drive
    from fe_import.files.toml import convert

    block = next(b for b in _blocks("toml") if "sine_burst" in b)
    drive = tomllib.loads(block)["drive"]
    built = build_drive(convert(drive, DriveRecord, "README.md", SceneError), ROOT, "README.md", True)
    assert built.torque(0.1, 0.0, 0.0) != 0


@pytest.mark.parametrize("path", sorted((ROOT / "data").rglob("*.toml")), ids=lambda p: p.name)
def test_shipped_files_have_a_header_and_are_valid(path: Path) -> None:
    """Each link and scene says what it shows, and loads."""
    from erls import load_scene
    from fe_import import load_link

    text = path.read_text(encoding="utf-8")
    assert text.startswith("# ")
    if "[simulation]" in text:
        load_scene(path)
    else:
        load_link(path)


def test_picture_and_paths_exist() -> None:
    """Files that the README names are there."""
    pictures = re.findall(r"\]\((data/[^)]*)\)", README)
    places = re.findall(r"`((?:data|tests|erls|fe_import|benchmarks)/[^`*]*)`", README)
    for path in pictures + places:
        assert (ROOT / path).exists(), path
