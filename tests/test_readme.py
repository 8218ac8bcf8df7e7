"""Every command and example of the README runs, and its facts about the repository hold."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from pages import PAGES, ROOT, blocks, run, shell_lines

README = PAGES["README.md"]
SHELL = shell_lines("README.md")
SETUP = [line for line in SHELL if line.startswith("python3 -m venv")]
COMMANDS = [line for line in SHELL if line.startswith("erls ")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that looks like a checkout to the commands."""
    path = tmp_path_factory.mktemp("readme")
    shutil.copytree(ROOT / "data", path / "data")
    return path


def test_it_is_short() -> None:
    """What is longer belongs into docs."""
    assert README.count("\n") <= 220


def test_shell_blocks_hold_only_what_is_run_here() -> None:
    """Two lines of set-up and commands of erls; nothing else can hide."""
    assert len(SETUP) == 2
    assert len(SETUP) + len(COMMANDS) == len(SHELL)
    assert SETUP[1].endswith("pip install -q -e '.[test]' && .venv/bin/pytest")


def test_first_line_does_the_main_job(folder: Path) -> None:
    """The part of the first line that follows the installation, as it stands."""
    steps = [s.strip() for s in SETUP[0].split("&&")]
    assert steps[:2] == ["python3 -m venv .venv", ".venv/bin/pip install -q -e '.[view]'"]
    for step in steps[2:]:
        assert step.startswith(".venv/bin/erls ")
        run(step, folder)
    assert (folder / "l_shape.png").stat().st_size > 10_000


def test_commands_run_in_order(folder: Path) -> None:
    """All further commands, word for word."""
    assert len(COMMANDS) >= 3
    for command in COMMANDS:
        run(command, folder)


def test_python_example_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The Python block, with the numbers that its comments promise."""
    (block,) = blocks("README.md", "python")
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    exec(compile(block, "README.md", "exec"), names)
    run = names["run"]
    assert run.position("tip", [0.1, 0.2, 0.3]).shape == (3, 3)  # type: ignore[attr-defined]
    assert run.elastic_coordinates("l", 0.25).shape == (18,)  # type: ignore[attr-defined]
    assert (names["again"].position("tip", 0.25) == run.position("tip", 0.25)).all()  # type: ignore[attr-defined]


def test_example_scene_and_link_run(tmp_path: Path) -> None:
    """The link description and the scene are valid as printed, and simulate."""
    import erls

    link, scene = blocks("README.md", "toml")
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "arm.toml").write_text(link, encoding="utf-8")
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    assert erls.simulate(erls.load_scene(tmp_path / "scene.toml", ["simulation.duration=0.01"])).end == 0.01


@pytest.mark.parametrize("path", sorted((ROOT / "data").rglob("*.toml")), ids=lambda p: p.name)
def test_shipped_files_have_a_header_and_are_valid(path: Path) -> None:
    """Each link, scene and problem says what it shows, and loads."""
    from erls import load_scene
    from erls.optimization.problem import load_problem
    from fe_import import load_link

    text = path.read_text(encoding="utf-8")
    assert text.startswith("# ")
    if "[simulation]" in text:
        load_scene(path)
    elif "[[variables]]" in text:
        load_problem(path)
    else:
        load_link(path)
