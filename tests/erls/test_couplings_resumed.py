"""Couplings, bushings and circuits in runs that were stopped and went on: equal bit for bit."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from resumed_runs import chunks_of, equal
from test_bushings import DAMPER, mounted
from test_circuits import STEP, axis
from test_couplings import geared
from test_resume import at_every_look, stopped

import erls
from erls.run.checkpoints import Checkpoints, read_checkpoint

SCENES: dict[str, Callable[[], Any]] = {
    "elastic gear": lambda: geared({"stiffness": 400.0, "damping": 0.1}, duration=0.03),
    "bushing": lambda: mounted(
        {"position": [0.0, 0.0, 0.0], "damping": DAMPER.tolist()}, {"x": {"initial": {"position": 1e-3}}}, duration=0.02
    ),
    "circuit": lambda: axis(STEP),
    "circuit, fixed steps": lambda: axis(STEP, integrator="generalized_alpha", step=1e-3, duration=0.02),
}


@pytest.mark.parametrize("name", SCENES)
def test_runs_go_on_through_the_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at_every_look(monkeypatch)
    chunks_of(random.Random(4), monkeypatch)
    scene, path = tmp_path / "scene.toml", tmp_path / "r.partial"
    erls.save_scene(scene, SCENES[name]())
    whole = erls.simulate(scene, verdict=False)
    assert stopped(scene, path, 4) > 0
    run = erls.simulate(scene, checkpoint=Checkpoints(path, saved=read_checkpoint(path)), verdict=False)
    assert equal(run.solution, whole.solution)
