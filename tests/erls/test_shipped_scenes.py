"""Every shipped scene, chains and bodies alike, through the one front end: load, info, simulate, file, view."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from PIL import Image

import erls
from erls.report.info import file_info
from erls.report.runs import run_report
from erls.run.record import Run
from erls.view import picture, write_view

_FILES = sorted((scenes.ROOT / "data").rglob("*.toml"))
SCENES = [p for p in _FILES if "simulation" in tomllib.loads(p.read_text(encoding="utf-8"))]


def _changes(path: Path) -> list[str]:
    """Two milliseconds of a motion with all effects, every load step at rest, a thousandth of the load on fine shells:
    what a test can wait for."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    settings = tables["simulation"]
    if path.parent.name == "shells" and path.stem in ("annulus", "hemisphere"):
        loads = enumerate(tables["loads"])
        little = [f"loads.{k}.force={[1e-3 * x for x in load['force']]}" for k, load in loads]
        return ["simulation.load_steps=1", *little]
    if settings.get("type") == "path":
        coarse = ["shells.0.mesh=meshes/tape_coarse.inp"] if path.stem == "tape_spring" else []
        return ["simulation.most_steps=2", *coarse]
    if "duration" not in settings:
        return ["simulation.compare_tangents=false"] if settings.get("compare_tangents") else []
    found = ["simulation.duration=2e-3"]
    if "step" in tables.get("inverse", {}):
        found.append("inverse.step=5e-4")
    return found + (["simulation.effects=all"] if settings.get("effects") == "auto" else [])


def _plain(value: Any) -> Any:
    return json.loads(json.dumps(value))


@pytest.mark.parametrize("path", SCENES, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_one_front_end(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same questions to every scene; what is read again answers the same, and is drawn."""
    monkeypatch.setattr("erls.run.file._OUTPUT_TIMES", 5)
    scene = erls.load_scene(path, _changes(path))
    told, text = file_info(path)
    assert (told["file"], told["scene"]) == ("scene", scene.name)
    assert scene.name in text
    fine = path.parent.name == "shells" and path.stem != "roll_up"  # whose meshes are judged by four times the elements
    run = erls.simulate(scene, verdict=not fine)
    assert isinstance(run, Run)
    summary = _plain(run.summary([run.end]))
    assert {"scene", "formulation", "wall_s", "samples", "warnings"} <= set(summary)
    sample = summary["samples"][-1]
    assert {"t", "joints", "points"} <= set(sample)
    assert sample["t"] == run.end
    for name in run.point_names:
        np.testing.assert_allclose(sample["points"][name], run.position(name, run.end), rtol=0, atol=1e-12)
    erls.save_run(tmp_path / "run.h5", run)
    loaded = erls.load_run(tmp_path / "run.h5")
    assert type(loaded) is type(run)
    assert _near(_plain(loaded.summary([run.end])), summary)
    assert run_report(loaded).splitlines()[0] == run_report(run).splitlines()[0]
    assert file_info(tmp_path / "run.h5")[0]["file"] == "run"
    picture(loaded, tmp_path / "a.png", [run.end], size=(320, 200))
    with Image.open(tmp_path / "a.png") as image:
        drawn = np.asarray(image.convert("RGB")).astype(int)
    assert (np.ptp(drawn, axis=2) > 40).sum() > 50
    for name in ("a.csv", "a.pvd"):
        write_view(loaded, tmp_path / name, times=[run.end])
    head, row = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    assert head.split(",")[0].startswith(run.axis.symbol)
    assert np.isfinite([float(x) for x in row.split(",")]).all()
    assert list((tmp_path / "a_files").iterdir())


def _near(a: Any, b: Any) -> bool:
    """Equal to rounding."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(_near(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(_near, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= 1e-10 * max(abs(a), abs(b), 1.0)
    return bool(a == b)
