"""A measured record over a run: what is found of one that is known to be late, wrong and noisy; what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.cli.main import main
from erls.errors import ReportedError
from erls.report.runs import run_report
from erls.run.file import save_run
from erls.studies import overlay as studies
from erls.studies.overlay import overlay

LATE, OFFSET = 2e-3, 0.5


@pytest.fixture(scope="module")
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """0.2 s of the L pendulum with an accelerometer at its tip; its file without curves for others."""
    folder = tmp_path_factory.mktemp("overlay")
    scenes.l_link(folder, 4)
    sensors = [{"name": "imu", "type": "accelerometer", "point": "tip"}]
    scene = erls.load_scene(scenes.l_scene(folder, sensors=sensors, simulation={"duration": 0.2}))
    run = erls.simulate(scene, verdict=False)
    save_run(folder / "l.run.h5", run, beside=lambda group: None)
    return folder / "l.run.h5"


def record(folder: Path, run_file: Path, heads: str = "t [s],imu.z [m/s2],tip.z,temperature [K]") -> Path:
    """A record that is late and off, counted in the run's time, with rows before its start."""
    run = erls.load_run(run_file)
    t = np.linspace(-0.01, 0.19, 401)
    within = t >= 0
    acc = run.sensor("imu", np.clip(t - LATE, 0.0, 0.2))[:, 2] + OFFSET  # type: ignore[attr-defined]
    place = run.position("tip", np.clip(t, 0.0, 0.2))[:, 2]
    assert within.sum() == 381
    rows = np.stack([t, acc, place, 300.0 + 0 * t], axis=1)
    path = folder / "measured.csv"
    path.write_text(heads + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()), encoding="utf-8")
    return path


def test_a_late_record_is_seen_to_be_late(run_file: Path, tmp_path: Path, capsys: Any) -> None:
    """Lag to a fifth of a sample, the offset of a record that is otherwise alike, nothing where it is the same; on
    page, terminal and in JSON; heads with and without unit; what the run has not is named.
    """
    measured = record(tmp_path, run_file)
    page = tmp_path / "page.html"
    assert main(["view", str(run_file), "--overlay", str(measured), "-o", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    acc, place = told["columns"]["imu.z [m/s2]"], told["columns"]["tip.z [m]"]
    assert acc["lag"] == pytest.approx(LATE, abs=0.19 / 380 / 5)
    assert acc["largest"] >= acc["rms"] > OFFSET / 2
    assert place["largest"] < 1e-12
    assert place["correlation"] == pytest.approx(1.0, abs=1e-12)
    assert abs(place["lag"]) < 1e-6
    assert told["unknown"] == ["temperature [K]"]
    assert told["rows_outside"] == 20
    text = page.read_text(encoding="utf-8")
    assert text.count("<figure>") == 4
    assert "temperature [K]" in text
    assert "measured - simulated" in text
    assert main(["view", str(run_file), "--overlay", str(measured)]) == 0
    assert "imu.z [m/s2]" in capsys.readouterr().out
    assert "imu.z [m/s2]" in run_report(erls.load_run(run_file), [0.1])


def test_figures_are_what_they_are_called(run_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a constant offset alone: largest and rms are that, and a record that stays where it is has no correlation; of
    many rows some are taken.
    """
    monkeypatch.setattr(studies, "MOST", 100)
    run = erls.load_run(run_file)
    t = np.linspace(0.0, 0.2, 250)
    rows = np.stack([t, run.position("tip", t)[:, 2] + 0.25, 0 * t], axis=1)
    path = tmp_path / "m.csv"
    lines = ["t;tip.z;tip.x", *(";".join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines), encoding="utf-8")
    found = overlay(run, path)
    first, second = found.columns
    assert (len(first.times), found.every) == (84, 3)
    assert (first.largest, first.rms) == (pytest.approx(0.25, rel=1e-12), pytest.approx(0.25, rel=1e-12))
    assert first.correlation == pytest.approx(1.0, abs=1e-12)
    assert (second.correlation, second.lag) == (None, None)


@pytest.mark.parametrize(
    ("heads", "said"),
    [
        ("t,ium.z,a,b", "imu.z"),
        ("t,imu.z [m/s2]", "a head for each column"),
        ("0.0,1.0,2.0,3.0", "times do not rise"),
    ],
)
def test_faulty_records_are_refused(run_file: Path, tmp_path: Path, heads: str, said: str) -> None:
    """Columns that nobody knows, with the nearest; no heads; no numbers in order."""
    path = record(tmp_path, run_file, heads)
    with pytest.raises(ReportedError, match=said) as caught:
        overlay(erls.load_run(run_file), path)
    assert caught.value.exit_code == 2


def test_other_outputs_are_refused(run_file: Path, tmp_path: Path, capsys: Any) -> None:
    """A picture of a record, the record itself as the page, a record of another time."""
    measured = record(tmp_path, run_file)
    view = ["view", str(run_file)]
    assert main([*view, "--overlay", str(measured), "-o", str(tmp_path / "p.png")]) == 2
    assert main([*view, "--overlay", str(tmp_path / "none.csv")]) == 2
    html = measured.rename(tmp_path / "m.html")
    before = html.read_bytes()
    assert main([*view, "--overlay", str(html), "-o", str(html), "--force"]) == 2
    assert html.read_bytes() == before
    late = tmp_path / "late.csv"
    late.write_text("t,tip.z\n5.0,0.0\n6.0,0.0\n", encoding="utf-8")
    assert main([*view, "--overlay", str(late)]) == 2
    told = capsys.readouterr().err
    for said in ("end in .html", "no such file", "is read", "within the run"):
        assert said in told
