"""Finished runs that are extended: equal, bit for bit, to those that were asked for at once."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from body_scenes_data import PENDULUM, body_scene
from checkpoint_times import at_every_look
from resumed_runs import chunks_of, equal, l_scene, refused

import erls
from erls.cli.main import main
from erls.run.file import load_run
from erls.simulation import extension


def test_finished_runs_are_extended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As though the same --until had been given at once, accuracy included, also with a stop between; the first part is
    what it was.
    """
    at_every_look(monkeypatch)
    chunks_of(random.Random(8), monkeypatch)
    scene, once, twice = l_scene(tmp_path), tmp_path / "once.h5", tmp_path / "twice.h5"
    assert main(["simulate", str(scene), "--until", "0.3", "--at", "0.25", "-o", str(once)]) == 0
    assert main(["simulate", str(scene), "-o", str(twice)]) == 0
    first, whole = load_run(twice), load_run(once)
    extend, left = extension.extend, [4]

    def stop(t: float, end: float) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(extension, "extend", lambda *a, **k: extend(*a, **{**k, "progress": stop}))
        assert main(["simulate", str(scene), "--resume", str(twice), "--until", "0.3"]) == 130
    assert load_run(twice).end == 0.2
    assert (tmp_path / "twice.h5.partial").exists()
    assert main(["simulate", str(scene), "--resume", str(twice), "--until", "0.3"]) == 0
    run = load_run(twice)
    assert run.end == 0.3
    assert equal(run.solution, whole.solution)
    assert (run.accuracy, run.trust, run.warnings) == (whole.accuracy, whole.trust, whole.warnings)
    for name in "tyva":
        assert np.array_equal(getattr(run.solution, name)[: len(first.solution.t)], getattr(first.solution, name))
    capsys.readouterr()
    assert "beyond 0.3 s" in refused(capsys, str(scene), "--resume", str(twice), "--until", "0.25")
    assert "beyond 0.2 s" in refused(capsys, str(scene), "--until", "0.1")
    slow = ("--set", "simulation.bandwidth=200.0")
    assert "simulation.bandwidth" in refused(capsys, str(scene), "--until", "0.3", *slow)
    assert "leave one of them out" in refused(capsys, str(scene), "--strict", "--until", "0.25")
    turned = ("--set", "joints.0.initial.rate=1.0")
    assert "joints" in refused(capsys, str(scene), "--resume", str(twice), "--until", "0.4", *turned)
    body = body_scene(tmp_path, PENDULUM)
    assert "bodies and beams cannot" in refused(capsys, str(body), "--until", "9.0")


def test_an_extended_motion_is_that_of_a_longer_run(tmp_path: Path) -> None:
    """Within what both state of their integration: their steps differ."""
    scene = l_scene(tmp_path)
    run, longer = erls.simulate(scene, until=0.3), erls.simulate(erls.load_scene(scene, ["simulation.duration=0.3"]))
    times = np.linspace(0.0, 0.3, 31)
    apart = np.linalg.norm(run.position("tip", times) - longer.position("tip", times), axis=1).max()
    assert run.accuracy is not None
    assert longer.accuracy is not None
    assert 0 < apart < run.accuracy.integration + longer.accuracy.integration
