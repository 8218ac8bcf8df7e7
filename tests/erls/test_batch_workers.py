"""Runs that come from worker processes are those of this process; so are their failures."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scenes
from pool_work import process, square

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.parallel.crew import Crew, reported
from erls.parallel.workers import IDLE, Idle, Worker
from erls.run.chain.run import ChainRun
from erls.simulation.batch import _run, _Task
from erls.simulation.packed_run import LaterRun, PackedRun, packed
from erls.simulation.variants import Variants
from erls.studies.pool import run_all
from fe_import.errors import ReportedError

DATA = scenes.ROOT / "data"
SHORT = "simulation.duration=0.01"


@pytest.fixture
def early(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers come after the first variant, however short, and have taken one before this process goes on."""
    start = Crew.start

    def start_and_wait(self: Crew, count: int) -> None:
        start(self, count)
        while self.members and self.waiting and not self.given:
            time.sleep(0.01)

    monkeypatch.setattr("erls.simulation.batch._START_S", 0.0)
    monkeypatch.setattr("erls.simulation.batch._READY_S", 0.0)
    monkeypatch.setattr(Crew, "start", start_and_wait)


def elsewhere(scene: Path, variants: list[list[str]]) -> list[tuple[ReportedError | None, PackedRun | None]]:
    """Every variant from a worker."""
    crew = Crew(_run, [_Task(str(scene), scene, overrides) for overrides in variants])
    crew.start(1)
    found = {}
    while crew.members or crew.given:
        for answer in crew.answers(0.2):
            assert reported(answer) is None
            found[answer.number] = answer.result
    return [found[k] for k in range(len(variants))]


def same(run: ChainRun, other: ChainRun) -> None:
    """To the bit; coordinates of modes that follow statically to rounding."""
    to = 0.0 if run.scene.record.simulation.bandwidth is None else 1e-9
    for name in ("t", "y", "v", "a"):
        one, two = getattr(run.solution, name), getattr(other.solution, name)
        np.testing.assert_allclose(one, two, rtol=to, atol=to * np.abs(two).max(initial=0.0))
    assert (run.warnings, run.scene) == (other.warnings, other.scene)
    assert run.solution.work == other.solution.work
    at = np.linspace(0.0, run.end, 3)
    for point in other.point_names:
        np.testing.assert_allclose(run.position(point, at), other.position(point, at), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("scene", "variants"),
    [
        (
            "l_shape/steel_tall.toml",
            [
                [],
                ["links.l.elastic_modes=6"],
                ["simulation.formulation=ffr"],
                ["simulation.formulation=nodal", "simulation.step=1e-3"],
                ["simulation.formulation=ffr", "links.l.substructures=2", "simulation.step=1e-3"],
                ["effects=auto"],
                ["simulation.bandwidth=200.0"],
                ["simulation.gauge=minimum-norm", "simulation.step=1e-3"],
            ],
        ),
        ("robot/two_link.toml", [["simulation.step=1e-3"], ["payloads=[]", "effects=all", "simulation.step=1e-3"]]),
        ("four_bar/flexible.toml", [["simulation.step=1e-3"]]),
    ],
)
def test_runs_of_workers_are_those_of_this_process(scene: str, variants: list[list[str]]) -> None:
    """Formulations, effects, modes that follow statically, split links, loops."""
    here = Variants(DATA / scene)
    variants = [[SHORT, *overrides] for overrides in variants]
    for overrides, (problem, sent) in zip(variants, elsewhere(DATA / scene, variants), strict=True):
        assert problem is None
        assert sent is not None
        run = here.run(overrides, lambda t, duration: None)
        assert isinstance(run, ChainRun)
        came = here.unpacked(sent)
        same(came, run)
        links = zip(came.formulation.mechanism.links, run.formulation.mechanism.links, strict=True)
        assert sent.scene.record.simulation.bandwidth or all(a.model is b.model for a, b in links)


def test_a_run_that_came_serves_like_one_made_here(early: None, tmp_path: Path) -> None:
    """Positions, energies, reactions, events of a copy, files; it knows its equations when it is asked."""
    variants = [[SHORT, f"joints.0.initial.position_deg={angle}"] for angle in range(4)]
    runs = erls.simulate_many(DATA / "l_shape/steel_tall.toml", variants, workers=2)
    alone = erls.simulate_many(DATA / "l_shape/steel_tall.toml", variants, workers=1)
    assert [type(run) for run in alone] == [ChainRun] * 4
    came = next(k for k, run in enumerate(runs) if isinstance(run, LaterRun))
    run, other = runs[came], alone[came]
    assert isinstance(run, LaterRun)
    assert isinstance(other, ChainRun)
    assert "formulation" not in vars(run)
    assert run.end == other.end
    assert "formulation" not in vars(run)
    assert replace(run, wall_s=other.wall_s).summary([0.01]) == replace(other, scene=run.scene).summary([0.01])
    np.testing.assert_array_equal(run.reaction("shoulder", 0.01)[0], other.reaction("shoulder", 0.01)[0])
    with pytest.raises(AttributeError, match="colour"):
        _ = run.colour
    erls.save_run(tmp_path / "a.run.h5", run)
    same(erls.load_run(tmp_path / "a.run.h5"), replace(other, scene=erls.load_run(tmp_path / "a.run.h5").scene))
    for one, two in zip(runs, alone, strict=True):
        assert isinstance(one, ChainRun)
        assert isinstance(two, ChainRun)
        same(one, two)


def test_failures_come_as_values(early: None) -> None:
    """Bad input, and a run that ends early with what was computed of it, in the order of the variants."""
    fails = [SHORT, "simulation.step=1e-3", "gravity=[0.0, 0.0, -1e9]"]
    variants = [[SHORT], ["simulation.duration=x"], [SHORT, "links.l.elastic_modes=999"], fails, [SHORT], fails]
    seen: list[tuple[float, float]] = []
    results = erls.simulate_many(
        DATA / "l_shape/steel_tall.toml", variants, workers=2, progress=lambda *at: seen.append(at)
    )
    alone = erls.simulate_many(DATA / "l_shape/steel_tall.toml", variants, workers=1)
    assert [type(r) if isinstance(r, ReportedError) else ChainRun for r in results] == [
        ChainRun, SceneError, SceneError, SimulationError, ChainRun, SimulationError,
    ]  # fmt: skip
    for one, two in zip(results, alone, strict=True):
        if isinstance(one, ReportedError) and isinstance(two, ReportedError):
            assert one.as_dict() == two.as_dict()
    for k in (3, 5):
        run = results[k].run
        assert run.failure is not None
        assert run.failure.cause == results[k].cause
        np.testing.assert_array_equal(run.solution.y, alone[k].run.solution.y)
    assert [done for done, _ in seen] == [1, 2, 3, 4, 5, 6]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX systems")
def test_an_interrupt_reaches_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while this process and a worker are at a long run each: both are kept as far as they came."""
    long = ["simulation.duration=1000", "simulation.step=1e-3"]
    monkeypatch.setattr("erls.simulation.batch._START_S", 0.1)
    lead = Crew._exchange

    def then_interrupt(self: Crew, *given: object) -> None:
        threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        lead(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Crew, "_exchange", then_interrupt)
    results = erls.simulate_many(DATA / "robot/two_link.toml", [[SHORT], long, long, long], workers=2)
    monkeypatch.undo()
    assert isinstance(results[0], ChainRun)
    assert [r.cause for r in results[1:]] == [Cause.INTERRUPTED] * 3
    ends = [getattr(r.run, "end", 0.0) for r in results[1:]]
    assert min(ends[:2]) > 0
    assert ends[2] == 0
    again = erls.simulate_many(DATA / "robot/two_link.toml", [[SHORT]] * 2, workers=2)
    assert all(isinstance(r, ChainRun) for r in again)


def test_a_worker_that_dies_loses_one_task() -> None:
    finished, complete = run_all(square, [2, 99, 3, 4, 5], workers=2)
    assert complete
    assert [f.result for f in finished] == [4, None, 9, 16, 25]
    assert finished[1].error is not None
    assert finished[1].error.cause == Cause.OUT_OF_MEMORY


def test_workers_that_die_before_they_had_a_task_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even then does this process do what could end it."""
    take, dying = Idle.take, iter([True, True])

    def taken(self: Idle) -> Worker:
        worker = take(self)
        if next(dying, False):
            worker.process.kill()
        return worker

    monkeypatch.setattr(Idle, "take", taken)
    finished, complete = run_all(process, [1, 2, 3], workers=2)
    assert complete
    assert len(finished) == 3
    assert os.getpid() not in [f.result for f in finished]


def test_workers_stay_until_they_do_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker serves again; with other settings in the environment a new one comes; dismissed ones are gone."""
    run_all(square, [1, 2], workers=2)
    some = [worker.process.pid for worker in IDLE.workers]
    run_all(square, [1, 2], workers=2)
    assert [worker.process.pid for worker in IDLE.workers if worker.process.pid in some]
    monkeypatch.setenv("ERLS_CACHE", "elsewhere")
    assert IDLE.usable() == 0
    run_all(square, [1, 2], workers=2)
    gone = list(IDLE.workers)
    assert gone
    assert {worker.process.pid for worker in gone}.isdisjoint(some)
    IDLE.dismiss()
    assert all(worker.process.returncode is not None for worker in gone)
    assert IDLE.usable() == 0


SCRIPT = """
import sys, time
open("starts", "a").write("once ")
import erls, erls.simulation.batch
from erls.parallel.crew import Crew
from erls.simulation.packed_run import LaterRun
from erls.studies.pool import run_all

start = Crew.start
def start_and_wait(self, count):
    start(self, count)
    while self.members and self.waiting and not self.given:
        time.sleep(0.01)

Crew.start, erls.simulation.batch._START_S = start_and_wait, 0.0
runs = erls.simulate_many(sys.argv[1], [["simulation.duration=0.01"]] * 6, workers=2)
print(sum(isinstance(run, LaterRun) for run in runs), len({float(run.position("tip", 0.01)[2]) for run in runs}))
print([done.result for done in run_all(abs, [-1, -2, -3], workers=2)[0]])
"""


@pytest.mark.parametrize("piped", [False, True], ids=["file", "standard input"])
def test_scripts_need_no_guard(tmp_path: Path, piped: bool) -> None:
    """A script without ``if __name__ == "__main__"`` runs once, and so does one that is no file."""
    (tmp_path / "script.py").write_text(SCRIPT)
    result = subprocess.run(
        [sys.executable, "-" if piped else "script.py", str(DATA / "l_shape/steel_tall.toml")],
        input=SCRIPT if piped else None,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert result.returncode == 0, result.stderr
    came, places = result.stdout.splitlines()[0].split()
    assert int(came) >= 1
    assert places == "1"
    assert result.stdout.splitlines()[1] == "[1, 2, 3]"
    assert result.stderr == ""
    assert (tmp_path / "starts").read_text() == "once "


def test_a_run_is_packed_without_its_equations() -> None:
    run = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", [SHORT]))
    assert set(vars(packed(run))) == {
        *("scene", "solution", "wall_s", "warnings", "certificate", "accuracy", "trust")
    }
