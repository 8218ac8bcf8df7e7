"""A second run at another tolerance: which one is made, what it may cost, and how often such runs are looked at."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
import scenes

import erls
from erls.accuracy import second_run
from erls.accuracy.judged_places import judged_nodes
from erls.accuracy.second_run import LARGER, run_at, second_run_error
from erls.integrate.base import Solution
from erls.integrate.choice import integrator, options_of

LIMITED = {"type": "pd", "proportional_gain": 400.0, "derivative_gain": 2.0, "torque_limit": 1.5}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> erls.ChainRun:
    """Three links on motors that reach their limits again and again."""
    path = scenes.three_links(tmp_path_factory.mktemp("limits"))
    data = scenes.read_toml(path)
    motion = {"shape": "sine", "amplitude": 0.5, "frequency_hz": 2.0}
    joints = [{**joint, "drive": {**LIMITED, "motion": motion}} for joint in data["joints"]]
    changed = scenes.write_toml(path, {**data, "joints": joints, "simulation": {"duration": 0.3}})
    return erls.simulate(erls.load_scene(changed), verdict=False)


def test_it_ends_once_it_takes_more_steps_than_it_may(run: erls.ChainRun, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("erls.integrate.driver._PAUSE", 0.0)  # all steps are looked at
    whole = run_at(run, LARGER)
    assert whole is not None
    assert run_at(run, LARGER, whole.work.steps) is not None
    assert run_at(run, LARGER, whole.work.steps / 2) is None


@pytest.mark.parametrize(
    ("enough", "fails", "asked"),
    [
        (1.0, (), [8.0]),
        (0.0, (), [8.0, 1 / 8]),  # as many steps tell nothing
        (0.0, (1 / 8,), [8.0, 1 / 8]),  # but where there is no better run
        (1.0, (8.0,), [8.0, 1 / 8]),
        (1.0, (8.0, 1 / 8), [8.0, 1 / 8, 8.0]),
    ],
)
def test_a_better_run_is_made_where_a_larger_tolerance_tells_nothing(
    enough: float, fails: tuple[float, ...], asked: list[float], run: erls.ChainRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = list[float]()

    def recorded(run: Any, times: float, steps: float = np.inf) -> Solution | None:
        made.append(times)
        return None if times in fails else run_at(run, times)

    monkeypatch.setattr(second_run, "run_at", recorded)
    monkeypatch.setattr(second_run, "LIKE", enough)
    found = second_run_error(run, judged_nodes(run))
    assert made == asked
    assert (found is None) == (set(asked) <= set(fails))


def test_switches_are_told_no_more_often_than_steps(run: erls.ChainRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who looks on may copy the run so far, as where joints exchange rotation vectors: at each switch of thousands that
    took longer than the run.
    """
    settings, looks = run.scene.record.simulation, list[float]()
    integrate = integrator(run.formulation.mechanism, settings)

    def counted() -> int:
        looks.clear()
        state = run.formulation.initial_state()
        integrate(run.formulation, (0.0, 0.3), *state, options_of(settings), lambda t, knots: looks.append(t))
        return len(looks)

    monkeypatch.setattr("erls.integrate.driver._PAUSE", 0.0)
    every = counted()
    monkeypatch.setattr("erls.integrate.driver._PAUSE", 1e9)
    assert every > 50
    assert counted() <= 2
    assert looks[-1] == pytest.approx(0.3)


def test_a_run_that_keeps_few_states_keeps_those_at_switches(
    run: erls.ChainRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However seldom it is looked at: but for vibrations between those, of 2.2e-4 m as the run warns."""
    monkeypatch.setattr("erls.integrate.driver._PAUSE", 1e9)
    few = erls.simulate(replace(run.scene, record=_with_output(run, 10.0)), verdict=False)
    assert isinstance(few, erls.ChainRun)
    assert len(few.solution.t) < len(run.solution.t)
    t = np.linspace(0.0, 0.3, 301)
    places = run.position("end", t)
    apart = np.linalg.norm(few.position("end", t) - places, axis=1)
    assert apart.max() < 3e-4  # m; without them 0.14


def _with_output(run: erls.ChainRun, step: float) -> Any:
    settings = msgspec.structs.replace(run.scene.record.simulation, output_step=step)
    return msgspec.structs.replace(run.scene.record, simulation=settings)
