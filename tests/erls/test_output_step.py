"""``output_step``: of many steps few knots are kept, the same ones to the bit, and memory stays flat."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
import scenes
from compiled_modes import CompiledElasticPendulum
from small_systems import ElasticPendulum

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.integrators import INTEGRATORS
from erls.integrators.base import Options, Solution
from erls.integrators.driver import Recorder

ROBOT = scenes.ROOT / "data/robot/two_link.toml"


def feed(recorder: Recorder, times: np.ndarray, chunk: int) -> None:
    """Knots whose numbers tell their time, in chunks."""
    for start in range(0, len(times), chunk):
        t = times[start : start + chunk]
        recorder.extend(t, np.repeat(t, 3).reshape(-1, 3, 1))


@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_the_first_knot_of_each_stretch_is_kept(chunk: int) -> None:
    """Beside the ends of legs; chunks do not matter."""
    recorder = Recorder(1, None, capacity=4, apart=0.1)
    zero, one = np.zeros(1), np.full(1, 1.03)
    recorder.begin(0.0, zero, zero, zero)
    feed(recorder, np.linspace(0, 1.03, 104)[1:], chunk)
    recorder.begin(1.03, one, one, one)  # a jump: both sides of it stay
    feed(recorder, 1.03 + np.linspace(0, 0.4, 41)[1:], chunk)
    found = recorder.solution()
    expected = [*np.arange(11) / 10, 1.03, 1.03, 1.1, 1.2, 1.3, 1.4, 1.43]
    np.testing.assert_allclose(found.t, expected, atol=1e-12)
    np.testing.assert_array_equal(found.y[:, 0], found.t)
    np.testing.assert_array_equal(found.a[:, 0], found.t)
    assert found.work.steps == recorder.steps == 143
    assert recorder.time == found.t[-1]


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_every_integrator_keeps_the_same_motion(name: str) -> None:
    """The knots that are kept are those of the run that keeps all, the last one among them."""
    start, still = np.array([0.3, 0.01]), np.zeros(2)
    runs = [
        INTEGRATORS[name](ElasticPendulum(50.0), (0, 1), start, still, Options(1e-3, output_step=apart))
        for apart in (None, 0.05)
    ]
    places = np.searchsorted(runs[0].t, runs[1].t)
    assert len(runs[1].t) < len(runs[0].t)
    assert np.diff(runs[1].t)[:-1].min() >= 0.05 - np.diff(runs[0].t).max() - 1e-12
    for part in ("t", "y", "v", "a"):
        np.testing.assert_array_equal(getattr(runs[1], part), getattr(runs[0], part)[places])
    assert runs[1].t[-1] == 1.0
    assert runs[1].work == runs[0].work


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_a_scene_keeps_what_it_asks_for(formulation: str) -> None:
    settings = ["simulation.duration=0.02", f"simulation.formulation={formulation}", "simulation.step=1e-3"]
    every, few = (
        erls.simulate(erls.load_scene(ROBOT, [*settings, *more])) for more in ((), ("simulation.output_step=5e-3",))
    )
    assert (len(every.solution.t), len(few.solution.t)) == (21, 5)
    np.testing.assert_array_equal(few.solution.y, every.solution.y[::5])
    np.testing.assert_allclose(few.position("end2", few.times), every.position("end2", few.times), atol=1e-15)


def test_an_observer_sees_the_last_knot_and_a_failed_run_keeps_it() -> None:
    seen: list[float] = []

    def look(t: float, knots: Callable[[], Solution]) -> None:
        assert knots().t[-1] == t
        seen.append(t)
        if t > 0.35:
            raise SimulationError(Cause.INTERRUPTED, "enough")

    options = Options(1e-2, output_step=0.1)
    system = ElasticPendulum(50.0)
    found = INTEGRATORS["generalized_alpha"](system, (0, 1), np.array([0.3, 0.0]), np.zeros(2), options, look)
    assert found.failure is not None
    np.testing.assert_allclose(found.t, [0, 0.1, 0.2, 0.3, 0.36], atol=1e-12)
    assert found.t[-1] == seen[-1]


def test_memory_does_not_grow_with_steps() -> None:
    """Ten times as many steps, the same knots: the same memory within a tenth."""
    peaks = []
    for step in (1e-4, 1e-5):
        tracemalloc.start()
        start, options = np.array([0.3, 0.01]), Options(step, output_step=0.1)
        run = INTEGRATORS["generalized_alpha"](CompiledElasticPendulum(50.0), (0, 5), start, np.zeros(2), options)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert run.work.steps == round(5 / step)
        assert len(run.t) == 51
    assert peaks[1] <= 1.1 * peaks[0]


def test_it_must_be_positive() -> None:
    with pytest.raises(SceneError) as caught:
        erls.load_scene(ROBOT, ["simulation.output_step=0"])
    assert caught.value.cause is Cause.BAD_FIELD
    with pytest.raises(SceneError, match="output_step"):
        Options(output_step=float("nan"))
