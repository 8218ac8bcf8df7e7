"""Links that deflect beyond any meaning end a run, wherever and however it is computed, and say why."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SimulationError
from erls.run.chain.run import ChainRun
from erls.run.file import load_run, save_run
from erls.run.watches.runaway import LARGEST
from erls.run.watches.spin_stability import spin_warnings

SPIN_UP = scenes.ROOT / "data/spin_up/beam.toml"
TALL = scenes.ROOT / "data/l_shape/steel_tall.toml"
SPINNING = [scenes.LINEAR, "simulation.step=1e-2"]
HEAVY = ['simulation.effects="-modal_inertia"', "gravity=[0, 0, -1e6]"]


def failed(scene: Path, changes: list[str]) -> tuple[SimulationError, ChainRun, list[str]]:
    """How a run fails, what was computed, and what was told."""
    told: list[str] = []
    with pytest.raises(SimulationError) as caught:
        erls.simulate(erls.load_scene(scene, changes), tell=told.append)
    assert caught.value.cause is Cause.RUNAWAY
    assert caught.value.exit_code == 3
    return caught.value, caught.value.run, told


@pytest.mark.parametrize(
    "changes",
    [
        [],
        ["simulation.integrator=lobatto"],
        ["simulation.output_step=0.5"],
        ["simulation.formulation=ffr"],
    ],
    ids=lambda changes: " ".join(changes) or "generalized_alpha",
)
def test_a_beam_that_lost_stability(changes: list[str]) -> None:
    """It ends soon after; the warning comes first, nothing absurd follows, and what was computed is kept."""
    problem, run, told = failed(SPIN_UP, [*SPINNING, *changes])
    assert 8.55 < run.end < 12  # the speed is reached at 8.55 s
    assert problem.where == f"t = {run.end:.6g} s"
    assert "geometric_stiffening" in (problem.remedy or "")
    assert "loses stability" in run.warnings[0]
    assert told.index(f"warning: {run.warnings[0]}") <= 2
    assert not [text for text in run.warnings if "expect errors" in text]
    places = run.position("tip", run.times)
    assert np.linalg.norm(places[-1] - places[0]) < 1.5 * LARGEST * 10.0
    assert np.linalg.norm(run.position("tip", 8.0)) == pytest.approx(10.0, rel=0.1)


def test_whatever_the_chunks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The end is the first step beyond the limit, not that of the compiled steps that passed it."""
    from erls.integrate import driver

    first = failed(SPIN_UP, SPINNING)[1]
    second = failed(SPIN_UP, [*SPINNING, "simulation.duration=10.2"])[1]  # 8 steps before the end
    monkeypatch.setattr(driver, "LARGEST_CHUNK", 8)
    third = failed(SPIN_UP, SPINNING)[1]
    for other in (second, third):
        assert other.end == pytest.approx(first.end, abs=1e-9)
    np.testing.assert_array_equal(first.solution.t, third.solution.t)
    save_run(tmp_path / "r.h5", first)
    assert load_run(tmp_path / "r.h5").end == first.end


@pytest.mark.parametrize("integrator", ["lobatto", "generalized_alpha"])
def test_loads_beyond_the_link(integrator: str) -> None:
    """A hundred thousand times its weight: not its spin but its loads are to be looked at, and no estimate follows."""
    problem, run, _ = failed(TALL, [*HEAVY, f"simulation.integrator={integrator}", "simulation.step=1e-4"])
    assert "check loads" in (problem.remedy or "")
    assert run.end < 0.1
    assert all("steps were halved" in text for text in run.warnings)


def test_pieces_of_a_link() -> None:
    """By the size of the piece; loads that turn it too fast are named as such."""
    changes = ["simulation.formulation=ffr", "links.l.substructures=2", "gravity=[0, 0, -1e5]", "simulation.step=1e-4"]
    changes.append(scenes.LINEAR)
    problem, run, _ = failed(TALL, changes)
    assert "link 'l/2'" in str(problem)
    assert "5 m" in (problem.limit or "")
    assert "geometric_stiffening" in (problem.remedy or "")
    assert run.end < 0.1


def test_rates_without_bound_are_no_matter_of_spin() -> None:
    """Of what is not finite no eigenvalue is asked."""
    mechanism = erls.simulate(erls.load_scene(TALL, [scenes.LINEAR, "simulation.duration=1e-3"])).formulation.mechanism
    states = [(t, np.zeros(1), np.array([rate])) for t, rate in enumerate((np.nan, np.inf, 1e200, 1e3))]
    (text,) = spin_warnings(mechanism, states)
    assert "reached at t = 3 s" in text


def test_far_deflections_are_no_failure() -> None:
    """A hundred times its weight is a matter of warnings."""
    run = erls.simulate(erls.load_scene(TALL, ["gravity=[0, 0, -1e3]", "simulation.duration=0.02"]))
    assert run.failure is None
