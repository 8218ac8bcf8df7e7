"""Runs for which memory does not suffice: what was computed is kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

from erls.cli.main import main
from erls.errors import Cause, SimulationError
from erls.integrate.driver import Recorder
from erls.run.file import load_run
from erls.run.watches.base import Watch
from erls.simulation.simulate import simulate
from fe_import.files.hdf5 import values

_STORE = Recorder._store


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """2000 steps, half of which find room here."""
    scenes.l_link(tmp_path)
    return scenes.l_scene(tmp_path, simulation={"duration": 0.02, "step": 1e-5})


def _full(self: Recorder, t: Any, rows: Any, steps: int, rest: Any) -> None:
    if self._kept[0] + len(t) > 1000:
        raise MemoryError
    _STORE(self, t, rows, steps, rest)


def test_a_motion_that_outgrows_memory_is_kept(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 3; the file holds the motion up to there, with the states of a run that had the memory."""
    whole = simulate(scene, verdict=False)

    def look(self: Watch, *arguments: Any) -> Any:
        pytest.fail("there is no memory to look with")

    monkeypatch.setattr(Recorder, "_store", _full)
    monkeypatch.setattr(Watch, "after", look)
    monkeypatch.setattr(Watch, "ends", look)
    monkeypatch.setattr(values, "_BLOCK", 1000)  # arrays of this size are large now
    output = scene.with_name("r.h5")
    assert main(["simulate", str(scene), "-o", str(output)]) == 3
    out, err = capsys.readouterr()
    assert out == ""
    assert f"is in {output}" in err
    assert err.splitlines()[-1].startswith("error: t = ")
    assert "out of memory; the motion up to this time was kept" in err
    run = load_run(output)
    assert run.failure is not None
    assert run.failure.cause == Cause.OUT_OF_MEMORY
    assert 3e-4 < run.end < 0.0101  # a chunk of steps finds room as a whole, or not at all
    at = np.linspace(0.0, run.end, 7)
    np.testing.assert_array_equal(run.position("tip", at), whole.position("tip", at))


@pytest.mark.parametrize(
    ("problem", "cause"), [(MemoryError, Cause.OUT_OF_MEMORY), (KeyboardInterrupt, Cause.INTERRUPTED)]
)
def test_a_finished_motion_is_kept(
    problem: type[BaseException], cause: Cause, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where its error cannot be found: for lack of memory, or because somebody does not want to wait."""

    def fail(run: Any) -> Any:
        raise problem

    monkeypatch.setattr("erls.accuracy.statement.stated", fail)
    with pytest.raises(SimulationError) as caught:
        simulate(scene)
    assert caught.value.cause == cause
    assert caught.value.run.end == 0.02
    assert caught.value.run.failure is None
    output = scene.with_name("r.h5")
    assert main(["simulate", str(scene), "-o", str(output)]) == caught.value.exit_code
    assert load_run(output).end == 0.02
