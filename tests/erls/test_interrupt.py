"""Processes that are stopped: what was computed is kept, what is half done disappears."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import scenes

from erls.errors import Cause
from erls.run.file import load_run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX systems")

# tells when a reduction starts and when the first step is done, so that tests need not guess
START = """
import sys
import erls.scene.build
import erls.run.watches.checkpoint
from erls.cli.main import main
from erls.cli.terminal import Progress

erls.run.watches.checkpoint.FIRST_S = {checkpoint}
advance = Progress.advance

def tell(self, done, total):
    Progress.advance = advance
    print("stepping", file=sys.stderr, flush=True)
    advance(self, done, total)

reduce_cached = erls.scene.build.reduce_cached

def tell_reduction(*given, **named):
    print("reducing", file=sys.stderr, flush=True)
    return reduce_cached(*given, **named)

Progress.advance, erls.scene.build.reduce_cached = tell, tell_reduction
sys.exit(main())
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scene that would take minutes: a hundred million steps."""
    scenes.l_link(tmp_path)
    scenes.l_scene(tmp_path, simulation={"duration": 100.0, "step": 1e-6, "output_step": 1e-4})
    return tmp_path


def start(folder: Path, *arguments: str, checkpoint: float = 20.0) -> subprocess.Popen[str]:
    """A process in ``folder``."""
    command = [sys.executable, "-c", START.format(checkpoint=checkpoint), *arguments]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait(process: subprocess.Popen[str], word: str) -> None:
    """Until the process says ``word``."""
    assert process.stderr is not None
    for line in process.stderr:
        if word in line:
            return
    pytest.fail("the process ended early")


def until(condition: Callable[[], bool]) -> None:
    for _ in range(2000):
        if condition():
            return
        time.sleep(0.01)
    pytest.fail("waited too long")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_simulation_keeps_what_it_computed(folder: Path, number: int) -> None:
    """Ctrl-C and a polite kill: exit code 130, a run file that loads, the last checkpoint; one JSON object."""
    process = start(folder, "simulate", "scene.toml", "-o", "r.h5", "--json", checkpoint=0.2)
    wait(process, "stepping")
    until(lambda: (folder / "r.h5.partial").exists())
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert json.loads(out)["error"]["cause"] == str(Cause.INTERRUPTED)
    assert out.count("\n") == 1
    assert "what was computed, up to t = " in err
    assert "Traceback" not in err
    assert "erls simulate scene.toml --resume r.h5 goes on" in err
    assert sorted(p.name for p in folder.iterdir()) == ["link.toml", "r.h5", "r.h5.partial", "scene.toml"]
    run = load_run(folder / "r.h5")
    assert run.failure is not None
    assert run.failure.cause == Cause.INTERRUPTED
    assert 0 < run.end < 1.0
    # a signal may come after a step's knot was added and before the step was counted
    assert run.end == pytest.approx(1e-6 * run.solution.work.steps, abs=1.1e-6)
    assert run.position("tip", run.end)[2] < 0


def test_a_stopped_simulation_without_output_says_so(folder: Path) -> None:
    """Nothing was kept, and how it would have been."""
    process = start(folder, "simulate", "scene.toml")
    wait(process, "stepping")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (130, "")
    assert "give -o RUN.h5" in err
    assert "kept" not in err
    assert sorted(p.name for p in folder.iterdir()) == ["link.toml", "scene.toml"]


def test_a_killed_simulation_leaves_its_checkpoint(folder: Path) -> None:
    """SIGKILL after a checkpoint: a partial file that loads; the output does not exist.

    A kill in the middle of writing the next one may leave a hidden temporary file.
    """
    process = start(folder, "simulate", "scene.toml", "-o", "r.h5", checkpoint=0.3)
    until(lambda: (folder / "r.h5.partial").exists())
    process.kill()
    process.communicate(timeout=30)
    assert process.returncode == -signal.SIGKILL
    visible = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    assert visible == ["link.toml", "r.h5.partial", "scene.toml"]
    run = load_run(folder / "r.h5.partial")
    assert run.failure is not None
    assert "unfinished" in str(run.failure)
    assert 0 < run.end < 1.0


def test_a_stopped_reduction_leaves_nothing(folder: Path) -> None:
    """Ctrl-C while a large link is reduced."""
    scenes.l_link(folder, 3000)
    process = start(folder, "reduce", "link.toml", "-o", "l.modal.h5", "--modes", "4")
    wait(process, "reducing")
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, "", "error: interrupted; start again\n")
    assert sorted(p.name for p in folder.iterdir()) == ["link.toml", "scene.toml"]


def test_a_stopped_reduction_on_the_fly_leaves_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a run nor half a cache entry."""
    monkeypatch.setenv("ERLS_CACHE", str(folder / "cache"))
    scenes.l_link(folder, 3000)
    process = start(folder, "simulate", "scene.toml", "-o", "r.h5")
    wait(process, "reducing")
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err.splitlines()[-1].startswith("error: ")
    assert not [p for p in folder.rglob("*") if p.suffix in (".h5", ".tmp", ".partial")]


@pytest.mark.skipif(os.environ.get("ERLS_JIT") == "0", reason="nothing is compiled")
def test_a_kill_while_kernels_are_compiled(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 130; neither a run nor half a file of compiled code."""
    monkeypatch.setenv("ERLS_KERNELS", str(folder / "kernels"))
    process = start(folder, "simulate", "scene.toml", "-o", "r.h5")
    wait(process, "compiling the equations")  # before that some are compiled as modules are imported
    before = len([*(folder / "kernels").rglob("*.nbc")])
    until(lambda: len([*(folder / "kernels").rglob("*.nbc")]) > before)
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err.splitlines()[-1] == "error: interrupted; start again"
    assert "Traceback" not in err
    assert sorted(p.name for p in folder.iterdir()) == ["kernels", "link.toml", "scene.toml"]
    assert {p.suffix for p in (folder / "kernels").rglob("*") if p.is_file()} <= {".nbc", ".nbi"}
