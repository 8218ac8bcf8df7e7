"""The cost study's judgement: what settings are held against, what runs say against themselves, what auto costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.mechanism.effects import ALL, LINEAR, Certificate
from erls.report.cost_page import cost_page, cost_text
from erls.scene.chain import Scene
from erls.studies import ladder, refinement
from erls.studies.cost import study_cost
from erls.studies.cost_result import CostStudy, cheapest, cost_summary, recommendation
from erls.studies.doubts import foretold_error
from erls.studies.effect_sets import as_field, each_once, label_of, own_set, parse_sets
from erls.studies.grid import Grid
from erls.studies.ladder import CostPoint, Ladder, Setting, climb, overrides_of
from erls.studies.reference import Reference, knows_second_order, make_reference
from erls.studies.refinement import Level, TooShort, refine

DATA = scenes.ROOT / "data"
FAST = DATA / "slider_crank/fast.toml"
SHORT = ("simulation.duration=0.02", "simulation.step=5e-4")


def setting(effects: str = "all", integrator: str = "generalized_alpha") -> Setting:
    return Setting("ffr", integrator, effects, None, "step", 1e-3)


def point(wall: float, error: float, effects: str = "all", foretold: float = 0.0) -> CostPoint:
    return CostPoint(setting(effects), wall, error, 1, 1, 1, 1, foretold=foretold)


# ---- what is recommended


@pytest.mark.parametrize(
    ("runs", "best"),
    [
        ([point(1.0, 1e-3), point(2.0, 5e-5), point(3.0, 1e-6)], 1),
        ([point(1.0, 5e-5, foretold=2e-4), point(2.0, 5e-5)], 1),  # warns of more than the tolerance
        ([point(1.0, 5e-5, foretold=9e-5), point(2.0, 5e-5)], 0),
        ([point(1.0, 5e-5, "auto"), point(1.1, 5e-5), point(1.15, 5e-5, "linear")], 1),  # as cheap, and plainer
        ([point(1.0, 5e-5, "auto"), point(1.3, 5e-5)], 0),
        ([point(1.0, 5e-5, "linear"), point(1.1, 5e-5), point(1.15, 5e-5, "auto")], 1),
        ([point(1.0, 5e-5, foretold=np.inf), point(1.0, 2e-4)], None),
    ],
)
def test_cheapest(runs: list[CostPoint], best: int | None) -> None:
    """Within the tolerance, without a warning of more, and the plainest of equals."""
    assert cheapest(runs, 9e-5, 1e-4) is (None if best is None else runs[best])


def test_a_run_that_warns_is_marked_and_not_recommended() -> None:
    """In text, page and JSON."""
    times, runs = np.zeros(1), (point(1.0, 5e-5, foretold=2e-2),)
    truth = Reference(times, np.zeros((1, 1, 3)), "links without data", 1e-9, True, ("link 'rod' moves far",))
    study = CostStudy("scene", ("tip",), "max", 1e-4, truth, runs, runs, cheapest(runs, 1e-4, 1e-4), (), True)
    assert "warns of 0.02 m" in recommendation(study)
    for text in (cost_text(study), cost_page(study)):
        for found in ("2.00e-02", "links are linear in it", "rod", "moves far", "no setting meets"):
            assert found in text
    assert cost_summary(study)["runs"][0]["warned_error"] == 2e-2
    assert cost_summary(study)["reference"]["linear_links"]


def test_a_reference_that_is_too_coarse_judges_nothing() -> None:
    """The sentence blames it, not the settings."""
    truth, runs = Reference(np.zeros(1), np.zeros((1, 1, 3)), "a coarse one", 2e-4), (point(1.0, 5e-5),)
    study = CostStudy("scene", ("tip",), "max", 1e-4, truth, runs, runs, cheapest(runs, -1e-4, 1e-4), (), True)
    assert "the reference itself is known to 0.0002 m only" in recommendation(study)


# ---- what runs say against themselves


def test_linear_rod_of_the_slider_crank_is_not_recommended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops have no nodal reference; the tight one stiffens, so that the linear rod is seen to be far off."""
    monkeypatch.setattr("erls.studies.grid._STEP_SHARES", (2.0,))
    fine = [(f"{step:g} s", {"integrator": "generalized_alpha", "step": step}) for step in (2e-4, 1e-4)]
    monkeypatch.setattr("erls.studies.reference._levels", lambda *rest: fine)  # lobatto first compiles for seconds
    grid = Grid(("ffr",), ("generalized_alpha",), ("linear",), (2,))
    changes = ("simulation.duration=0.015", "simulation.step=2e-4", "links.rod.elastic_modes=2")
    study = study_cost(FAST, 1e-4, grid=grid, overrides=changes, points=["middle"], workers=1)
    assert "effects all" in study.reference.made_by
    assert not study.reference.linear
    assert study.reference.error < 1e-5
    linear = [run for run in study.runs if run.setting.effects == "linear" and run.failure is None]
    stiffened = [run for run in study.runs if run.setting.effects == "all" and run.failure is None]
    assert min(run.error for run in linear) > 5e-4 > 1e-4 > min(run.error for run in stiffened)
    assert min(run.foretold for run in linear) > 5e-4  # that is above 0.2 % of the rod
    assert {run.foretold for run in stiffened} == {0.0}
    assert study.chosen is not None
    assert study.chosen.setting.effects == "all"
    scene = erls.load_scene(FAST, (*changes, *overrides_of(study.chosen.setting, ["links.rod.elastic_modes"])))
    own = erls.simulate(erls.load_scene(FAST, changes))
    times = np.linspace(0.0, 0.015, 61)
    distance = np.linalg.norm(erls.simulate(scene).position("middle", times) - own.position("middle", times), axis=1)
    assert distance.max() < 1e-4


def test_estimates_too_small_for_a_warning_count_where_the_judge_shares_them() -> None:
    """The tall L is off by 1.6e-4 m over 2 s, by its own estimate: no warning, and no doubt beside exact beams."""
    run = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", ["simulation.duration=0.2", scenes.LINEAR]))
    assert run.warnings == ()
    assert foretold_error(run, linear=False) == 0.0
    assert 1e-6 < foretold_error(run, linear=True) < 2e-4


def test_lost_stability_and_certificates_are_doubts() -> None:
    """Of a beam that spins too fast any error can be expected; of what auto left out, what the certificate says."""
    changes = [scenes.LINEAR, "simulation.duration=10.0", "simulation.step=0.05"]
    run = erls.simulate(erls.load_scene(DATA / "spin_up/beam.toml", changes))
    assert foretold_error(run, linear=False) == np.inf
    calm = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", SHORT))
    for error, found in ((5e-5, 0.0), (3e-4, 3e-4)):
        certified = replace(calm, certificate=Certificate(error, None, 1e-4, 1e-2))
        assert foretold_error(certified, linear=False) == found


# ---- what the reference is


@pytest.mark.parametrize(
    ("path", "changes", "made_by"),
    [
        (FAST, ("simulation.effects=-gravity",), "ffr with all modes, effects all, lobatto"),
        (DATA / "l_shape/steel_tall.toml", (), "ffr with all modes, effects all, lobatto"),
        (FAST, ("links.rod.flexible=false",), "ffr with all modes, effects all, lobatto"),
        (DATA / "l_shape/steel_tall.toml", ("links.l.flexible=false",), "erls with all modes, effects all, lobatto"),
    ],
)
def test_tight_reference_has_all_that_the_scene_and_its_links_know(
    path: Any, changes: tuple[str, ...], made_by: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    levels: list[Level] = []

    def looked_at(given: list[Level], *rest: Any) -> Any:
        levels.extend(given)
        samples = np.zeros((2, 1, 1, 3))
        return refinement.Refined(("a", "b"), tuple(samples), (), 0.0)

    monkeypatch.setattr("erls.studies.reference.refine", looked_at)
    scene = erls.load_scene(path, changes)
    found = make_reference(scene, "tight", ("tip",), 1e-4, 1.0)
    assert made_by in found.made_by
    assert not found.linear
    used = levels[0].scene.record.simulation
    assert set(used.effects) == ALL
    tolerances = [level.scene.record.simulation.tolerance for level in levels]
    assert tolerances == pytest.approx([1e-4, 1e-5, 1e-6, 1e-7])


def test_links_without_second_order_make_a_linear_reference() -> None:
    """Members that form a ring: the study says that what linear links leave out is not counted."""
    scene = erls.load_scene(DATA / "thermal/bimetal.toml", ["simulation.duration=0.002", "simulation.step=1e-3"])
    assert knows_second_order(scene) is False
    found = make_reference(scene, "tight", (scene.record.points[0].name,), 1e-4, 240.0)
    assert found.linear
    assert "effects all, lobatto" in found.made_by


@pytest.mark.parametrize(
    ("asked", "problem", "made"),
    [
        ("", SceneError(Cause.BAD_FIELD, "no modal damping"), ["nodal", "tight"]),
        ("nodal", SceneError(Cause.BAD_FIELD, "no modal damping"), ["nodal"]),
        ("", SceneError(Cause.BUDGET, "too long"), ["nodal"]),
        ("", SimulationError(Cause.NEWTON_FAILED, "no"), ["nodal"]),
    ],
)
def test_beams_that_the_nodal_formulation_refuses_get_a_tight_reference(
    asked: str, problem: SceneError | SimulationError, made: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless it was asked for, the time is too short, or a run failed."""
    kinds: list[str] = []

    def refused(scene: Scene, kind: str, *rest: Any) -> Reference:
        kinds.append(kind)
        raise problem

    monkeypatch.setattr("erls.studies.cost.make_reference", refused)
    with pytest.raises(type(problem)):
        study_cost(DATA / "l_shape/steel_tall.toml", reference=asked, overrides=SHORT, workers=1)
    assert kinds == made


# ---- how long the reference may take


class Clock:
    """A clock that runs move on."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def fake_runs(clock: Clock, costs: dict[str, float], fails: tuple[str, ...] = ()) -> Callable[..., Any]:
    """A `simulate` whose runs take what is given, in ten steps, after a second of preparation."""

    def run(label: Any, progress: Callable[[float, float], None], verdict: bool) -> Any:
        clock.now += 1.0
        progress(0.0, 1.0)
        for k in range(10):
            clock.now += costs[label] / 10
            progress((k + 1) / 10, 1.0)
        if label in fails:
            raise SimulationError(Cause.NEWTON_FAILED, "steps too long")
        return SimpleNamespace(label=label, warnings=(f"of {label}",))

    return run


@pytest.mark.parametrize(
    ("costs", "fails", "made"),
    [
        ((1.0, 2.0, 4.0, 8.0), "", "abcd"),
        ((1.0, 2.0, 4.0, 50.0), "", "abc"),  # the last would take 8 by what is known; it is ended
        ((5.0, 10.0, 20.0, 40.0), "", "abc"),  # 5 + 10 + 20 leave 5
        ((3.0, 5.0, 9.0, 18.0), "", "abcd"),  # 17 leave 23, which are needed
        ((3.0, 5.0, 9.0, 18.0), "", "abc"),  # 17 leave 13
        ((1.0, 2.0, 4.0, 8.0), "a", "bcd"),
        ((30.0, 5.0, 5.0, 5.0), "", "needs 90"),  # 30, and twice as much
        ((1000.0, 5.0, 5.0, 5.0), "", "needs 3000"),
        ((1.0, 1000.0, 5.0, 5.0), "", "needs 1001"),
    ],
)
def test_reference_keeps_to_its_time(
    costs: tuple[float, ...], fails: str, made: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 40 s, of 30 s when it can be judged by, by a clock of its own: what does not fit is not begun, or ended early;
    two runs are the least.
    """
    clock, errors = Clock(), {2: 3.0, 3: 3.0 if made == "abcd" else 0.5, 4: 0.1}
    monkeypatch.setattr(refinement, "simulate", fake_runs(clock, dict(zip("abcd", costs, strict=True)), tuple(fails)))
    levels = [Level(label, label) for label in "abcd"]  # type: ignore[arg-type]

    def refined() -> refinement.Refined:
        wanted, times = (1.0, 0.0), (40.0, 30.0)
        return refine(levels, lambda run: np.zeros(1), lambda samples: errors[len(samples)], wanted, times, 2.0, clock)

    if made.startswith("needs"):
        with pytest.raises(TooShort) as caught:
            refined()
        assert caught.value.args[0] == pytest.approx(float(made.split()[1]), rel=0.01)
    else:
        found = refined()
        assert "".join(found.labels) == made
        assert found.warnings == (f"of {made[-1]}",)
        assert found.prepared_s == pytest.approx(len(found.labels) + len(fails))
    assert clock.now < 40.0 + max(costs) / 10 + 5.0


def test_reference_ends_when_it_is_good_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """And a failure of the finest run, or of bad input, is one of the study."""
    clock = Clock()
    costs = dict.fromkeys("abcd", 1.0)
    levels = [Level(label, label) for label in "abcd"]  # type: ignore[arg-type]

    def refined(fails: tuple[str, ...]) -> refinement.Refined:
        monkeypatch.setattr(refinement, "simulate", fake_runs(clock, costs, fails))
        wanted, times = (1.0, 0.1), (40.0, 40.0)
        return refine(levels, lambda run: np.zeros(1), lambda samples: 0.5 ** len(samples), wanted, times, 2.0, clock)

    assert refined(()).labels == ("a", "b", "c", "d")
    monkeypatch.setattr(refinement, "simulate", fake_runs(clock, costs))
    wanted, times = (1.0, 0.2), (40.0, 40.0)
    found = refine(levels, lambda run: np.zeros(1), lambda samples: 0.5 ** len(samples), wanted, times, 2.0, clock)
    assert found.labels == ("a", "b", "c")
    with pytest.raises(SimulationError, match="steps too long"):
        refined(tuple("abcd"))


def test_budget_too_small_for_a_reference_says_what_would_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """0.7 of the budget is the reference's, as long as it is too coarse to judge by."""

    def too_short(*rest: Any) -> Any:
        raise TooShort(70.0)

    monkeypatch.setattr("erls.studies.reference.refine", too_short)
    with pytest.raises(SceneError, match="takes about 70 s") as caught:
        study_cost(FAST, grid=Grid(effects=("all",)), budget=60.0, workers=1)
    assert caught.value.cause == Cause.BUDGET
    assert "100 s" in caught.value.remedy
    assert caught.value.exit_code == 2


# ---- what auto costs


@pytest.mark.parametrize(
    ("effects", "runs", "wall", "counted"),
    [
        ("all", [(0.3, None), (0.1, None), (0.2, None)], 0.2, 3),
        ("all", [(2.0, None)], 2.0, 1),
        ("auto", [(0.1, 20.0), (0.1, 0.2), (0.1, 0.4), (0.1, 0.3)], 0.4, 3),  # the first one loads what choosing needs
        ("auto", [(2.0, 20.0), (2.0, 1.0)], 3.0, 1),
        ("auto", [(30.0, 1.0)], 31.0, 1),  # long: more than a quarter of what a run may take
    ],
)
def test_choosing_effects_and_certifying_count(
    effects: str, runs: list[tuple[float, float | None]], wall: float, counted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ladder whose runs take what is given: integration, and choosing and certifying. Of its first setting, whatever
    the effects, the first run does not count: compiled code may be loaded on the way.
    """
    scene = erls.load_scene(DATA / "l_shape/steel_tall.toml", SHORT)
    done = erls.simulate(scene)
    off = erls.simulate(erls.load_scene(scene.path, (*SHORT, "effects=-gravity")))
    waiting = iter([(off, 5.0, None), (off, 2.0, None), *((done, *run) for run in runs)])

    def simulated(scene: Scene, progress: Any, verdict: bool) -> Any:
        run, wall, more = next(waiting)
        certificate = None if more is None else Certificate(0.0, None, 1e-4, 1e-2, more)
        return replace(run, wall_s=wall, certificate=certificate)

    monkeypatch.setattr(ladder, "simulate", simulated)
    times = np.array([0.0, 0.01])
    truth = Reference(times, done.position("tip", times)[:, None], "itself", 1e-9)
    rungs = (setting(), setting(effects))
    first, found = climb(Ladder(str(scene.path), SHORT, (), rungs, ("tip",), "max", truth, 1e-5, 100.0, 1e12))
    assert next(waiting, None) is None
    assert (first.wall_s, first.runs) == (2.0, 1)
    assert found.error == 0.0 < 1e-5 < first.error
    assert found.wall_s == pytest.approx(wall)
    assert found.runs == counted


def test_what_cannot_run_at_all_fails_once() -> None:
    """ERLS has no substructures: one failure, not one for each step."""
    rungs = tuple(Setting("erls", "generalized_alpha", "all", None, "step", step) for step in (2e-3, 1e-3))
    truth = Reference(np.zeros(1), np.zeros((1, 1, 3)), "nothing", 1e-9)
    changes = ("links.rod.substructures=2",)
    found = climb(Ladder(str(FAST), changes, (), rungs, ("middle",), "max", truth, 1e-4, 1e9, 1e12))
    assert [run.failure.cause for run in found if run.failure is not None] == [Cause.BAD_FIELD]


def test_what_runs_away_twice_is_not_tried_further() -> None:
    """The linear beam that spins too fast does so with any step."""
    steps = (0.08, 0.04, 0.02, 0.01)
    rungs = tuple(Setting("erls", "generalized_alpha", "linear", None, "step", step) for step in steps)
    truth = Reference(np.zeros(1), np.zeros((1, 1, 3)), "nothing", 1e-9)
    beam = str(DATA / "spin_up/beam.toml")
    found = climb(Ladder(beam, (), (), rungs, ("tip",), "max", truth, 1e-4, 1e9, 1e12))
    assert [run.failure.cause for run in found if run.failure is not None] == [Cause.RUNAWAY] * 2


# ---- how sets are written


@pytest.mark.parametrize(
    ("given", "labels", "fields"),
    [
        (["all,auto"], ("all", "auto"), ("all", "auto")),
        (["all", "linear+geometric_stiffening"], ("all", "linear+geometric_stiffening"),
         ("all", '["linear", "geometric_stiffening"]')),
        (["all-coriolis", "-coriolis"], ("all-coriolis",), ('["all", "-coriolis"]',)),
        (["linear+foreshortening", "foreshortening + linear"], ("linear+foreshortening",),
         ('["linear", "foreshortening"]',)),
        (["gravity+flexibility"], ("gravity+flexibility",), ('["gravity", "flexibility"]',)),
    ],
)  # fmt: skip
def test_sets_are_written_as_reported(given: list[str], labels: tuple[str, ...], fields: tuple[str, ...]) -> None:
    """Commas part sets, + joins the names of one; labels can be typed back, and stand for the same in a scene."""
    assert parse_sets(given) == labels
    assert parse_sets([",".join(labels)]) == labels
    assert tuple(map(as_field, labels)) == fields
    for field in fields:
        scene = erls.load_scene(FAST, [f"simulation.effects={field}"])
        assert each_once((own_set(scene.record.simulation.effects), *labels)) == labels or len(labels) > 1


def test_labels_of_a_scene() -> None:
    """As text, list, or nothing at all."""
    assert own_set("linear, foreshortening") == "linear+foreshortening" == own_set(["linear", "foreshortening"])
    assert own_set([]) == "none"
    assert as_field("none") == "[]"
    assert label_of(ALL) == "all"
    assert label_of(LINEAR) == "linear"
    assert label_of(LINEAR - {"gravity"}) == "linear-gravity"
    assert label_of(ALL - {"gravity"}) == "all-gravity"
