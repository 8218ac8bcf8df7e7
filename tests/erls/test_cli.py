"""The command ``erls``: what goes to stdout and stderr, JSON, exit codes, help, start-up."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import pytest
import scenes

import erls
from erls.cli.main import main
from erls.errors import Cause
from erls.files.results import claim
from fe_import.modal.file import read_modal_file

SIMULATE = {
    "scene", "formulation", "duration", "steps", "rhs_calls", "newton_iterations", "wall_s", "energy", "samples",
    "warnings",
}  # fmt: skip
REDUCE = {
    "link", "method", "solver", "dofs", "interface_dofs", "elastic_modes", "frequencies_hz", "mass", "centre_of_mass",
    "inertia", "health", "wall_s", "peak_memory_mb", "output",
}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder with link.toml and scene.toml, and a cache that is empty."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ERLS_CACHE", str(tmp_path / "cache"))
    scenes.l_link(tmp_path)
    scenes.l_scene(tmp_path, simulation={"duration": 0.01, "step": 1e-3})
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> tuple[str, str]:
    """Stdout and stderr of a command."""
    assert main(arguments) == code
    return capsys.readouterr()


def run_json(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> tuple[dict[str, Any], str]:
    """The JSON object that is all of stdout, and stderr."""
    out, err = run(capsys, *arguments, "--json", code=code)
    assert out.count("\n") == 1
    found = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert isinstance(found, dict)
    return found, err


def test_reduce(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Modes, mass and health as text; the same as JSON with the promised keys; a modal file each."""
    out, err = run(capsys, "reduce", "link.toml")
    assert err == "reducing link.toml\n"
    for word in ("Elastic modes", "frequency [Hz]", "mass [kg]", "2.34", "Health: ok", "written to link.modal.h5"):
        assert word in out
    assert read_modal_file("link.modal.h5").elastic_modes == 18
    found, err = run_json(capsys, "reduce", "link.toml", "-o", "other.h5")
    assert err.startswith("reducing link.toml\nthe same was reduced before")
    assert set(found) >= REDUCE
    assert (found["link"], found["method"], found["output"]) == ("link", "craig-bampton", "other.h5")
    assert found["mass"] == pytest.approx(2.34)
    assert found["frequencies_hz"] == sorted(found["frequencies_hz"])
    assert len(found["frequencies_hz"]) == found["elastic_modes"] == 18
    assert found["health"]["ok"] is True
    assert all(set(c) == {"name", "value", "limit", "ok"} for c in found["health"]["checks"])
    assert (found["dofs"], found["interface_dofs"]) == (30, 12)
    assert found["peak_memory_mb"] is None or found["peak_memory_mb"] > 10
    assert Path("other.h5").read_bytes() == Path("link.modal.h5").read_bytes()


def test_reduce_options(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Method and mode count go before the description; a count alone keeps its method."""
    found, _ = run_json(capsys, "reduce", "link.toml", "--method", "none", "--modes", "3")
    assert (found["method"], found["elastic_modes"], found["dofs"]) == ("none", 3, 30)
    full, _ = run_json(capsys, "reduce", "link.toml", "--method=none")
    assert full["elastic_modes"] == 24
    assert full["frequencies_hz"][:3] == pytest.approx(found["frequencies_hz"], rel=1e-6)
    few, _ = run_json(capsys, "reduce", "link.toml", "--modes", "0")
    assert (few["method"], few["elastic_modes"], few["frequencies_hz"]) == ("craig-bampton", 0, [])


REFUSED = [
    (["reduce", "nix.toml"], "nix.toml", "file not found"),
    (["reduce", "scene.toml"], "scene.toml: simulation", "unknown field"),
    (["reduce", "link.toml", "--method", "craig"], "link.toml: reduction.method", "reference"),
    (["reduce", "link.toml", "--modes", "500"], "link.toml: reduction.elastic_modes", "mode count out of range"),
    (["reduce", "link.toml", "--modes=-1"], "link.toml: reduction.elastic_modes", "bad field"),
    (["reduce", "link.toml", "-o", "nix/x.h5"], "nix/x.h5", "file not writable"),
    (["reduce", "link.toml", "-o", "link.toml"], "link.toml", "file not writable"),
    (["reduce", "link.toml", "--modes", "many"], "command line", "bad field"),
    (["reduce"], "command line", "bad field"),
    (["simulate"], "command line", "bad field"),
    (["simulate", "scene.toml", "-o"], "command line", "bad field"),
    (["simulate", "nix.toml"], "nix.toml", "file not found"),
    (["info", "nix.h5"], "nix.h5", "file not found"),
    (["info", "."], ".", "file not readable"),
    (["info", "text.txt"], "text.txt", "syntax error"),
    (["info", "foreign.h5"], "foreign.h5", "file not readable"),
    (["info", "cut.h5"], "cut.h5", ""),
    (["info", "binary"], "binary", "file not readable"),
    (["view", "nix.h5", "-o", "x.png"], "nix.h5", "file not found"),
    (["view", "text.txt", "-o", "x.png"], "text.txt", "file not readable"),
    (["view", "foreign.h5", "-o", "x.png"], "foreign.h5", "faulty run file"),
    (["veiw", "x"], "command line", "bad field"),
    (["--frobnicate"], "command line", "bad field"),
    (["info", "link.toml", "--all"], "command line", "bad field"),
    (["simulate", "scene.toml", "extra"], "command line", "bad field"),
]


@pytest.mark.parametrize(("arguments", "where", "cause"), REFUSED, ids=[" ".join(r[0]) for r in REFUSED])
def test_refused(
    arguments: list[str], where: str, cause: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, one line on stderr, or one JSON object on stdout; nothing is written."""
    (folder / "text.txt").write_text("hello", encoding="utf-8")
    (folder / "binary").write_bytes(b"\xff\x00\xfe" * 50)
    with h5py.File(folder / "foreign.h5", "w") as f:
        f["x"] = 1.0
    (folder / "cut.h5").write_bytes((folder / "foreign.h5").read_bytes()[:100])
    before = sorted(folder.rglob("*"))
    out, err = run(capsys, *arguments, code=2)
    assert out == ""
    lines = [line for line in err.splitlines() if not line.startswith("reducing ")]
    assert len(lines) == 1
    assert lines[0].startswith(f"error: {where}: ")
    found, err = run_json(capsys, *arguments, code=2)
    assert "error" not in err
    assert list(found["error"]) == ["cause", "message", "where", "value", "limit", "remedy"]
    assert found["error"]["where"].split(": /")[0] == where
    assert cause in found["error"]["cause"]
    assert found["error"]["remedy"]
    assert sorted(folder.rglob("*")) == before


def test_simulate(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A summary with points at the end; with --json all promised keys; progress and messages on stderr only."""
    out, err = run(capsys, "simulate", "scene.toml")
    assert err == "l: reduced (link.toml)\n"
    for word in ("scene: 1 joints, 18 elastic coordinates", "generalized_alpha", "energy", "elbow", "0.5000"):
        assert word in out
    found, err = run_json(capsys, "simulate", "scene.toml", "-o", "r.h5", "--at", "0,0.005, 0.01")
    assert err == "l: reduction from the cache (link.toml)\n"
    assert set(found) >= SIMULATE
    assert (found["scene"], found["formulation"], found["duration"], found["steps"]) == ("scene", "erls", 0.01, 10)
    assert set(found["energy"]) == {"initial", "final", "max_drift"}
    assert [s["t"] for s in found["samples"]] == [0.0, 0.005, 0.01]
    assert found["samples"][0] == {
        "t": 0.0,
        "joints": {"shoulder": {"coordinate": 0.0, "angle": 0.0}},
        "points": {"elbow": [0.5, 0.0, 0.0], "tip": [0.5, 0.5, 0.0]},
    }
    assert found["output"] == "r.h5"
    assert found["warnings"] == []
    assert run_json(capsys, "simulate", "scene.toml")[0]["output"] is None
    assert sorted(p.name for p in folder.iterdir()) == ["cache", "link.toml", "r.h5", "scene.toml"]


def test_simulate_options(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """--set several times, --formulation, --at without step dependence."""
    changes = ["--set", "simulation.step=5e-4", "--set=links.l.elastic_modes=4", "--formulation", "erls"]
    found, _ = run_json(capsys, "simulate", "scene.toml", *changes, "--at", "0.0071")
    assert (found["steps"], found["elastic_coordinates"], found["formulation"]) == (20, 4, "erls")
    (sample,) = found["samples"]
    other, _ = run_json(capsys, "simulate", "scene.toml", *changes[2:], "--at", "0.0071")
    assert other["steps"] == 10
    assert other["samples"][0]["points"]["tip"] == pytest.approx(sample["points"]["tip"], abs=1e-6)


def test_the_cache_knows_content(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A changed link is reduced anew, an equal one of another name is not; damage of the cache is mended."""
    reduced, cached = "l: reduced", "l: reduction from the cache"
    assert reduced in run(capsys, "simulate", "scene.toml")[1]
    assert cached in run(capsys, "simulate", "scene.toml")[1]
    scenes.l_link(folder, 3)
    assert reduced in run(capsys, "simulate", "scene.toml")[1]
    scenes.l_link(folder)
    assert cached in run(capsys, "simulate", "scene.toml")[1]
    for entry in (folder / "cache").iterdir():
        entry.write_bytes(entry.read_bytes()[:2000])
    assert reduced in run(capsys, "simulate", "scene.toml")[1]
    assert cached in run(capsys, "simulate", "scene.toml")[1]


def test_a_cache_that_cannot_be_written_costs_time_only(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cache folder is a file."""
    (folder / "taken").write_text("", encoding="utf-8")
    monkeypatch.setenv("ERLS_CACHE", str(folder / "taken"))
    for _ in range(2):
        assert "l: reduced" in run(capsys, "simulate", "scene.toml")[1]


def test_info(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a link, a modal file in both forms, a scene and a run; the content decides, not the name."""
    run(capsys, "simulate", "scene.toml", "-o", "a.dat", "--at", "0")
    run(capsys, "reduce", "link.toml", "-o", "b.dat")
    shutil.copy("link.toml", "c.dat")
    shutil.copy("scene.toml", "d.dat")
    scenes.write_toml(folder / "p.toml", {**scenes.read_toml(folder / "link.toml"), "reduction": {"form": "physical"}})
    run(capsys, "reduce", "p.toml", "-o", "e.dat")

    link, err = run_json(capsys, "info", "c.dat")
    assert (link["file"], link["kind"], link["dofs"], link["interfaces"]) == ("link", "frame", 30, ["root", "tip"])
    assert link["mass"] == pytest.approx(2.34)
    assert "interfaces: ['root', 'tip']" in run(capsys, "info", "c.dat")[0]

    modal, _ = run_json(capsys, "info", "b.dat")
    assert modal["file"] == "modal"
    assert set(modal) >= REDUCE - {"wall_s", "peak_memory_mb", "output"}
    assert len(modal["modes"]) == 24
    assert set(modal["modes"][0]) == {"frequency_hz", "kind", "damping_ratio", "residual"}
    assert modal["full_model"]["mass"] == pytest.approx(modal["mass"])
    assert modal["provenance"]["source"] == "link.toml"
    assert "Health: ok" in run(capsys, "info", "b.dat")[0]

    physical, _ = run_json(capsys, "info", "e.dat")
    assert (physical["form"], physical["elastic_modes"], physical["frequencies_hz"]) == ("physical", None, [])
    assert "Health: ok" in run(capsys, "info", "e.dat")[0]

    scene, _ = run_json(capsys, "info", "d.dat")
    assert (scene["file"], scene["joints"][0]["name"], scene["simulation"]["duration"]) == ("scene", "shoulder", 0.01)
    out = run(capsys, "info", "d.dat")[0]
    assert "shoulder  revolute   free         l  link.toml" in out
    assert "points: elbow, tip" in out

    stored, _ = run_json(capsys, "info", "a.dat")
    assert (stored["file"], stored["failure"], stored["samples"]) == ("run", None, [])
    assert set(stored) >= SIMULATE
    assert "10 steps" in run(capsys, "info", "a.dat")[0]
    assert err == ""


def test_compare_writes_what_it_prints(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """JSON on stdout and in the file alike; a page and a table; the numbers of the page are those of the JSON."""
    arguments = ("compare", "scene.toml", "--formulations", "erls, erls-minimum-norm", "--workers", "1", "-o")
    found, _ = run_json(capsys, *arguments, "c.json")
    stored = json.loads((folder / "c.json").read_text(encoding="utf-8"))
    walls = [o["formulations"][n].pop("wall_s") for o in (found, stored) for n in ("erls", "erls-minimum-norm")]
    assert min(walls) > 0
    assert stored.pop("written_by") == "erls"
    assert found == {**stored, "output": "c.json"}
    (pair,) = found["pairs"]
    assert (pair["a"], pair["b"], pair["as_expected"]) == ("erls", "erls-minimum-norm", True)
    out, _ = run(capsys, *arguments, "c.html")
    shown = f"{pair['points']['tip']['max']:.3g}"
    assert shown in out
    assert f"<td>{shown}</td>" in (folder / "c.html").read_text(encoding="utf-8")
    run(capsys, *arguments, "c.csv")
    for name in ("c.json", "c.html", "c.csv"):
        claim(Path(name), Path(name).suffix, [])  # a result of this command, which the next may replace
    assert (folder / "c.csv").read_text(encoding="utf-8").startswith("t [s],erls: position elbow x [m]")


def test_mode_study_ends_with_4_unless_converged(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The verdict decides the exit code, in text and JSON."""
    arguments = ("study", "modes", "scene.toml", "--counts", "0,2,6,12", "--workers", "1")
    out, _ = run(capsys, *arguments, "--tolerance", "1e-12", code=4)
    assert "NOT converged" in out
    loose = ("--tolerance", "1", "--load-tolerance", "1e3", "--frequency-tolerance", "1e3", "-o", "m.html")
    found, _ = run_json(capsys, *arguments, *loose)
    assert found["converged"] == 0
    assert [p["elastic_modes"] for p in found["points"]] == [0, 2, 6, 12]
    assert "converged at 0 elastic modes" in (folder / "m.html").read_text(encoding="utf-8")


BODIES = str(scenes.ROOT / "data/statics/roll_up.toml")
FAULTY_COMMANDS = [
    (("compare", "scene.toml", "--formulations", "erls"), "needs two formulations"),
    (("compare", "scene.toml", "--formulations", "erls,adams"), "adams"),
    (("compare", "scene.toml", "-o", "c.pdf"), "ending of the report"),
    (("compare", "scene.toml", "-o", "no/such/c.html"), "no folder"),
    (("study", "modes", "scene.toml", "--counts", "1,two"), "whole numbers"),
    (("study", "modes", "scene.toml", "--beside", "none.csv"), "none.csv"),
    (("study", "modes", "scene.toml", "--tolerance", "0"), "tolerance"),
    (("study", "modes", "scene.toml", "--tolerance", "nan"), "tolerance"),
    (("compare", "scene.toml", "--workers", "0"), "workers"),
    *((command, "simulate_many") for command in (("compare", BODIES), ("study", "modes", BODIES),
                                                 ("study", "cost", BODIES), ("effects", BODIES))),
]


@pytest.mark.parametrize(("arguments", "words"), FAULTY_COMMANDS)
def test_faulty_commands_of_studies(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: str
) -> None:
    """One message, nothing on stdout, nothing written."""
    before = sorted(p.name for p in folder.iterdir())
    out, err = run(capsys, *arguments, code=2)
    assert out == ""
    assert words in err.splitlines()[-1]
    assert sorted(p.name for p in folder.iterdir() if p.name != "cache") == [n for n in before if n != "cache"]


def test_out_of_memory(folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """One line and exit code 3."""

    def full(*_: Any, **__: Any) -> None:
        raise MemoryError

    monkeypatch.setattr("erls.simulation.chains.build_mechanism", full)
    _, err = run(capsys, "simulate", "scene.toml", "-o", "r.h5", code=3)
    assert err.startswith("error: out of memory; ")
    found, _ = run_json(capsys, "simulate", "scene.toml", code=3)
    assert found["error"]["cause"] == str(Cause.OUT_OF_MEMORY)
    assert found["error"]["remedy"]


def test_interrupted_before_the_run(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit code 130, and JSON where JSON was asked for."""

    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("erls.simulation.chains.build_mechanism", interrupt)
    assert run(capsys, "simulate", "scene.toml", code=130) == ("", "error: interrupted; start again\n")
    found, _ = run_json(capsys, "simulate", "scene.toml", code=130)
    assert found["error"]["cause"] == str(Cause.INTERRUPTED)


def test_progress_goes_to_stderr(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plain lines every few seconds where stderr is no terminal."""
    clock = iter(range(0, 100000, 6))
    monkeypatch.setattr("erls.cli.terminal.time.monotonic", lambda: next(clock))
    _, err = run_json(capsys, "simulate", "scene.toml")
    shares = [float(s) for s in re.findall(r"^simulating: (\d+) %$", err, re.MULTILINE)]
    assert shares == sorted(shares)
    assert len(shares) == 10
    assert shares[-1] == 100


# the real executable

ERLS = shutil.which("erls", path=str(Path(sys.executable).parent)) or shutil.which("erls")


def execute(*arguments: str, **settings: Any) -> subprocess.CompletedProcess[str]:
    command = [ERLS] if ERLS else [sys.executable, "-c", "import sys; from erls.cli.main import main; sys.exit(main())"]
    return subprocess.run([*command, *arguments], capture_output=True, text=True, timeout=60, **settings)


def test_every_command_for_real(folder: Path) -> None:
    """In processes of their own, one after the other."""
    found = execute("reduce", "link.toml", "--json")
    assert (found.returncode, found.stderr) == (0, "reducing link.toml\n")
    assert json.loads(found.stdout)["elastic_modes"] == 18
    found = execute("simulate", "scene.toml", "-o", "r.h5", "--json")
    assert (found.returncode, found.stderr) == (0, "l: reduction from the cache (link.toml)\n")
    assert json.loads(found.stdout)["steps"] == 10
    found = execute("info", "r.h5")
    assert (found.returncode, found.stderr) == (0, "")
    assert "10 steps" in found.stdout
    found = execute("view", "nix.h5")
    assert (found.returncode, found.stdout) == (2, "")
    assert found.stderr == "error: nix.h5: no such file; check the path\n"
    found = execute("simulate", "nix.toml", "--json")
    assert found.returncode == 2
    assert json.loads(found.stdout)["error"]["cause"] == "file not found"


def test_a_reader_who_has_enough_is_no_error(folder: Path) -> None:
    """As in ``erls info link.toml | true``; and nobody listening to messages does not end a run."""
    reader, writer = os.pipe()
    os.close(reader)
    command = "import sys; from erls.cli.main import main; sys.exit(main())"
    for arguments, pipe in ((["info", "link.toml"], "stdout"), (["simulate", "scene.toml", "-o", "r.h5"], "stderr")):
        streams: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, pipe: writer}
        done = subprocess.run([sys.executable, "-c", command, *arguments], timeout=60, **streams)
        assert done.returncode == 0
        assert not done.stderr
    os.close(writer)
    assert (folder / "r.h5").exists()


def test_how_much_is_told(capsys: pytest.CaptureFixture[str], folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    """All, with the time, or errors and warnings alone; and what a command reduced, another one finds."""
    assert main(["reduce", "link.toml", "--verbose"]) == 0
    assert re.match(r" +\d\.\d{3} s  reducing link\.toml\n", capsys.readouterr().err)
    assert main(["simulate", "scene.toml", "--set", "simulation.duration=0.001"]) == 0
    assert "reduction from the cache" in capsys.readouterr().err
    assert main(["reduce", "link.toml", "-o", "again.h5"]) == 0
    assert "reduced before" in capsys.readouterr().err
    for words, code in ((["simulate", "scene.toml"], 0), (["simulate", "none.toml"], 2)):
        assert main([*words, "--set", "simulation.duration=0.001", "--quiet"]) == code
        err = capsys.readouterr().err
        assert [line.partition(":")[0] for line in err.splitlines()] == (["error"] if code else [])
    with caplog.at_level("INFO", logger="erls"):
        erls.simulate(erls.load_scene("scene.toml", ["simulation.duration=0.001"]), verdict=False)
    assert any("reduction from the cache" in text for text in caplog.messages)
