"""What effects that a run leaves out would have changed: followed along the run, or told by a run that has them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from scenes import ROOT

import erls
from erls.accuracy import left_out_effects
from erls.accuracy.left_out_effects import effects_error
from erls.auto.certify import certify, following
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import ALL, in_order
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism

L_SHAPE, ROBOT = ROOT / "data/l_shape/steel_flat.toml", ROOT / "data/robot/two_link.toml"
APART = 1.3  # of both ways: a run with all effects counts 1.2 times, and has an error of integration


def _without(path: Path, effect: str) -> ChainRun:
    names = ",".join(f'"{name}"' for name in in_order(ALL - {effect}))
    changes = [f"simulation.effects=[{names}]", "simulation.duration=0.3"]
    run = erls.simulate(erls.load_scene(path, changes), verdict=False)
    assert isinstance(run, ChainRun)
    return run


def _whole(run: ChainRun) -> Mechanism:
    record = run.scene.record
    every = msgspec.structs.replace(record.simulation, effects=in_order(ALL))
    return build_mechanism(replace(run.scene, record=msgspec.structs.replace(record, simulation=every))).mechanism


@pytest.mark.parametrize(("path", "effect"), [(L_SHAPE, "centrifugal_load"), (ROBOT, "gravity")])
def test_a_run_with_all_effects_says_what_following_their_error_does(path: Path, effect: str) -> None:
    """Within `APART`, by fewer evaluations: a run without gravity takes a tenth of one with it."""
    run = _without(path, effect)
    stated, why = effects_error(run)
    assert not why
    assert stated is not None
    followed = following(run, _whole(run))
    assert 4 * followed.steps > run.solution.work.rhs_calls
    assert stated > 1e-5
    assert 1 / APART <= stated / certify(run, followed).error <= APART


def test_an_error_that_is_followed_in_fewer_steps_asks_for_no_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two thousand steps of a fall take more evaluations than 500 steps of its error do."""
    run = _without(L_SHAPE, "joint_damping")  # it has none: nothing is present, nothing is asked
    assert effects_error(run) == (0.0, "")
    names = ",".join(f'"{name}"' for name in in_order(ALL - {"gravity"}))
    changes = [f"simulation.effects=[{names}]", "simulation.duration=0.02", "simulation.step=1e-5"]
    run = erls.simulate(erls.load_scene(L_SHAPE, [*changes, "simulation.effects_tolerance=1"]), verdict=False)
    assert isinstance(run, ChainRun)
    assert run.solution.work.rhs_calls > 2000
    monkeypatch.setattr(left_out_effects, "error_beside", None)
    stated, _ = effects_error(run)
    free_fall = 0.5 * 9.81 * 0.02**2
    assert stated is not None
    assert 0.5 * free_fall < stated < 3 * free_fall  # ends begin with at most 3/2 g


FIXED = ("simulation.integrator='generalized_alpha'", "simulation.step=0.004")


@pytest.mark.parametrize("more", [("simulation.effects='all'",), ("simulation.effects='auto'",), FIXED])
def test_modes_that_follow_statically_state_what_that_leaves_out(more: tuple[str, ...]) -> None:
    """The L let go, modes above 50 Hz static: against a run in which all move; ``auto`` tells by what loads do. Fixed
    steps do not resolve these modes.
    """
    changes = [*more, "simulation.duration=0.3"]
    run = erls.simulate(erls.load_scene(L_SHAPE, [*changes, "simulation.bandwidth=50"]))
    whole = erls.simulate(erls.load_scene(L_SHAPE, ["simulation.duration=0.3", "simulation.tolerance=1e-6"]))
    assert isinstance(run, ChainRun)
    assert isinstance(whole, ChainRun)
    assert run.accuracy is not None
    assert run.accuracy.effects is not None
    times = np.linspace(0.0, 0.3, 301)
    apart = run.position("tip", times) - whole.position("tip", times)
    actual = float(np.linalg.norm(apart, axis=1).max())
    assert actual > 5e-6
    assert actual <= run.accuracy.effects <= 20 * actual


def test_where_a_run_of_all_modes_takes_too_long_their_loads_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few times what the run in which they move says."""
    changes = ["simulation.duration=0.3", "simulation.bandwidth=50"]
    run = erls.simulate(erls.load_scene(L_SHAPE, changes), verdict=False)
    assert isinstance(run, ChainRun)
    beside, _ = effects_error(run)
    monkeypatch.setattr(left_out_effects, "error_beside", lambda *given: (None, "too long"))
    alone, why = effects_error(run)
    assert not why
    assert beside is not None
    assert alone is not None
    assert 1 / 3 <= alone / beside <= 20


def test_a_strict_run_lets_all_modes_move_where_that_is_asked_for() -> None:
    """Beyond the tolerance by what follows statically, within it without a bandwidth."""
    changes = ["simulation.duration=0.3", "simulation.bandwidth=20"]
    loose = erls.simulate(erls.load_scene(L_SHAPE, changes))
    assert loose.trust is not None
    assert loose.trust.verdict == "limited"
    assert "bandwidth" in loose.trust.reasons[0]
    run = erls.simulate(erls.load_scene(L_SHAPE, changes), strict=True)
    assert isinstance(run, ChainRun)
    assert run.trust is not None
    assert run.trust.verdict == "good"
    assert run.formulation.mechanism.bandwidth is None
