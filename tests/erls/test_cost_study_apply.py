"""``erls study cost --apply``: the copy holds what was decided and nothing else, each field in its own table."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from erls.cli.main import main
from erls.studies.apply import write_copy
from erls.studies.cost_result import CostStudy
from erls.studies.grid import Grid
from erls.studies.ladder import CostPoint, Setting, overrides_of
from erls.studies.reference import Reference

SCENE = """\
# a rigid pendulum

[simulation]
duration = 0.5
step = 5e-4 # of generalized-alpha

# about the joint,
# in two lines
[[joints]]
name = "j"
dh = { convention = "standard" }
# of the joint

[[links]]
name = "rod"
rigid = { mass = 2.0, points = { a = [0.0, 0.0, 0.0], b = [0.4, 0.0, 0.0] }, inertia = [1e-3, 0.03, 0.03] }

# about the points
[[points]]
name = "end"
link = "rod"
node = "b"
# the end
"""


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(SCENE, encoding="utf-8")
    return Path("scene.toml")


def setting(integrator: str, knob: str) -> Setting:
    return Setting("ffr", integrator, "all+foreshortening", None, knob, 1e-3)


@pytest.mark.parametrize(
    ("integrator", "knob", "settings", "removed"),
    [
        ("lobatto", "tolerance", {"tolerance": 1e-3}, ("simulation.step",)),
        ("auto", "tolerance", {"tolerance": 1e-3}, ("simulation.step",)),
        ("generalized_alpha", "step", {"step": 1e-3}, ()),
        ("dop853", "rtol", {"step": 5e-4, "rtol": 1e-3, "atol": 1e-5}, ()),  # the largest step
    ],
)
def test_fields_stand_in_their_tables(
    integrator: str, knob: str, settings: dict[str, float], removed: tuple[str, ...], scene: Path
) -> None:
    """Before the comment of the next table; what the integrator does not use goes, and the copy says so."""
    assert write_copy(Path("copy.toml"), scene, overrides_of(setting(integrator, knob), ()), "why") == removed
    copy = Path("copy.toml").read_text(encoding="utf-8")
    effects = ["all", "foreshortening"]
    given = {"duration": 0.5, "formulation": "ffr", "integrator": integrator, "effects": effects, **settings}
    assert tomllib.loads(copy) == {**tomllib.loads(SCENE), "simulation": given}
    assert copy.startswith("# why\n")
    assert ("# removed, since the integrator does not use them: simulation.step\n" in copy) == bool(removed)
    head, tail = copy.split("\n# about the joint,\n")
    assert all(f"\n{name} = " in head for name in given)
    assert tail == SCENE.split("\n# about the joint,\n")[1]


def test_fields_of_members_of_lists(scene: Path) -> None:
    """The last table of the file, too; without an integrator no field is removed."""
    assert write_copy(Path("copy.toml"), scene, ["points.end.node=a", "links.rod.elastic_modes=0"], "why") == ()
    copy = Path("copy.toml").read_text(encoding="utf-8")
    assert copy.endswith('node = "a"\n# the end\n')
    assert "elastic_modes = 0\n\n# about the points\n" in copy
    assert "step = 5e-4 # of generalized-alpha\n" in copy


def test_what_is_set_for_the_study_stays_out_of_the_copy(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And is told; sets of effects reach the study as they were typed."""
    asked: dict[str, Any] = {}

    def studied(path: Path, tolerance: float, **options: Any) -> CostStudy:
        asked.update(options)
        truth = Reference(np.zeros(1), np.zeros((1, 1, 3)), "nothing", 1e-9)
        best = CostPoint(setting("lobatto", "tolerance"), 1.0, 1e-6, 1, 1, 1, 1)
        how = overrides_of(best.setting, ())
        return CostStudy("scene", ("end",), "max", tolerance, truth, (best,), (best,), best, how, True)

    monkeypatch.setattr("erls.studies.cost.study_cost", studied)
    command = ["study", "cost", "scene.toml", "--apply", "copy.toml", "--set", "simulation.duration=0.1"]
    assert main([*command, "--effects", "all,auto", "--effects", "all+foreshortening"]) == 0
    assert asked["grid"] == Grid(effects=("all,auto", "all+foreshortening"))
    copy = Path("copy.toml").read_text(encoding="utf-8")
    assert tomllib.loads(copy)["simulation"]["duration"] == 0.5
    for text in (copy, capsys.readouterr().err):
        assert "simulation.duration=0.1" in text
        assert "does not take over" in text
    assert "removed" in copy
