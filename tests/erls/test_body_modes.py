"""Vibration and buckling modes of bodies and beams as pictures: shapes, phases, files, faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from body_scenes_data import STRIP, body_scene
from PIL import Image

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError
from erls.run.bodies.mode import mode_of
from erls.view import film
from erls.view.figures import figure_of

LENGTH, LOAD = 2.0, 1.0
COLUMN: dict[str, Any] = {
    "gravity": [0.0, 0.0, 0.0],
    "simulation": {"type": "buckling", "count": 1},
    "beams": [{**STRIP["beams"][0], "elements": 16}],
    "loads": [{"node": "tip", "force": [-LOAD, 0.0, 0.0]}],
}


def _column(folder: Path, **simulation: Any) -> Path:
    return body_scene(folder, STRIP, **{**COLUMN, "simulation": {**COLUMN["simulation"], **simulation}})


def test_a_clamped_column_bends_as_a_quarter_of_a_cosine(tmp_path: Path) -> None:
    """Euler's shape 1 - cos(πx / 2L), to the error of 16 elements; the tip a tenth of the length out at phase 0, back
    through the column at 0.25, on the other side at 0.5.
    """
    run = erls.simulate(_column(tmp_path), verdict=False)
    mode = mode_of(run, 1)
    start, quarter, half = figure_of(mode).poses([0.0, 0.25, 0.5])
    (line,), (straight,), (other,) = (pose.nodes(1.0) for pose in (start, quarter, half))
    across = np.linalg.norm(line[:, 1:], axis=1)
    np.testing.assert_allclose(across, 0.1 * LENGTH * (1 - np.cos(np.pi * line[:, 0] / (2 * LENGTH))), atol=1e-3)
    assert across.max() == pytest.approx(0.1 * LENGTH, rel=1e-9)
    np.testing.assert_allclose(straight[:, 1:], 0.0, atol=1e-12)
    np.testing.assert_allclose(other[:, 1:], -line[:, 1:], atol=1e-9)
    (twice,) = start.nodes(2.0)
    np.testing.assert_allclose(twice[:, 1:], 2 * line[:, 1:], atol=1e-12)
    assert not any(values.any() for values in start.deflections())
    assert mode.title.endswith(f"mode 1, buckles at load {run.summary()['modes'][0]['load']:.4g}")


def test_modes_about_a_bent_equilibrium(tmp_path: Path) -> None:
    """They count from there, not from where all is built."""
    run = erls.simulate(body_scene(tmp_path, STRIP, simulation={"type": "frequencies", "count": 2}), verdict=False)
    mode = mode_of(run, 2)
    np.testing.assert_allclose(mode.position("tip", 0.25), run.position("tip", 1.0), atol=1e-12)
    assert np.linalg.norm(run.position("tip", 1.0) - [2, 0, 0]) > 1e-3
    (outline,) = figure_of(mode).poses([0.0])[0].outline()
    np.testing.assert_allclose(outline.points[-1], run.position("tip", 1.0), atol=1e-6)  # VTK keeps single precision
    assert mode.title.endswith(f"mode 2, {run.summary()['modes'][1]['frequency_hz']:.4g} Hz")


def test_pictures_and_tables_of_a_run_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``erls view --mode``: coloured pixels, and the tip at the phases asked for."""
    run = erls.simulate(_column(tmp_path), verdict=False)
    file = str(tmp_path / "c.run.h5")
    erls.save_run(file, run)
    assert main(["view", file, "--mode", "1", "--at", "0.25,0", "-o", str(tmp_path / "a.png")]) == 0
    with Image.open(tmp_path / "a.png") as image:
        assert (np.ptp(np.asarray(image.convert("RGB")).astype(int), axis=2) > 60).sum() > 1000
    assert main(["view", file, "--mode", "1", "--at", "0,0.25", "-o", str(tmp_path / "a.csv")]) == 0
    head, *rows = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    assert head.startswith("phase [1],")
    names, values = head.split(","), np.array([[float(x) for x in row.split(",")] for row in rows])
    tip = values[:, [names.index(f"tip.{axis} [m]") for axis in "xyz"]]
    np.testing.assert_array_equal(tip, mode_of(run, 1).position("tip", [0.0, 0.25]))
    capsys.readouterr()
    assert main(["view", file, "--mode", "2", "-o", str(tmp_path / "b.png")]) == 2
    assert "1 to 1" in capsys.readouterr().err
    assert not (tmp_path / "b.png").exists()


def test_runs_without_modes(tmp_path: Path) -> None:
    """Say where modes come from."""
    with pytest.raises(SceneError, match="found no modes") as caught:
        mode_of(erls.simulate(body_scene(tmp_path, STRIP), verdict=False), 1)
    assert caught.value.cause == Cause.BAD_FIELD
    assert "buckling" in str(caught.value.remedy)


def test_a_film_of_a_mode_is_one_period(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    mode = mode_of(erls.simulate(_column(tmp_path), verdict=False), 1)
    film(mode, tmp_path / "a.gif", fps=6, speed=2.0, size=(160, 100), progress=lambda *done: told.append(done))
    assert told == [(k, 4) for k in range(1, 5)]
