"""The cost study: error against a reference, front, recommendation, failures kept, a copy of the scene that holds."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError, SimulationError
from erls.report.cost_page import cost_csv, cost_page, cost_text
from erls.scene.read import load_chain
from erls.studies.cost import study_cost
from erls.studies.cost_result import CostStudy, cost_summary, pareto_front, recommendation
from erls.studies.explicit import too_stiff
from erls.studies.grid import Grid, ladders
from erls.studies.ladder import CostPoint, Setting, failed, overrides_of

TALL = scenes.ROOT / "data/l_shape/steel_tall.toml"
SHORT = ("simulation.duration=0.04", "simulation.step=5e-4")
NO_TIME = SimulationError(Cause.BUDGET, "the budget of the study was used up")
GRID = Grid(formulations=("erls",), integrators=("generalized_alpha",), effects=("all",), modes=(6, 18))


def point(wall: float, error: float, failure: SimulationError | None = None) -> CostPoint:
    setting = Setting("erls", "generalized_alpha", "all", None, "step", wall)
    return CostPoint(setting, wall, error, 1, 1, 1, 1, failure)


@pytest.fixture(scope="module")
def study() -> CostStudy:
    return study_cost(TALL, 1e-5, grid=GRID, reference="nodal", overrides=SHORT, points=["tip"], workers=1)


def test_front_holds_what_nobody_beats() -> None:
    nothing = point(math.nan, math.nan, SimulationError(Cause.NOT_FINITE, "no"))
    runs = [point(3.0, 1e-6), point(1.0, 1e-3), nothing, point(2.0, 2e-3), point(2.5, 1e-4), point(4.0, 1e-6)]
    assert [(p.wall_s, p.error) for p in pareto_front(runs)] == [(1.0, 1e-3), (2.5, 1e-4), (3.0, 1e-6)]
    assert pareto_front([nothing]) == ()


def test_error_is_that_of_the_run(study: CostStudy) -> None:
    """A run made by hand is as far from the reference as the study says."""
    run = next(r for r in study.runs if r.setting.modes == 18 and r.failure is None)
    again = erls.simulate(
        erls.load_scene(TALL, [*SHORT, *overrides_of(run.setting, ["links.l.elastic_modes"])])
    )
    distance = np.linalg.norm(again.position("tip", study.reference.times) - study.reference.positions[:, 0], axis=1)
    assert distance.max() == pytest.approx(run.error, rel=1e-6)
    assert (run.steps, run.rhs_calls) == (again.solution.work.steps, again.solution.work.rhs_calls)


def test_more_modes_and_smaller_steps_come_nearer(study: CostStudy) -> None:
    """18 modes end below the tolerance and near the reference; with 6 the model is the limit, and the ladder stops."""
    best = {n: min(r.error for r in study.runs if r.setting.modes == n) for n in (6, 18)}
    assert study.reference.error < 2e-6
    assert best[18] < 2e-6 < 4e-6 < best[6]
    errors = [r.error for r in study.runs if r.setting.modes == 6]
    assert len(errors) < 9
    assert abs(errors[-1] - errors[-3]) < 0.1 * errors[-1]


def test_recommended_setting_meets_the_tolerance_in_a_copy(study: CostStudy, tmp_path: Path) -> None:
    """None of those that meet it is cheaper beyond the noise, and the sentence names it."""
    from erls.studies.apply import write_copy

    chosen = study.chosen
    assert chosen is not None
    cheaper = [r for r in study.runs if 1.2 * r.wall_s < chosen.wall_s]
    assert all(r.error + study.reference.error > study.tolerance for r in cheaper)
    assert f"{chosen.setting.modes} modes" in recommendation(study)
    text = TALL.read_text(encoding="utf-8").replace("links/", f"{TALL.parent}/links/")
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    write_copy(tmp_path / "copy.toml", tmp_path / "scene.toml", (*SHORT, *study.chosen_overrides), "one\ntwo")
    copy = (tmp_path / "copy.toml").read_text(encoding="utf-8")
    assert copy.startswith("# one\n# two\n")
    assert next(line for line in text.splitlines() if line.startswith("#")) in copy
    run = erls.simulate(tmp_path / "copy.toml")
    distance = np.linalg.norm(run.position("tip", study.reference.times) - study.reference.positions[:, 0], axis=1)
    assert distance.max() <= study.tolerance


def test_reports_agree_with_the_json(study: CostStudy) -> None:
    summary = json.loads(json.dumps(cost_summary(study)))
    rows = list(csv.DictReader(io.StringIO(cost_csv(study))))
    assert len(rows) == len(summary["runs"]) == len(study.runs)
    for row, run in zip(rows, summary["runs"], strict=True):
        assert float(row["error_m"]) == pytest.approx(run["error"], rel=1e-5)
        assert row["on_front"] == str(int(run["on_front"]))
    page, text = cost_page(study), cost_text(study)
    assert not re.search(r"(src|href)=\"(?!#|data:)", page.partition("<script>")[0])  # nothing from a network
    for found in (f"{study.front[0].error:.2e}", recommendation(study)):
        assert found in page
        assert found in text.replace("\n", " ")
    assert max(map(len, text.splitlines())) <= 100


def test_what_is_tried_unless_given() -> None:
    """Both formulations, all and half and a quarter of the modes, all and auto; for beams linear links too."""
    scene = erls.load_scene(scenes.ROOT / "data/l_shape/steel_flat.toml")
    found = {(rungs[0].effects, rungs[0].modes) for rungs in ladders(scene, Grid(), 1e-4, 18, True)}
    assert found == {(e, n) for e in ("all", "auto") for n in (None, 9, 4)} | {("linear", None)}
    for grid, known in ((Grid(), False), (Grid(effects=("all",)), True)):
        assert all(rungs[0].effects != "linear" for rungs in ladders(scene, grid, 1e-4, 18, known))


def test_set_of_the_scene_is_always_tried() -> None:
    """First of all, in its own formulation; in other words it is the same set."""
    scene = erls.load_scene(scenes.ROOT / "data/slider_crank/fast.toml")
    for asked in ((), ("linear",), ("auto", "all+foreshortening")):
        found = [rungs[0] for rungs in ladders(scene, Grid(effects=asked), 1e-4, 12, True)]
        assert (found[0].formulation, found[0].effects, found[0].modes) == ("ffr", "all", None)
        sets = {setting.effects for setting in found}
        assert sets == {"all", *(asked or ("linear", "auto"))} - {"all+foreshortening"}
    split = erls.load_scene(scene.path, ["links.rod.substructures=4"])
    assert {rungs[0].formulation for rungs in ladders(split, Grid(), 1e-4, 12, True)} == {"ffr"}


def test_failures_stay_visible(monkeypatch: pytest.MonkeyPatch) -> None:
    """An explicit method that a stiff link makes too slow is reported as such, and not tried more tightly."""
    grid = Grid(("erls",), ("rk45",), ("all",), (18,))
    monkeypatch.setattr("erls.studies.ladder._measured", lambda task, setting, *rest: failed(setting, NO_TIME))
    result = study_cost(TALL, 1e-4, grid=grid, reference="tight", overrides=SHORT, workers=1)
    assert result.chosen is None
    assert [r.failure.cause for r in result.runs if r.failure is not None] == [Cause.BUDGET]
    assert "no setting ran" in recommendation(result)
    assert "budget" in cost_text(result)
    assert "budget" in cost_page(result)
    assert cost_summary(result)["runs"][0]["failure"]["cause"] == str(Cause.BUDGET)


def test_explicit_methods_tell_the_step_that_they_would_need() -> None:
    """That which keeps ω h within the limit of the method; of stiff systems only."""
    scene = load_chain(scenes.ROOT / "data/l_shape/steel_flat.toml", ["simulation.integrator=dop853"])
    problem = too_stiff(scene)
    assert problem is not None
    assert problem.cause == Cause.TOO_STIFF
    told = re.search(r"steps of (\S+) s or less, (\d+) of them, at (\S+) Hz", str(problem))
    assert told is not None
    step, frequency = float(told[1]), float(told[3])
    assert int(told[2]) == pytest.approx(scene.record.simulation.duration / step, rel=3e-3)
    assert 2 * np.pi * frequency * step == pytest.approx(5.96, rel=3e-3)
    for change in ("links.l.elastic_modes=2", "simulation.integrator=lobatto"):
        assert too_stiff(load_chain(scene.path, ["simulation.integrator=dop853", change])) is None


def test_tight_reference_of_a_rigid_pendulum(tmp_path: Path) -> None:
    """Without beams the reference is a tight run; generalized-α halves its step until it is near, in second order."""
    rod = {"mass": 2.0, "points": {"a": [0.0, 0.0, 0.0], "b": [0.4, 0.0, 0.0]}, "centre_of_mass": [0.2, 0.0, 0.0],
           "inertia": [1e-3, 0.03, 0.03]}  # fmt: skip
    data = {
        "simulation": {"duration": 0.5, "step": 0.01},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": [{"name": "j", "dh": {"convention": "standard"}}],
        "links": [{"name": "rod", "rigid": rod}],
        "points": [{"name": "end", "link": "rod", "node": "b"}],
    }
    path = scenes.write_toml(tmp_path / "scene.toml", data)
    grid = Grid(("erls",), ("generalized_alpha",), ("all",))
    result = study_cost(path, 1e-3, grid=grid, reference="tight", norm="rms", workers=1)
    errors = [r.error for r in result.runs]
    assert result.reference.error < 1e-6  # a thousandth of the tolerance is enough
    assert errors[-3] / errors[-1] == pytest.approx(16, rel=0.2)
    assert result.chosen is not None
    del data["points"]
    with pytest.raises(SceneError, match="no named point"):
        study_cost(scenes.write_toml(tmp_path / "scene.toml", data))


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--tolerance", "0"), "tolerance"),
        (("--budget", "-1"), "budget"),
        (("--norm", "l2"), "norm"),
        (("--points", "nose"), "nose"),
        (("--integrators", "euler"), "euler"),
        (("--formulations", "nodal"), "nodal"),
        (("--modes", "99"), "modes"),
        (("--effects", "foo"), "foo"),
        (("--effects", "all,coriolis_"), "coriolis"),
        (("--effects", "all", "--effects", "all+auto"), "auto"),
        (("--effects", "all,geometric_stiffening"), "all+geometric_stiffening"),
        (("--modes", "a"), "--modes"),
        (("--reference", "adams"), "adams"),
        (("--apply", "scene.toml"), "the scene itself"),
        (("--apply", "other.txt"), "TOML"),
        (("--apply", "../other.toml"), "beside"),
        (("-o", "cost.pdf"), "ending"),
    ],
)
def test_bad_input(
    options: tuple[str, ...], named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path / "in")
    text = TALL.read_text(encoding="utf-8").replace("links/", f"{TALL.parent}/links/")
    Path("scene.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr("erls.studies.cost.make_reference", lambda *a: pytest.fail("work before the check"))
    assert main(["study", "cost", "scene.toml", *options]) == 2
    assert named in capsys.readouterr().err
    assert sorted(p.name for p in Path().iterdir()) == ["scene.toml"]
