"""Planned motions of mechanisms with closed loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SimulationError
from erls.tracking.goal import Goal, goal_of
from erls.tracking.laws import polynomial
from erls.tracking.plan import plan, run_law

FOUR_BAR = scenes.ROOT / "data" / "four_bar" / "flexible.toml"
LEGS = scenes.ROOT / "data" / "inverse" / "three_legs.toml"
STILL = ("gravity=[0.0, 0.0, 0.0]", "initial={}", "simulation.integrator=generalized_alpha")
RIGID = tuple(f"links.{k}.flexible=false" for k in range(3))


def four_bar(to_deg: float, *changes: str) -> Any:
    """Its crank goes from 60 degrees, with at most 2 N m."""
    planned = f"plan={{ swing=1e-4, joints={{ crank_pivot={{ to_deg={to_deg}, effort=2.0 }} }} }}"
    return erls.load_scene(FOUR_BAR, [*STILL, planned, *changes])


def test_rigid_links_need_what_their_table_says() -> None:
    """Under their weight: efforts of a run, by the same equations of motion, and by nodal ones between whose steps
    outputs are interpolated; not at the end, where the table of the motion lets accelerations jump. Beyond what the
    weight takes, the work of a motion from rest to rest is none.
    """
    goal = goal_of(four_bar(120.0, *RIGID, "simulation.step=0.0005", "gravity=[0.0, 0.0, -9.81]"))
    law = polynomial(0.3, 7, 401)
    needed = goal.rigid(law.place, law.rate, law.acceleration)[:, 0]
    for formulation, rounding in (("erls", 1e-9), ("nodal", 1e-4)):
        ran = run_law(goal, law, formulation).efforts[:, 0]
        assert np.abs(ran - needed)[:-1].max() < rounding * np.abs(needed).max()
    resting = goal.rigid(law.place, 0 * law.rate, 0 * law.rate)[:, 0]
    power = np.abs(needed * law.rate).max() * law.duration
    assert np.trapezoid((needed - resting) * law.rate, law.t) == pytest.approx(0.0, abs=1e-5 * power)
    assert not goal.modes


def _ending(goal: Goal, law: Any) -> tuple[float, float]:
    """Of the slowest vibration, by the model and by a run [m]."""
    return abs(goal.modes[0].ending(law.step, len(law.t)) @ law.acceleration), abs(run_law(goal, law).endings[0])


def test_vibrations_beside_the_end_are_as_foretold() -> None:
    """A tenth of a degree of the crank: what its links and the loop leave swinging, to 1 %."""
    goal = goal_of(four_bar(60.1, "plan.swing=1e-6", "simulation.step=0.0002"))
    model, run = _ending(goal, polynomial(0.03, 7, 401))
    assert model > 1e-5
    assert run == pytest.approx(model, rel=0.01)


def test_flexible_four_bar_is_within_its_bounds() -> None:
    """In a forward run with its links as they bend."""
    found = plan(four_bar(180.0, "simulation.step=0.001"))
    assert found.kept
    assert found.peaks[0] <= 2.0
    assert found.swing <= 1e-4


def test_poses_that_loops_do_not_reach_are_refused() -> None:
    """By how far the way can be gone: legs are stretched out."""
    joints = ", ".join(f"motor_{k}={{ to_deg={to}, effort=2.0 }}" for k, to in ((1, 100.0), (2, 90.0), (3, 60.0)))
    with pytest.raises(SimulationError, match=r"43 % of the way") as caught:
        plan(erls.load_scene(LEGS, [f"plan={{ joints={{ {joints} }} }}"]))
    assert caught.value.cause is Cause.NO_PLAN
