"""Links that auto lets follow statically: vibrations that prescribed motions set off, choices, certificates, runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from effect_scenes import random_led_chain
from small_systems import Modes

import erls
from erls.auto import automatic as automatic_module
from erls.auto import choice as choice_module
from erls.auto.automatic import automatic, named
from erls.auto.certify import certify, following
from erls.auto.choice import Choice, choose_effects
from erls.auto.cuts import Cut
from erls.auto.forced import forced_vibrations
from erls.auto.outputs import Outputs, largest_distance, watched_nodes
from erls.auto.probe import needed
from erls.auto.static import may_follow, static_cut, vibrating_efforts
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import formulate
from erls.errors import Cause, SimulationError
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

WITHIN = 3.0  # actual error over certified one, from the specification
L_SHAPE, ROBOT = scenes.ROOT / "data/l_shape/steel_flat.toml", scenes.ROOT / "data/robot/two_link.toml"
STATIC_START = 'initial.deformation="static"'
SLOW = ["joints.shoulder.drive.motion.duration=40.0", "joints.elbow_joint.drive.motion.duration=40.0", STATIC_START]
SLOW.append("simulation.step=5e-4")

# (1) amplitudes, in closed form: a mass on a spring, f per unit of mass from rest

OMEGA, F, T = 7.0, 0.5, 1.3


@pytest.mark.parametrize(
    ("force", "jumps", "expected"),
    [
        (lambda t: F, (), F / OMEGA**2),
        (lambda t: F if t < T else 0.0, (T,), F / OMEGA**2 * max(1.0, 2 * abs(np.sin(OMEGA * T / 2)))),
        # ramps: a vibration of ṡ/ω, whose end takes away as much, T later
        (lambda t: F * min(t / T, 1.0), (T,), F / (OMEGA**3 * T) * max(1.0, 2 * abs(np.sin(OMEGA * T / 2)))),
        # ξ̈ + ω²ξ = F sin Ωt: ξ = F/(ω²-Ω²) (sin Ωt - Ω/ω sin ωt), s = F/ω² sin Ωt, over many turns of both
        (lambda t: F * np.sin(0.6 * t), (), F / (OMEGA**2 - 0.36) * 0.6 / OMEGA * (1 + 0.6 / OMEGA)),
    ],
    ids=["step", "pulse", "ramp", "sine"],
)
def test_amplitudes_of_an_oscillator(
    force: Callable[[float], float], jumps: tuple[float, ...], expected: float
) -> None:
    """To 1 %: loads straight between knots, and |D| at knots."""
    rest = np.zeros(1)
    found = forced_vibrations(Modes([OMEGA], 0.0, force, jumps), 40.0, rest, rest)
    assert found is not None
    assert found.omega == pytest.approx(OMEGA)
    assert found.amplitude == pytest.approx(expected, rel=1e-2)


def test_amplitudes_at_resonance_grow_with_time() -> None:
    """F sin ωt: ξ = F/(2ω²) sin ωt - F t/(2ω) cos ωt, whose distance from s = F/ω² sin ωt nears F t/(2ω)."""
    rest, duration = np.zeros(1), 15.0
    found = forced_vibrations(Modes([OMEGA], 0.0, lambda t: F * np.sin(OMEGA * t)), duration, rest, rest)
    assert found is not None
    assert found.amplitude == pytest.approx(F * duration / (2 * OMEGA), rel=1e-2)


def test_amplitudes_count_from_the_start() -> None:
    """What stands where its load holds it does not vibrate; what moves, or stands elsewhere, does."""
    system, place, rate = Modes([OMEGA], 0.0, lambda t: F), np.array([0.03]), np.array([0.2])
    rest = np.zeros(1)
    held = forced_vibrations(system, 5.0, np.array([F / OMEGA**2]), rest)
    moved = forced_vibrations(system, 5.0, place, rate)
    assert held is not None
    assert moved is not None
    assert held.amplitude.max() < 1e-12
    assert moved.amplitude == pytest.approx(float(np.hypot(place - F / OMEGA**2, rate / OMEGA)[0]))


def test_loads_that_change_too_fast_are_not_followed() -> None:
    """No amplitude, rather than a wrong one."""
    rest = np.zeros(1)
    assert forced_vibrations(Modes([OMEGA], 0.0, lambda t: float(np.sin(5e3 * t))), 5.0, rest, rest) is None


# (2) choices


def _choice(path: Path, *changes: str, thrifty: bool = True) -> Choice:
    scene = load_scene(path, ["effects=auto", *changes])
    return choose_effects(scene, build_mechanism(scene).mechanism, thrifty)


@pytest.fixture
def led(tmp_path: Path) -> Path:
    """The steel L, turned by 90 deg in 15 s, for 30 s."""
    scenes.l_link(tmp_path)
    motion = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 90.0, "duration": 15.0}
    joint = {**scenes.L_SCENE["joints"][0], "drive": {"type": "motion", "motion": motion}}
    simulation = {"duration": 30.0, "step": 5e-4}
    return scenes.l_scene(tmp_path, joints=[joint], simulation=simulation, initial={"deformation": "static"})


def test_slow_links_follow_statically_without_a_coarse_run(led: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same decision each time: nothing is measured. What the equilibrium of the start has of second order counts as
    a vibration about the linear one.
    """
    monkeypatch.setattr(choice_module, "coarse_run", None)
    for path, changes in ((led, ()), (ROBOT, ("simulation.duration=60.0", *SLOW))):
        choices = [_choice(path, *changes) for _ in range(2)]
        assert choices[0] == choices[1]
        assert 0 < choices[0].bandwidth < 10.0
        assert not choices[0].off
        assert not choices[0].rigid
        assert "vibrations of links" in choices[0].note
        assert sum(cut.error for cut in choices[0].cuts) < 5e-6


@pytest.mark.parametrize(
    "changes",
    [
        ["joints.shoulder.drive.motion.duration=0.3"],  # too fast
        ['initial.deformation="zero"'],  # swings about the static deflection
        ["simulation.effects_tolerance=1e-13"],
        ["simulation.effects_effort_tolerance=1e-13"],
    ],
)
def test_links_that_vibrate_are_not_static(led: Path, changes: list[str]) -> None:
    """Whatever deciding costs."""
    assert not _choice(led, *changes, "simulation.duration=0.6", thrifty=False).bandwidth


def test_what_cannot_follow_statically(led: Path) -> None:
    """Free joints, what has a bandwidth of its own, other coordinates, and rigid links."""
    expected = {
        led: True,
        L_SHAPE: False,
        ROBOT: True,
        scenes.ROOT / "data/slider_crank/flexible.toml": False,
    }
    for path, follows in expected.items():
        scene = load_scene(path)
        assert may_follow(build_mechanism(scene).mechanism, scene.record.simulation) == follows
    for change in ("simulation.bandwidth=5.0", "simulation.formulation=nodal", "links.l.flexible=false"):
        scene = load_scene(led, [change])
        assert not may_follow(build_mechanism(scene).mechanism, scene.record.simulation)


def test_drive_forces_of_a_vibrating_link(led: Path) -> None:
    """Of one that starts undeformed: to a third of what a run finds, and not below it."""
    scene = load_scene(led, ['initial.deformation="zero"', "simulation.duration=2.0", "simulation.step=2e-4"])
    formulation = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    found, _ = needed(scene.record.simulation, formulation)
    assert found.forced is not None
    estimated = vibrating_efforts(scene, formulation, found.forced)
    still = erls.simulate(load_scene(led, ["simulation.duration=2.0", "simulation.step=2e-4"]), verdict=False)
    times = np.linspace(0.01, 2.0, 800)
    efforts = [run.joint_effort("shoulder", times) for run in (erls.simulate(scene, verdict=False), still)]
    actual = np.abs(efforts[0] - efforts[1]).max() / np.abs(efforts[1]).max()
    assert estimated is not None
    assert actual <= 1.1 * estimated  # what starts undeformed swings about it, to 1 % of second order in deflection
    assert estimated <= 3 * actual


# (3) runs and certificates


def _distance(run: ChainRun, reference: ChainRun) -> float:
    times = np.linspace(0.0, reference.end, 401)
    watched = watched_nodes(reference.formulation.mechanism)
    sides = [[Outputs(r.scene, r.formulation, watched).positions(s) for s in r.states(times)] for r in (run, reference)]
    return largest_distance(*sides)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_static_links_take_no_steps(led: Path, tmp_path: Path, formulation: str) -> None:
    """Nothing is integrated; what the run says holds against all effects, and in the file."""
    changes = [f"simulation.formulation={formulation}"]
    run = erls.simulate(load_scene(led, ["effects=auto", *changes]), verdict=False)
    assert isinstance(run.formulation, QuasiStatic)
    assert run.formulation.size == 0
    assert run.solution.work.steps <= 2  # one between breakpoints
    assert run.certificate is not None
    assert run.certificate.ok
    assert not run.warnings
    reference = erls.simulate(load_scene(led, changes), verdict=False)
    assert reference.solution.work.steps >= 60_000
    assert _distance(run, reference) <= max(WITHIN * run.certificate.error, 1e-8)
    times = np.linspace(0.5, 29.5, 60)
    efforts = [r.joint_effort("shoulder", times) for r in (run, reference)]
    assert np.abs(efforts[0] - efforts[1]).max() < 1e-4 * np.abs(efforts[1]).max()
    alone = [run.formulation.state(t, np.zeros(0), np.zeros(0)).modal[0] for t in times.tolist()]
    assert run.series(times).modal[0] == pytest.approx(np.array(alone), abs=1e-15)
    erls.save_run(tmp_path / "run.h5", run)
    again = erls.load_run(tmp_path / "run.h5")
    assert again.certificate == run.certificate
    assert np.array_equal(again.position("tip", 7.0), run.position("tip", 7.0))


@pytest.mark.parametrize("seed", [11, 16])
def test_certified_errors_of_static_links_hold_on_random_chains(tmp_path: Path, seed: int) -> None:
    """Small or large; benchmarks/effects_certified.py does many."""
    scene = load_scene(random_led_chain(tmp_path, seed), [STATIC_START])
    whole = build_mechanism(scene).mechanism
    formulation = formulate(whole, scene.record.simulation)
    found, _ = needed(scene.record.simulation, formulation)
    assert found.forced is not None
    cut = static_cut(scene, formulation, found.forced)
    assert cut is not None
    reference, run = (
        erls.simulate(scene, verdict=False),
        erls.simulate(named(scene, whole, Choice((cut,))), verdict=False),
    )
    actual, certified = _distance(run, reference), certify(run, following(run, whole)).error
    assert 1e-7 < actual <= WITHIN * certified
    assert actual <= WITHIN * cut.error


def test_a_wrong_choice_of_static_links_is_noticed(led: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Too fast a motion: a warning, or another run with all."""
    changes = ["joints.shoulder.drive.motion.duration=0.4", "simulation.duration=0.6", "effects=auto"]
    misjudged = Choice((Cut(bandwidth=3.0, error=1e-7),))
    monkeypatch.setattr(automatic_module, "choose_effects", lambda scene, mechanism: misjudged)
    run = erls.simulate(load_scene(led, changes), verdict=False)
    assert run.certificate is not None
    assert not run.certificate.ok
    assert any("use --strict" in w for w in run.warnings)
    told: list[str] = []
    run = erls.simulate(load_scene(led, changes), strict=True, tell=told.append)
    assert run.formulation.mechanism.bandwidth is None
    assert any("repeated with all effects" in text for text in told)


def test_a_static_run_that_fails_is_repeated(led: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And says without what it failed."""
    misjudged = Choice((Cut(bandwidth=3.0, error=1e-7),))
    monkeypatch.setattr(automatic_module, "choose_effects", lambda scene, mechanism: misjudged)
    scene, told = load_scene(led, ["simulation.duration=0.1", "effects=auto"]), []  # type: ignore[var-annotated]

    def integrate(scene: Any, mechanism: Any) -> ChainRun:
        if mechanism.bandwidth is not None:
            raise SimulationError(Cause.NO_EQUILIBRIUM, "as the test wants")
        return erls.simulate(replace(scene), verdict=False)

    automatic(scene, build_mechanism(scene).mechanism, integrate, told.append, False)
    assert any("failed without vibrations of links" in text for text in told)


def test_the_end_of_a_static_run_is_its_own(led: Path) -> None:
    """A motion that ends with the run: loads that would jump there do not move its last instant."""
    changes = ["simulation.duration=15.0", "simulation.bandwidth=3.0", "joints.shoulder.drive.motion.degree=3"]
    run = erls.simulate(load_scene(led, changes), verdict=False)
    ends = run.position("tip", [15.0 - 1e-6, 15.0])
    assert np.abs(ends[1] - ends[0]).max() < 1e-8
