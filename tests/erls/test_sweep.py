"""Sweeps: any executor, what is kept and gone on with."""

from __future__ import annotations

import csv
import json
import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import ROOT
from sweep_cases import ANGLE, GET, GRID, SCENE, SHORT, TOLERANCE, height

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError, SimulationError
from erls.files.results import claim
from erls.report.sweep_table import sweep_text, write_sweep_table
from erls.run.record import Run
from erls.studies.sweep import sweep as engine
from erls.studies.sweep.points import Grid
from erls.studies.sweep.store import Row, Store
from erls.studies.sweep.sweep import Sweep


def swept(**more: Any) -> Sweep:
    """The small grid."""
    return erls.sweep(SCENE, GRID, GET, **{"overrides": SHORT, "workers": 1, **more})


@pytest.fixture(scope="module")
def alone() -> np.ndarray:
    """(6, 4) the same numbers from runs one by one."""
    rows = []
    for number in range(6):
        values = dict(zip(GRID, Grid(GRID).row(number), strict=True))
        run = erls.simulate(erls.load_scene(SCENE, [*SHORT, *(f"{k}={v}" for k, v in values.items())]), verdict=False)
        # asked for together, as sweeps do: the last bit of a product of matrices may depend on their number of rows
        places = run.position("tip", [0.0, *np.linspace(0.0, run.end, 1001)])
        far = np.linalg.norm(places[1:] - places[0], axis=1).max()
        rows.append(
            [run.position("tip", run.end)[0], far, run.joint_angle("shoulder", 0.005), run.energy(run.end).total]
        )
    return np.array(rows, dtype=float)


# ----- executors


@pytest.fixture(params=["two workers", "threads", "processes", "dask"])
def executor(request: pytest.FixtureRequest) -> Iterator[dict[str, Any]]:
    """Everyone who may compute (loky: `benchmarks/sweep.py`)."""
    kind = request.param
    if kind == "two workers":
        yield {"workers": 2}
    elif kind == "threads":
        with ThreadPoolExecutor(2) as pool:
            yield {"executor": pool, "workers": None}
    elif kind == "processes":
        with ProcessPoolExecutor(2, get_context("spawn")) as pool:
            yield {"executor": pool, "workers": None}
    else:
        distributed = pytest.importorskip("distributed", reason="dask is not installed")
        with (
            distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster, set_as_default=False) as client,
        ):
            yield {"executor": client, "workers": None}


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_numbers_do_not_depend_on_who_computes_them(executor: dict[str, Any], alone: np.ndarray) -> None:
    """Bit for bit those of runs one by one."""
    found = swept(**executor)
    assert found.ran == len(found.rows) == 6
    assert not found.failed
    assert (found.numbers == alone).all()
    assert found.units == ("m", "m", "rad", "J")


def test_a_lost_worker_loses_no_finished_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An executor whose process dies ends the sweep with what it has, and the rest is run when it goes on."""
    store = tmp_path / "r.sweep"
    monkeypatch.setattr(engine, "_CHUNK_S", 0.0)  # one point at a time
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        victim = pool.submit(os.getpid).result()

        def kill(done: float, total: float) -> None:
            if done == 2:
                os.kill(victim, signal.SIGKILL)

        with pytest.raises(SimulationError) as lost:
            swept(store=store, executor=pool, progress=kill)
    assert lost.value.cause == Cause.OUT_OF_MEMORY
    again = swept(store=store, resume=True)
    assert 0 < again.ran <= 4
    assert len(again.rows) == 6


def test_what_variants_share_changes_no_bit() -> None:
    """Mechanism, packed equations and scales of the first one serve others that start elsewhere under other loads."""
    follower = '{point="tip", force=[0, 1, 0], follower=true}'
    loads = '{point="tip", force=[0, 0, -1]}', follower, "{force_per_mass=[1, 0, 0]}"
    common = (*SHORT, f"loads=[{', '.join(loads)}]")
    grid = {
        "loads.0.force": ([0.0, 0.0, -1.0], [0.0, 0.5, -2.0]),
        "loads.2.force_per_mass": ([1.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
        ANGLE: (0.0, 10.0),
    }
    found = erls.sweep(SCENE, grid, GET, overrides=common, workers=1)
    for row in found.rows:
        changes = [f"{key}={json.dumps(value)}" for key, value in zip(grid, row.parameters, strict=True)]
        run = erls.simulate(erls.load_scene(SCENE, [*common, *changes]), verdict=False)
        assert row.numbers is not None
        assert row.numbers[0] == run.position("tip", run.end)[0]
        assert row.numbers[2] == run.joint_angle("shoulder", 0.005)  # type: ignore[union-attr]
    assert len(np.unique(found.numbers[:, 0])) == 8


def test_functions_of_ones_own_reduce_runs(tmp_path: Path) -> None:
    """By name in workers; their names are columns."""
    found = erls.sweep(SCENE, GRID, height, overrides=SHORT, workers=2, store=tmp_path / "h.sweep")
    assert found.quantities == ("height",)
    assert (found.numbers[:, 0] == erls.sweep(SCENE, GRID, ["tip.z@end"], overrides=SHORT).numbers[:, 0]).all()


# ----- what is kept


def test_what_was_finished_is_not_run_again(tmp_path: Path, alone: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> None:
    """After an interrupt; and nothing is run where all is there."""
    store = tmp_path / "r.sweep"

    def stop(done: float, total: float) -> None:
        if done == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(engine, "_CHUNK_S", 0.0)  # one point at a time
    first = swept(store=store, progress=stop)
    assert first.interrupted
    assert len(first.rows) == 3
    second = swept(store=store, resume=True)
    assert (second.ran, second.interrupted) == (3, False)
    assert (second.numbers == alone).all()
    assert swept(store=store, resume=True).ran == 0


def test_a_store_with_finished_points_is_not_replaced_by_chance(tmp_path: Path) -> None:
    """It may have taken a night; what holds none goes."""
    store = tmp_path / "r.sweep"
    one = {"overrides": SHORT, "store": store}
    erls.sweep(SCENE, {ANGLE: (0.0,)}, GET, **one)
    with pytest.raises(SceneError, match=r"1 finished points.*--resume.*--force"):
        erls.sweep(SCENE, {ANGLE: (5.0,)}, GET, **one)
    assert erls.sweep(SCENE, {ANGLE: (5.0,)}, GET, force=True, **one).rows[0].parameters == [5.0]


def test_kill_9_loses_nothing_finished(tmp_path: Path, alone: np.ndarray) -> None:
    """What was told to be kept is there, whole, and the rest is run."""
    store = tmp_path / "r.sweep"
    program = """
import sys, time
import erls
from erls.studies.sweep import sweep as engine
from sweep_cases import *
engine._KEEP_S = 0.0
def tell(done, total):
    print(int(done), flush=True)
    time.sleep(0.2 if done >= 2 else 0)
erls.sweep(SCENE, GRID, GET, overrides=SHORT, workers=1, store=sys.argv[1], progress=tell)
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests/erls")])}
    command = [sys.executable, "-c", program, str(store)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    told = 0
    for line in process.stdout:
        told = int(line)
        if told == 4:
            process.kill()
            break
    process.wait()
    process.stdout.close()
    again = swept(store=store, resume=True)
    assert again.ran == 6 - told
    assert (again.numbers == alone).all()


def test_points_that_fail_are_told_while_the_rest_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With cause and count; exit code 3; --retry-failed runs them again."""
    store, table = tmp_path / "r.sweep", tmp_path / "r.csv"
    command = ["study", "sweep", str(SCENE), "--vary", f"{TOLERANCE}=1e-3,-1,1e-4", "--get", "tip.x@end"]
    command += ["--set", SHORT[0], "-o", str(store)]
    assert main([*command, "--table", str(table), "--json"]) == 3
    told = json.loads(capsys.readouterr().out)
    assert (told["finished"], told["failed"]) == (3, 1)
    assert told["failures"][0]["points"] == 1
    assert "tolerance" in told["failures"][0]["first"]
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["tip.x@end [m]"] == "" for row in rows] == [False, True, False]
    assert main([*command, "--resume", "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["ran"] == 0
    assert main([*command, "--resume", "--retry-failed", "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["ran"] == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"overrides": ("simulation.duration=0.02",)}, "overrides"),
        ({"verdict": True}, "verdict"),
    ],
)
def test_a_store_of_another_sweep_is_refused(change: dict[str, Any], words: str, tmp_path: Path) -> None:
    """Its numbers are of something else."""
    store = tmp_path / "r.sweep"
    erls.sweep(SCENE, {ANGLE: (0.0,)}, GET, overrides=SHORT, store=store)
    with pytest.raises(SceneError, match=words) as refused:
        erls.sweep(SCENE, {ANGLE: (0.0,)}, GET, **{"overrides": SHORT, **change}, store=store, resume=True)
    assert refused.value.cause == Cause.CHANGED
    with pytest.raises(SceneError, match="points"):
        erls.sweep(SCENE, {ANGLE: (1.0,)}, GET, overrides=SHORT, store=store, resume=True)


@pytest.mark.parametrize("content", [b"", b"x" * 5000, b"SQLite format 3\0" + b"\0" * 5000])
def test_files_that_are_no_stores_are_left_alone(content: bytes, tmp_path: Path) -> None:
    """Refused, and as they were."""
    store = tmp_path / "r.sweep"
    store.write_bytes(content)
    for resume in (True, False):
        with pytest.raises(SceneError):
            swept(store=store, resume=resume)
    assert store.read_bytes() == content


def test_a_store_with_other_tables_is_refused(tmp_path: Path) -> None:
    """Whoever made it may have hidden something in a view."""
    store = tmp_path / "r.sweep"
    erls.sweep(SCENE, {ANGLE: (0.0,)}, GET, overrides=SHORT, store=store)
    with sqlite3.connect(store) as base:
        base.execute("CREATE VIEW more AS SELECT 1")
    base.close()
    with pytest.raises(SceneError, match="other tables"):
        erls.sweep(SCENE, {ANGLE: (0.0,)}, GET, overrides=SHORT, store=store, resume=True)


def test_a_store_gives_back_what_it_was_given(tmp_path: Path) -> None:
    """Every bit, by pages."""
    rows = [
        Row(0, [1, "x", [1.5, 2]], np.array([np.pi, np.nan, -0.0])),
        Row(7, [2.5], None, "cause", "message", ("one", "two"), 0.25),
    ]
    base = Store(tmp_path / "s.sweep")
    base.begin({"keys": ["a"]})
    base.add(rows[::-1])
    found = list(base.rows())
    base.close()
    assert [row._replace(numbers=None) for row in found] == [row._replace(numbers=None) for row in rows]
    assert found[0].numbers is not None
    assert found[0].numbers.tobytes() == rows[0].numbers.tobytes()  # type: ignore[union-attr]


# ----- tables


def test_tables_of_other_packages(alone: np.ndarray) -> None:
    """A line for each point; a grid over its keys."""
    found = swept()
    frame, data = found.to_pandas(), found.to_xarray()
    assert (frame[list(GET)].to_numpy() == alone).all()
    assert frame[ANGLE].tolist() == [0.0, 0.0, 10.0, 10.0, 20.0, 20.0]
    picked = data["tip.x@end"].sel({ANGLE: 20.0, TOLERANCE: 1e-3})
    assert float(picked) == alone[4, 0]
    assert picked.attrs["units"] == "m"


def test_words_of_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Extremes, with the points where they are."""
    command = ["study", "sweep", str(SCENE), "--vary", f"{ANGLE}=0:20:3", "--get", "tip.x@end", "--set", SHORT[0]]
    assert main(command) == 0
    text = capsys.readouterr().out
    assert "3 points over joints.shoulder.initial.position_deg" in text
    assert any(line.startswith("tip.x@end [m]") and line.split()[-2:] == ["20", "0"] for line in text.splitlines())
    assert main([*command, "--resume"]) == 2
    assert main(command[:5]) == 2
    assert "--get" in capsys.readouterr().err


def test_runs_state_their_error_when_asked() -> None:
    """Not otherwise: judging costs more than the run."""
    grid = {ANGLE: (0.0,)}
    with pytest.raises(SceneError, match="--verdict"):
        erls.sweep(SCENE, grid, ["error"], overrides=SHORT)
    stated = erls.sweep(SCENE, grid, ["error"], overrides=SHORT, verdict=True).numbers[0, 0]
    run = erls.simulate(erls.load_scene(SCENE, [*SHORT, f"{ANGLE}=0.0"]))
    assert isinstance(run, Run)
    assert run.accuracy is not None
    assert stated == run.accuracy.total


def test_one_of_many_points_is_looked_at_for_bending() -> None:
    """By its number, whoever runs it. The link is soft, so that every run is off by millimetres."""
    soft = ("simulation.duration=0.1", "links.l.model.materials.steel.youngs_modulus=1e9", "effects=linear")
    scene = SCENE.with_name("steel_flat.toml")
    grid = {"gravity.2": np.linspace(-9.81, -9.0, 18)}
    found = erls.sweep(scene, grid, ["knots"], overrides=(*soft, "gravity=[0.0, 0.0, 0.0]"), workers=1)
    warned = [row.number for row in found.rows if any("expect errors of about" in text for text in row.warnings)]
    assert warned == [0, 16]
    assert "looked at in 2 of 18 points" in sweep_text(found)


def test_a_scene_that_has_changed_is_read_again(tmp_path: Path) -> None:
    """Links are shared by what their files hold, not by how they are called."""
    for folder in ("links", "."):
        (tmp_path / folder).mkdir(exist_ok=True)
        for file in (SCENE.parent / folder).glob("steel_tall.toml"):
            (tmp_path / folder / file.name).write_bytes(file.read_bytes())
    scene, link = tmp_path / "steel_tall.toml", tmp_path / "links/steel_tall.toml"

    def numbers() -> float:
        return float(erls.sweep(scene, {ANGLE: (0.0,)}, ["tip.z@end"], overrides=SHORT, workers=1).numbers[0, 0])

    before = numbers()
    link.write_text(link.read_text(encoding="utf-8").replace("7800.0", "3900.0"), encoding="utf-8")
    light = numbers()
    text = scene.read_text(encoding="utf-8") + '\n[[payloads]]\npoint = "tip"\nmass = 1.0\n'
    scene.write_text(text, encoding="utf-8")
    assert len({before, light, numbers()}) == 3


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("joints.shoudler.initial.position_deg", "no member 'shoudler'"),
        ("joints.shoulder.initial.positon_deg", "did you mean 'position_deg'"),
        ("links.l.model.sections.leg.widht", "did you mean 'width'"),
    ],
)
def test_misspelt_keys_are_refused(key: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No point can be right: nothing is run, nothing written."""
    command = ["study", "sweep", str(SCENE), "--vary", f"{key}=0.01,0.02", "--get", "tip.x@end"]
    assert main([*command, "-o", str(tmp_path / "r.sweep"), "--table", str(tmp_path / "r.csv")]) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_values_that_are_no_good_fail_alone() -> None:
    """The first one, too, which the keys are tried with."""
    found = erls.sweep(SCENE, {"links.l.model.sections.leg.width": [0.0, 0.01]}, "tip.x@end", overrides=SHORT)
    assert [row.number for row in found.failed] == [0]


@pytest.mark.parametrize("values", [0.01, "0.01", np.array(0.01)])
def test_a_value_is_no_list(values: Any) -> None:
    """Refused with its key; so is asking for nothing."""
    with pytest.raises(SceneError, match="not a list of values"):
        erls.sweep(SCENE, {ANGLE: values}, GET, overrides=SHORT)
    with pytest.raises(SceneError, match="nothing is kept"):
        erls.sweep(SCENE, {ANGLE: [0.01]}, [], overrides=SHORT)


def test_a_table_of_a_sweep_is_an_earlier_result(tmp_path: Path) -> None:
    """Written over by the next; one of points is not."""
    table = tmp_path / "r.csv"
    write_sweep_table(table, erls.sweep(SCENE, {ANGLE: (0.0,)}, GET, overrides=SHORT))
    claim(table, ".csv", [])
    table.write_text(f"{ANGLE}\n0\n", encoding="utf-8")
    with pytest.raises(SceneError, match=r"no \.csv file that erls wrote"):
        claim(table, ".csv", [])
