"""Studies that were ended: what they had finished is found again, whatever ended them, and not computed twice."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import ROOT

from erls.cli.main import main
from erls.errors import Cause, SceneError, SimulationError
from erls.studies import compare, cost, mode_count
from erls.studies.kept import Kept, KeptRuns, State, keeping
from erls.studies.ladder import CostPoint, Setting, failed
from erls.studies.pool import Finished, run_all
from fe_import.errors import Cause as FECause
from fe_import.errors import FEImportError, ReportedError

SCENE = ROOT / "data/l_shape/steel_tall.toml"
SHORT = ["--set", "simulation.duration=0.01"]
COARSE = [*SHORT, "--tolerance", "1e-3"]
STUDIES: dict[str, tuple[Any, str, int, list[str]]] = {
    "modes": (mode_count, "_run", 3, ["study", "modes", str(SCENE), "--counts", "2,6,8", *SHORT]),
    "compare": (compare, "_run", 2, ["compare", str(SCENE), "--formulations", "erls,ffr", *SHORT]),
    "cost": (cost, "climb", 3, ["study", "cost", str(SCENE), "--formulations", "erls", "--integrators", "lobatto",
                             "--effects", "all", "--modes", "2,6,8", "--reference", "tight", *COARSE]),
}  # fmt: skip

_KILLED = """
import os, signal, sys
from erls.cli.main import main
from erls.studies.kept import KeptRuns

keep = KeptRuns.keep
def once(self, one):
    keep(self, one)
    os.kill(os.getpid(), signal.SIGKILL)
KeptRuns.keep = once
main(sys.argv[1:])
"""


def without_times(told: Any) -> Any:
    """A report without what clocks say."""
    if isinstance(told, dict):
        kept = {key: value for key, value in told.items() if not key.endswith("_s") and key != "output"}
        return {key: without_times(value) for key, value in kept.items()}
    return [without_times(value) for value in told] if isinstance(told, list) else told


@pytest.mark.parametrize("study", STUDIES)
def test_kill_9_loses_no_finished_run(
    study: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The first run is kept, and the others are made; the report is that of a study that nobody ended, and
    that of another one with all three kept, to the byte.
    """
    module, name, runs, command = STUDIES[study]
    command = [*command, "--workers", "1", "--json"]
    state = ["--state", str(tmp_path / "r.study")]
    assert subprocess.run([sys.executable, "-c", _KILLED, *command, *state], cwd=ROOT).returncode == -signal.SIGKILL
    made: list[Any] = []
    work: Callable[[Any], Any] = getattr(module, name)
    monkeypatch.setattr(module, name, lambda task: (made.append(task), work(task))[1])

    def report(*more: str) -> str:
        made.clear()
        capfd.readouterr()
        assert main([*command, *more]) in (0, 4)
        return capfd.readouterr().out

    resumed = report(*state, "--resume")
    assert len(made) == runs - 1
    assert report(*state, "--resume") == resumed
    assert not made
    assert main([*command, *state]) == 2  # a file with results is not replaced by chance
    if study != "cost":  # whose reference and choice of a cheapest setting hang on clocks
        assert without_times(json.loads(report())) == without_times(json.loads(resumed))
        assert len(made) == runs


def test_other_settings_and_other_files_are_other_runs(tmp_path: Path) -> None:
    """Keys are all that a run depends on; a result of another form is computed anew."""
    scene = tmp_path / "scene.toml"
    scene.write_bytes((ROOT / "data/statics/roll_up.toml").read_bytes())
    state = State(tmp_path / "r.study", resume=True)
    with keeping(state, scene, []) as kept:
        kept.keep(("modes", 1), 2.5)
        assert kept.find(("modes", 1), float) == (2.5, None)
        assert kept.find(("modes", 1), str) is None
        assert kept.find(("modes", 2), float) is None
    scene.write_text(scene.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    with keeping(state, scene, []) as kept:
        assert kept.find(("modes", 1), float) is None
    with pytest.raises(SceneError, match="1 finished"), keeping(State(state.path), scene, []):
        pass
    with keeping(State(state.path, force=True), scene, []) as kept:
        assert kept.results is not None
        assert kept.results.held() == 0


@pytest.mark.parametrize(
    "problem",
    [
        SceneError(Cause.BAD_FIELD, "no good", where="a.b", value=[1, 2.5], limit=np.float64(3.0), remedy="mend it"),
        SimulationError(Cause.RUNAWAY, "gone", where="t = 1 s", value="3 m"),
        FEImportError(FECause.MESH, "torn", value=None),
    ],
)
def test_failures_come_back_as_they_were(problem: ReportedError, tmp_path: Path) -> None:
    """Kind, cause and words; points of ladders with theirs, and with what is not a number."""
    setting = Setting("erls", "lobatto", "all", None, "tolerance", 1e-4)
    with keeping(State(tmp_path / "r.study"), SCENE, []) as kept:
        kept.keep("failure", None, problem)
        found = kept.find("failure", float)
        assert found is not None
        again = found[1]
        kept.keep("ladder", [failed(setting, problem)])
        ladder = kept.find("ladder", list[CostPoint])
    assert type(again) is type(problem)
    assert (again.cause, str(again)) == (problem.cause, str(problem))  # type: ignore[union-attr]
    assert ladder is not None
    (point,) = ladder[0]
    assert point.setting == setting
    assert np.isnan(point.error)
    assert str(point.failure) == str(problem)


def _third(number: int) -> float:
    if number == 0:
        raise SimulationError(Cause.OUT_OF_MEMORY, "a worker died")
    return number / 3


def test_what_may_go_well_another_time_is_tried_again(tmp_path: Path) -> None:
    """Workers that died, budgets that ended; arrays of results are their own, not views that cannot be written to."""
    with keeping(State(tmp_path / "r.study"), SCENE, []) as kept:
        runs = KeptRuns(kept, [0, 1, 2], float, lasting=lambda result: result < 0.5)
        first, _ = run_all(_third, [0, 1, 2], workers=1, known=runs)
        assert [one.number for one in runs.found()] == [1]
        second, complete = run_all(_third, [0, 1, 2], workers=1, known=runs)
        kept.keep("array", np.arange(3.0))
        found = kept.find("array", np.ndarray)
    assert complete
    assert [(one.number, one.result) for one in first] == [(one.number, one.result) for one in second]
    assert found is not None
    found[0][0] = 1.0


def test_nothing_is_kept_without_a_file() -> None:
    """Nor looked for."""
    kept = Kept(None, "")
    kept.keep(1, 2)
    assert kept.find(1, int) is None
    assert KeptRuns(kept, [1], int).found() == []
    KeptRuns(kept, [1], int).keep(Finished(0, 2, None))


def test_words_of_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is missing, or of the wrong ending, is named."""
    command = ["compare", str(SCENE)]
    assert main([*command, "--resume"]) == 2
    assert "--state" in capsys.readouterr().err
    assert main([*command, "--state", str(tmp_path / "r.txt")]) == 2
    assert ".study" in capsys.readouterr().err
    assert main([*command, str(SCENE), "--state", str(tmp_path / "r.study")]) == 2
    assert "one by one" in capsys.readouterr().err
