"""What tests of resumed and extended runs share: a scene, chunks of steps, what is equal, refusals."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

from erls.cli.main import main
from erls.integrate.base import Solution
from erls.integrate.driver import Pace


def equal(one: Solution, other: Solution, work: bool = True) -> bool:
    """Whether all knots are equal bit for bit, and so is the work."""
    same = [np.array_equal(getattr(one, name), getattr(other, name)) for name in "tyva"]
    return all(same) and (one.work == other.work or not work)


def chunks_of(numbers: random.Random, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps in chunks that have nothing to do with how fast they are; those that come one by one still do."""
    size = Pace.size

    def drawn(self: Pace) -> int:
        size(self)
        self._asked = min(numbers.randint(1, 5), self._largest)
        return self._asked

    monkeypatch.setattr(Pace, "size", drawn)
    monkeypatch.setattr("erls.integrate.driver._PAUSE", 0.0)  # all are looked at


def l_scene(folder: Path, **changes: Any) -> Path:
    scenes.l_link(folder)
    settings = {"duration": 0.2, "integrator": "lobatto", "step": None}
    found = scenes.merged({"simulation": settings}, changes)
    found["simulation"] = {key: value for key, value in found["simulation"].items() if value is not None}
    return scenes.write_toml(folder / "scene.toml", {**scenes.L_SCENE, **found})


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Exit code 2 and one line."""
    assert main(["simulate", *arguments]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1
    return lines[0]
