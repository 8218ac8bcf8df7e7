"""Whether deciding pays: by counting alone, on long and short, calm and shaken, stiff and soft scenes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from small_systems import Modes

import erls
from erls.auto import choice as choice_module
from erls.auto import operations as operations_module
from erls.auto import purse as purse_module
from erls.auto.choice import Choice, choose_effects
from erls.auto.cuts import possible_cuts
from erls.auto.operations import CALM, ITERATIONS, operations
from erls.auto.outputs import Outputs, busiest, watched_nodes
from erls.auto.pilot import count_steps
from erls.auto.resolution import Vibrations, resolution, vibrations
from erls.equations.registry import formulate
from erls.mechanism.effects import FIRST, SECOND
from erls.mechanism.without_effects import without
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

ROBOT = scenes.ROOT / "data/robot/two_link.toml"
L_SHAPE = scenes.ROOT / "data/l_shape/steel_flat.toml"
SLOW = [
    "joints.shoulder.drive.motion.duration=40.0",
    "joints.elbow_joint.drive.motion.duration=40.0",
    'initial.deformation="static"',
    "simulation.step=5e-4",
]
LED = [
    f"joints.{joint}.{setting}"
    for joint in ("shoulder", "elbow_joint")
    for setting in (
        'drive.type="pd"',
        "drive.proportional_gain=3000.0",
        "drive.derivative_gain=60.0",
        "drive.feed_forward=true",
        "motor.rotor_inertia=5e-3",
    )
]


def _choice(path: Path, *changes: str) -> Choice:
    scene = load_scene(path, ["effects=auto", *changes])
    return choose_effects(scene, build_mechanism(scene).mechanism)


@pytest.mark.parametrize("path", [ROBOT, L_SHAPE])
def test_short_runs_keep_all_without_a_look(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They cost less than any decision."""
    monkeypatch.setattr(choice_module, "coarse_run", None)
    monkeypatch.setattr(choice_module, "needed", None)
    choice = _choice(path)
    assert not choice.cuts
    assert choice.note == "effects: all kept: the whole run costs less than deciding"


def test_long_slow_runs_leave_out_inertia_with_the_deformation() -> None:
    """Controllers that know the weight of the rigid chain; the same decision each time: nothing is measured."""
    choices = [_choice(ROBOT, "simulation.duration=60.0", *SLOW, *LED) for _ in range(2)]
    assert choices[0] == choices[1]
    assert choices[0].off == FIRST | SECOND
    assert sum(cut.error for cut in choices[0].cuts) < 3e-5


@pytest.mark.parametrize("times", [1 / 3, 1.0, 3.0])
def test_decisions_bear_another_weight_of_calls(times: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A factor of three on what a call from Python weighs: short runs keep all, long led ones follow statically."""
    for module in (operations_module, purse_module):
        monkeypatch.setattr(module, "CALL", times * operations_module.CALL)
    for path in (ROBOT, L_SHAPE):
        assert not _choice(path).cuts
    assert [cut.bandwidth > 0 for cut in _choice(ROBOT, "simulation.duration=60.0", *SLOW).cuts] == [True]


def test_long_shaken_runs_keep_all() -> None:
    """Links that start undeformed vibrate by millimetres, undamped: a look would have to follow that for 60 s."""
    choice = _choice(ROBOT, "simulation.duration=60.0", *SLOW[:2])
    assert not choice.cuts
    assert "costs less than deciding" in choice.note


def test_what_holds_nothing_to_leave_out_asks_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rigid links."""
    monkeypatch.setattr(choice_module, "Purse", None)
    assert not _choice(scenes.ROOT / "data/four_bar/rigid.toml").cuts


@pytest.mark.parametrize("path", [ROBOT, L_SHAPE])
def test_costs_fall_with_what_goes_and_rise_with_time(path: Path) -> None:
    """Every cut saves; steps are those of the scene."""
    scene = load_scene(path, ["simulation.duration=3.0", "simulation.step=1e-3"])
    whole = build_mechanism(scene).mechanism
    assert count_steps(scene, whole) == 3000
    full = operations(whole)
    costs = [operations(cut.applied(whole)).step(CALM) for cut in possible_cuts(whole, "erls")]
    assert all(cost < full.step(CALM) for cost in costs)
    assert costs[0] == min(costs)  # no flexibility at all
    assert full.step(CALM) < full.step(ITERATIONS)
    second = operations(without(whole, SECOND))
    bare = operations(without(whole, FIRST | SECOND))
    assert bare.evaluation < second.evaluation < full.evaluation


def test_adaptive_steps_are_counted_on_a_short_run() -> None:
    """As steps of generalized-alpha with the same number of evaluations; 20 % off for the L over 10 s."""
    scene = load_scene(L_SHAPE, ["simulation.integrator=lobatto", "simulation.duration=10.0"])
    counted = count_steps(scene, build_mechanism(scene).mechanism) * ITERATIONS
    assert counted == pytest.approx(erls.simulate(scene).solution.work.rhs_calls, rel=0.2)


def test_jumps_set_off_vibrations() -> None:
    """A mass on a spring, pushed by f from 0 on and by -f from 1 s on: amplitudes f/k and 2 f/k, added as squares."""
    omega, f = 3.0, 0.5
    system = Modes([omega], 0.05, lambda t: f if t < 1.0 else -f, (1.0,))
    scene = load_scene(L_SHAPE)
    found = vibrations(system, build_mechanism(scene).mechanism, 10.0, np.zeros(1), np.zeros(1))
    assert found.omega == pytest.approx([omega])
    assert found.amplitude == pytest.approx([np.sqrt(5.0) * f / omega**2], rel=1e-6)
    assert found.lasting == pytest.approx([min(10.0, 3.0 / (0.05 * omega))])


SET_OFF = Vibrations(
    np.array([10.0, 100.0, 1000.0]), np.array([1e-2, 1e-3, 1e-6]), np.array([5.0, 5.0, 5.0]), 0.0, 0.0, 5.0
)


@pytest.mark.parametrize(
    ("room", "fastest", "unresolved"), [(1e-7, 1000.0, 0.0), (1e-5, 100.0, 2e-6), (2.1e-3, 10.0, 2.002e-3)]
)
def test_steps_follow_the_fastest_vibration_that_matters(room: float, fastest: float, unresolved: float) -> None:
    """Within a radian of its phase after all the time that it lasts: ω T (ωh)² / 8 = 1."""
    found = resolution(SET_OFF, room)
    assert found.unresolved == pytest.approx(unresolved)
    assert fastest * 5.0 * (fastest * found.step) ** 2 / 8 == pytest.approx(1.0)
    assert not found.calm


def test_calm_scenes_follow_their_motion() -> None:
    """A tenth of a radian per step."""
    found = resolution(replace(SET_OFF, prescribed=0.5), 1.0)
    assert found.calm
    assert found.step == pytest.approx(0.2)


def test_busiest_places_hold_the_largest_and_the_last() -> None:
    """One in each stretch."""
    size = np.zeros(100)
    size[[7, 93]] = 1.0
    places = busiest(size, 5)
    assert {7, 93, 99} <= set(places)
    assert len(places) <= 6


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_drive_forces_follow_from_freed_joints(formulation: str) -> None:
    """Those of the reactions, to what accelerations are solved to."""
    scene = load_scene(ROBOT, [f"simulation.formulation={formulation}"])
    equations: Any = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    outputs = Outputs(scene, equations, watched_nodes(equations.mechanism))
    rng = np.random.default_rng(0)
    y, v = 1e-4 * rng.standard_normal((2, equations.size))
    expected = [r.effort for r in equations.reactions(0.4, y, v)]
    assert outputs.efforts(0.4, y, v) == pytest.approx(expected, rel=1e-6)
