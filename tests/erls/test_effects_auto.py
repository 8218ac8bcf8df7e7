"""Effects chosen by a coarse look and certified afterwards: the error equation, choices, certificates, the table."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from effect_scenes import random_chain
from small_systems import Modes

import erls
from erls.auto import automatic as automatic_module
from erls.auto import probe
from erls.auto.automatic import automatic
from erls.auto.certify import certify, following
from erls.auto.choice import Choice, affordable, choose_effects
from erls.auto.coordinates import kept_places
from erls.auto.cuts import RIGID, Cut
from erls.auto.error_motion import Knots, error_motion
from erls.auto.outputs import Outputs, effort_error, largest_distance, watched_nodes
from erls.auto.probe import coarse_run, difference
from erls.cli.main import main
from erls.equations.quick import quick
from erls.equations.registry import formulate
from erls.errors import Cause, SimulationError
from erls.integrate.base import Options
from erls.integrate.generalized_alpha import generalized_alpha
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import ALL, EFFECTS, Certificate
from erls.mechanism.without_effects import with_rigid, without
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_scene

WITHIN = 3.0  # actual error over certified one, from the specification


@pytest.fixture(autouse=True)
def whatever_it_costs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Decisions as if they cost nothing: runs here are short; test_effects_worth.py weighs them."""
    monkeypatch.setattr(automatic_module, "choose_effects", partial(choose_effects, thrifty=False))


@pytest.mark.parametrize("stride", [1, 4])
def test_error_motion_is_the_difference_of_two_motions(stride: int) -> None:
    """Two oscillators that differ in frequency and damping, with jumps of the force on the way; their motions in closed
    form stay apart by e(t). Steps of generalized-α: second order, a fraction of the distance over 100 s of 1 rad/s.
    """
    jumps = (3.0, 7.5)
    force = {0.0: 1.0, 3.0: -2.0, 7.5: 0.5}

    def push(t: float) -> float:
        return next(value for start, value in reversed(force.items()) if t >= start)

    ours = Modes([1.0, 2.0], 0.0, push, jumps)
    other = Modes([1.02, 2.0], 0.01, push, jumps)
    options, start = Options(0.01), np.array([0.3, -0.1])
    first, second = (
        generalized_alpha(system, (0.0, 12.0), start, 0 * start, options, None) for system in (ours, other)
    )
    parts = np.split(np.arange(len(first.t)), np.flatnonzero(np.diff(first.t) == 0) + 1)
    legs = [Knots.inside(first.t[p], first.y[p], first.v[p], first.a[p]) for p in parts]
    assert len(legs) == 3
    rest = np.zeros(2)
    found = error_motion(other, ours, np.arange(2), legs, (rest, rest), [stride] * 3, 1e-9)
    expected = np.array([np.interp(found.t, second.t, second.y[:, k]) for k in (0, 1)]).T
    apart = np.abs(second.y - first.y).max()
    assert apart > 0.05
    assert np.abs(found.y + found.error - expected).max() < 2e-3 * apart
    assert len(found.t) < len(first.t) / stride + 6


def test_error_motion_compiled_and_uncompiled(tmp_path: Path) -> None:
    """The same loop in Python over the same equations, a rigid link among them: to rounding over 40 steps."""
    scene = load_scene(scenes.three_links(tmp_path))
    whole: Any = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    less = with_rigid(without(whole.mechanism, {"centrifugal_load"}), {"b"})
    run = coarse_run(scene, less, 40)
    lesser: Any = run.formulation
    kept = kept_places(whole.mechanism, less, whole.size)
    s = run.solution
    leg = Knots.inside(s.t, s.y, s.v, s.a)
    rest = np.zeros(whole.size)
    sides = [
        error_motion(*systems, kept, [leg], (rest, rest), [1], 1e-6)
        for systems in ((whole, lesser), (quick(whole), quick(lesser)))
    ]
    for name in ("error", "rate"):
        ours, other = (getattr(side, name) for side in sides)
        assert np.abs(ours - other).max() < 1e-12 * np.abs(other).max()
        assert np.abs(other).max() > 1e-6


def test_a_look_that_takes_far_more_work_than_the_whole_run_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without an effect steps may be halved until nothing comes of it: 240 s beside 0.7 s of a shipped robot. What ends
    is the same to the bit.
    """
    scene = load_scene(scenes.three_links(tmp_path))
    mechanism = build_mechanism(scene).mechanism
    less = without(mechanism, {"coriolis"})
    whole = coarse_run(scene, mechanism, 40)
    free, held = coarse_run(scene, less, 40), coarse_run(scene, less, 40, whole=whole)
    assert np.array_equal(free.solution.y, held.solution.y)
    assert 0 < difference(whole, held).error < 1
    monkeypatch.setattr(probe, "_MORE", 0.5)
    monkeypatch.setattr("erls.integrate.driver._PAUSE", 0.0)  # all steps are looked at
    ended = coarse_run(scene, less, 40, whole=whole)
    assert ended.end < whole.end
    assert difference(whole, ended).error == np.inf


def _distance(run: ChainRun, reference: ChainRun) -> float:
    times = np.linspace(0.0, reference.end, 301)
    watched = watched_nodes(reference.formulation.mechanism)
    sides = [[Outputs(r.scene, r.formulation, watched).positions(s) for s in r.states(times)] for r in (run, reference)]
    return largest_distance(*sides)


@pytest.mark.parametrize("seed", [8, 12])
def test_certified_errors_hold_on_random_chains(tmp_path: Path, seed: int) -> None:
    """What auto leaves out, and one effect that is not small; benchmarks/effects_certified.py does many."""
    path = random_chain(tmp_path, seed)
    changes = ["simulation.duration=0.2"]
    reference = erls.simulate(load_scene(path, changes), verdict=False)
    mechanism = reference.formulation.mechanism
    run = erls.simulate(
        load_scene(path, [*changes, "effects=auto", "simulation.effects_tolerance=2e-3"]), verdict=False
    )
    assert run.certificate is not None
    assert _distance(run, reference) <= max(WITHIN * run.certificate.error, 1e-8)
    less = erls.simulate(load_scene(path, [*changes, "effects=-centrifugal_load"]), verdict=False)
    actual, certified = _distance(less, reference), certify(less, following(less, mechanism)).error
    assert actual / WITHIN <= certified <= actual * WITHIN or max(actual, certified) < 1e-7


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The steel L with few modes."""
    folder = tmp_path_factory.mktemp("pendulum")
    scenes.l_link(folder, reduction={"elastic_modes": 5})
    return scenes.l_scene(folder, simulation={"duration": 0.5, "step": 1e-3})


def _auto(path: Path, *changes: str, **options: Any) -> tuple[ChainRun, list[str]]:
    told: list[str] = []
    scene = load_scene(path, ["effects=auto", *changes])
    return erls.simulate(scene, tell=told.append, verdict=False, **options), told  # effects alone are judged here


def test_auto_leaves_out_what_the_tolerance_allows(pendulum: Path) -> None:
    """More with a looser one, down to rigid links; the run says what, and its JSON holds names and the certificate."""
    kept = []
    for tolerance in (1e-9, 1e-3, 1.0):
        run, told = _auto(pendulum, f"simulation.effects_tolerance={tolerance}")
        certificate = run.certificate
        assert certificate is not None
        assert certificate.ok
        assert certificate.effort_error is None  # nothing drives it
        assert any(text.startswith("effects: auto leaves") for text in told)
        summary = run.summary()
        assert summary["effects"] == [n for n in EFFECTS if n in run.formulation.mechanism.effects]
        assert summary["left_out_error"] == certificate.error <= tolerance
        assert summary["effects_wall_s"] > 0
        kept.append(run.formulation.mechanism.effects)
    assert kept[0] == ALL
    assert kept[1] < kept[0]
    assert "flexibility" in kept[1]
    assert not {"flexibility", "modal_damping", *(n for n in EFFECTS if EFFECTS[n].in_equations)} & kept[2]
    assert run.summary()["elastic_coordinates"] == 0


def test_run_files_keep_certificate_and_effects(pendulum: Path, tmp_path: Path) -> None:
    """A run that is read again has the equations that it was made with."""
    run, _ = _auto(pendulum, "simulation.effects_tolerance=1e-3")
    erls.save_run(tmp_path / "run.h5", run)
    again = erls.load_run(tmp_path / "run.h5")
    assert again.certificate == run.certificate
    assert again.formulation.mechanism.effects == run.formulation.mechanism.effects
    assert np.array_equal(again.position("tip", 0.3), run.position("tip", 0.3))
    assert again.summary()["effects"] == run.summary()["effects"]
    lost = replace(run, certificate=Certificate(np.inf, None, 1e-3, 1e-2))
    erls.save_run(tmp_path / "lost.h5", lost)
    found = erls.load_run(tmp_path / "lost.h5").certificate
    assert found is not None
    assert not np.isfinite(found.error)
    assert not found.ok


TOLERANCES = {"effects_tolerance": 1e-3, "effects_effort_tolerance": 0.3}


def _stiff_and_soft(folder: Path, formulation: str) -> Path:
    """A thick steel arm that carries a thin one of aluminium, both driven."""
    thick = {"materials": {"m": {"youngs_modulus": 2e11, "poissons_ratio": 0.3, "density": 7800.0}}}
    thick["sections"] = {"s": {"shape": "rectangular", "width": 0.06, "height": 0.055}}  # type: ignore[dict-item]
    scenes.arm_link(folder, **thick).rename(folder / "thick.toml")
    scenes.arm_link(folder)
    motion = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 40.0, "duration": 0.2}
    dh = {"convention": "standard", "a": 0.5, "alpha_deg": 60.0}
    names = ("thick", "arm")
    data = {
        "simulation": {"duration": 0.2, "step": 8e-4, "formulation": formulation, **TOLERANCES},
        "joints": [{"name": f"j{k}", "dh": dh, "drive": {"type": "motion", "motion": motion}} for k in names],
        "links": [{"name": k, "model": f"{k}.toml", "mesh_pose": {"frame": "joint"}} for k in names],
        "points": [{"name": "end", "link": "arm", "node": "tip"}],
    }
    return scenes.write_toml(folder / "two.toml", data)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_one_stiff_link_becomes_rigid(tmp_path: Path, formulation: str) -> None:
    """Its modes leave the coordinates of the run, those of the other link stay; the certificate knows both."""
    path = _stiff_and_soft(tmp_path, formulation)
    run, told = _auto(path)
    assert [link.elastic_modes for link in run.formulation.mechanism.links] == [0, 7]
    assert any("flexibility of 'thick'" in text for text in told)
    reference = erls.simulate(load_scene(path), verdict=False)
    assert reference.formulation.size == run.formulation.size + 7
    assert run.certificate is not None
    assert run.certificate.ok
    actual = _distance(run, reference)
    assert 1e-8 < actual <= WITHIN * run.certificate.error
    assert run.certificate.error <= WITHIN * actual
    assert run.certificate.effort_error is not None
    times = [0.05, 0.1, 0.2]
    efforts = [r.joint_effort("jarm", times) for r in (run, reference)]
    assert np.abs(efforts[0] - efforts[1]).max() / np.abs(efforts[1]).max() <= WITHIN * run.certificate.effort_error
    erls.save_run(tmp_path / "run.h5", run)
    again = erls.load_run(tmp_path / "run.h5")
    assert np.array_equal(again.position("end", 0.2), run.position("end", 0.2))


def _misjudged(off: frozenset[str], error: float) -> Any:
    cuts = tuple(Cut(frozenset({name}), error=error) for name in sorted(off))
    return lambda scene, mechanism: Choice(cuts)


def test_a_wrong_choice_is_noticed(pendulum: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The certificate does not depend on what was expected: a warning, or another run with the effect on."""
    off = frozenset({"centrifugal_load", "coriolis"})
    monkeypatch.setattr(automatic_module, "choose_effects", _misjudged(off, 1e-7))
    run, told = _auto(pendulum)
    assert run.certificate is not None
    assert not run.certificate.ok
    assert run.formulation.mechanism.effects == ALL - off
    assert any("use --strict" in w for w in run.warnings)
    assert any(text.startswith("warning: effects") for text in told)
    run, told = _auto(pendulum, strict=True)
    assert run.certificate is not None
    assert run.certificate.ok
    assert "centrifugal_load" in run.formulation.mechanism.effects
    assert not run.warnings
    assert any("repeated with" in text for text in told)


def test_a_run_that_fails_is_repeated_with_all(pendulum: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaving out inertia may leave a mass matrix indefinite; interrupts are not repeated."""
    off = frozenset({"inertia_second_order"})
    monkeypatch.setattr(automatic_module, "choose_effects", _misjudged(off, 1e-7))
    scene = load_scene(pendulum, ["effects=auto"])
    whole = build_mechanism(scene).mechanism
    told: list[str] = []

    def failing(cause: Cause) -> Any:
        def integrate(scene: Scene, mechanism: Mechanism) -> ChainRun:
            if mechanism.effects != whole.effects:
                raise SimulationError(cause, "as the test wants")
            return erls.simulate(replace(scene), verdict=False)

        return integrate

    run = automatic(scene, whole, failing(Cause.SINGULAR_MASS), told.append, False)
    assert run.formulation.mechanism.effects == whole.effects
    assert run.certificate is not None
    assert run.certificate.error == 0.0
    assert any("repeated with all" in text for text in told)
    with pytest.raises(SimulationError) as caught:
        automatic(scene, whole, failing(Cause.INTERRUPTED), told.append, False)
    assert caught.value.cause == Cause.INTERRUPTED


def test_an_error_that_cannot_be_followed_is_not_certified(pendulum: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Infinite, with a warning."""
    monkeypatch.setattr(automatic_module, "choose_effects", _misjudged(frozenset({"coriolis"}), 1e-7))

    def lost(run: ChainRun, whole: Mechanism) -> Certificate:
        raise SimulationError(Cause.NEWTON_FAILED, "as the test wants")

    monkeypatch.setattr(automatic_module, "certify", lost)
    run, _ = _auto(pendulum)
    assert run.certificate is not None
    assert run.certificate.error == np.inf
    assert any("effects: what auto left out" in w for w in run.warnings)


def test_the_error_equation_gives_up_with_a_cause() -> None:
    """Equations that are not finite near the motion."""

    class Broken(Modes):
        def residual(self, t: float, y: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
            return np.full(1, np.nan) if t > 0.5 else super().residual(t, y, v, a)

    t = np.linspace(0.0, 1.0, 11)
    leg = Knots.inside(t, *np.zeros((3, 11, 1)))
    rest = np.zeros(1)
    with pytest.raises(SimulationError) as caught:
        error_motion(Broken([1.0]), Modes([1.0]), np.arange(1), [leg], (rest, rest), [4], 1e-6)
    assert caught.value.cause == Cause.NEWTON_FAILED
    assert "t = 0.6" in caught.value.where


SECOND = Cut(frozenset({"inertia_second_order", "spin_softening"}), error=2e-5, effort_error=1e-4)
INERTIA = Cut(SECOND.off | {"coriolis", "centrifugal_load", "inertia_first_order"}, error=4e-4, effort_error=2e-3)
STIFF = Cut(link="a", error=2e-5, effort_error=2e-3)
SOFT = Cut(RIGID, error=1e-2, effort_error=1e-2)


@pytest.mark.parametrize(
    ("tolerance", "effort_tolerance", "expected"),
    [
        (5e-5, 1e-1, ()),
        (1e-4, 1e-1, (STIFF,)),  # together with SECOND, above 3e-5 m
        (1e-4, 5e-3, (SECOND,)),
        (1e-3, 1e-1, (STIFF, SECOND)),
        (1.5e-3, 1e-1, (STIFF, INERTIA)),  # SECOND is part of it
        (1.0, 1e-2, (STIFF, SECOND)),
        (1.0, 1.0, (SOFT,)),
    ],
)
def test_errors_of_what_is_left_out_add_up(
    tolerance: float, effort_tolerance: float, expected: tuple[Cut, ...]
) -> None:
    """To three tenths of either tolerance, what saves most first."""
    assert affordable((SOFT, STIFF, INERTIA, SECOND), tolerance, effort_tolerance) == expected


def test_efforts_count_by_their_peak() -> None:
    """And are nothing where no drive reacts."""
    found = effort_error([np.array([2.0]), np.array([-4.0])], [np.array([2.1]), np.array([-4.0])])
    assert found == pytest.approx(0.025)
    assert effort_error([], []) is None
    assert effort_error([np.zeros(1)], [np.zeros(1)]) == 0.0


def test_nodal_leaves_nothing_out(pendulum: Path) -> None:
    """Its elements have no such parts."""
    scene = load_scene(pendulum, ["simulation.formulation=nodal", "effects=auto"])
    choice = choose_effects(scene, build_mechanism(scene).mechanism)
    assert not choice.cuts
    assert "nothing that the scene holds would save anything" in choice.note


def test_table(pendulum: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`erls effects`: every effect that the scene asks for, on, off or not there, with sizes."""
    changes = ["effects=-modal_damping", "simulation.effects_tolerance=1e-3"]
    arguments = ["effects", str(pendulum), *(part for change in changes for part in ("--set", change))]
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["left_out"][0] == "modal_damping"
    rows = {row["name"]: row for row in found["effects"]}
    assert list(rows) == [n for n in EFFECTS if n in ALL - {"modal_damping"}]
    assert not rows["payload"]["present"]
    assert rows["spin_softening"]["why"] == "deciding costs more"
    assert rows["centrifugal_load"]["why"] == "needed"
    assert rows["coriolis"]["why"] == "goes with inertia_first_order"  # small, but without it alone nothing is saved
    assert "all kept" in found["decision"]
    weight = 9.81 * 7800 * 0.01 * 0.03 * 1.0  # of a metre of steel, in N
    assert 0.9 * weight < rows["gravity"]["force"] <= weight  # six coordinates feel less than all the mass
    fallen = np.hypot(0.5 + 0.31068246, 0.39755761)  # of the tip after 0.5 s: geometrically exact beams
    assert rows["gravity"]["error"] == pytest.approx(fallen, rel=0.01)
    assert 0.0 <= rows["flexibility"]["share"] <= 1.0
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "not there" in text
    assert "tolerance of 0.001 m" in text
    assert all(name in text for name in rows)
