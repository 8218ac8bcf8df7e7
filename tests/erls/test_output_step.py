"""``output_step``: of many steps few states are kept, as exact as the steps; what looks along the run sees the same
as without, and memory stays flat.
"""

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
from erls.integrate.base import Options, Solution, hermite_knots
from erls.integrate.driver import Recorder
from erls.integrate.registry import integrator_named
from erls.integrate.thinning import FEWEST, output_step
from erls.run.watches.stored_output import output_error
from erls.scene.integrators import INTEGRATORS
from erls.scene.settings import Simulation

ROBOT = scenes.ROOT / "data/robot/two_link.toml"
FLAT = scenes.ROOT / "data/l_shape/steel_flat.toml"


POLYNOMIAL = np.polynomial.Polynomial([0.3, -1.0, 2.0, 1.5, -0.7, 0.2])  # which quintic interpolation meets


def motion(t: np.ndarray) -> np.ndarray:
    """(k, 3, 1) y, v, a."""
    return np.stack([POLYNOMIAL.deriv(order)(t) if order else POLYNOMIAL(t) for order in range(3)], axis=1)[..., None]


def feed(recorder: Recorder, times: np.ndarray, chunk: int) -> None:
    """Knots of the polynomial, in chunks."""
    for start in range(0, len(times), chunk):
        recorder.extend(times[start : start + chunk], motion(times[start : start + chunk]))


@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_states_at_even_times_are_kept(chunk: int) -> None:
    """Interpolated within a step; beside the ends of legs, and of steps that hold several of these times."""
    recorder = Recorder(1, None, capacity=4, apart=0.1)
    recorder.begin(0.0, *motion(np.zeros(1))[0])
    feed(recorder, np.linspace(0, 1.03, 76)[1:], chunk)
    recorder.begin(1.03, *motion(np.full(1, 1.03))[0])  # a jump: both sides of it stay
    feed(recorder, np.array([1.06, 1.33, 1.35, 1.37, 1.43]), chunk)
    found = recorder.solution()
    expected = [*np.arange(11) / 10, 1.03, 1.03, 1.06, 1.33, 1.4, 1.43]
    np.testing.assert_allclose(found.t, expected, atol=1e-12)
    for k, part in enumerate((found.y, found.v, found.a)):
        np.testing.assert_allclose(part[:, 0], motion(found.t)[:, k, 0], rtol=1e-9)
    assert found.work.steps == recorder.steps == 80
    assert recorder.time == found.t[-1]


@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_an_observer_sees_every_step_and_keeps_some(chunk: int) -> None:
    """Each step reaches it once; those around the times that it returns stay as they are."""
    seen: list[float] = []

    def look(t: float, knots: Callable[[], Solution]) -> list[float]:
        times = knots().t
        seen.extend(x for x in times[times > (seen[-1] if seen else -1.0)] if x in every)
        return [time for time in (0.234, 0.777) if times[-1] - chunk * 0.01 < time <= times[-1]]

    every = np.linspace(0, 1, 101)
    recorder = Recorder(1, look, apart=0.25)
    recorder.begin(0.0, *motion(np.zeros(1))[0])
    feed(recorder, every[1:], chunk)
    np.testing.assert_array_equal(seen, every)
    found = recorder.solution()
    np.testing.assert_allclose(found.t, [0, 0.23, 0.24, 0.25, 0.5, 0.75, 0.77, 0.78, 1.0], atol=1e-12)
    assert np.isin(found.t, every).all()


@pytest.mark.parametrize("apart", [1e-300, 5e-324])
def test_of_long_steps_both_ends_are_kept(apart: float) -> None:
    recorder = Recorder(1, None, apart=apart)
    recorder.begin(0.0, *motion(np.zeros(1))[0])
    feed(recorder, np.linspace(0, 1, 11)[1:], 4)
    np.testing.assert_array_equal(recorder.solution().t, np.linspace(0, 1, 11))


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_every_integrator_keeps_the_same_motion(name: str) -> None:
    """What is kept lies on the interpolated motion of the run that keeps all; the last knot is among it."""
    start, still = np.array([0.3, 0.01]), np.zeros(2)
    runs = [
        integrator_named(name)(ElasticPendulum(50.0), (0, 1), start, still, Options(1e-3, output_step=apart))
        for apart in (None, 0.05)
    ]
    np.testing.assert_allclose(runs[1].t, np.linspace(0, 1, 21), atol=1e-12)
    expected = hermite_knots(runs[0].t, runs[0].y, runs[0].v, runs[0].a, runs[1].t)
    for part, right in zip(("y", "v", "a"), expected, strict=True):
        size = np.abs(getattr(runs[0], part)).max()
        np.testing.assert_allclose(getattr(runs[1], part), right, atol=1e-9 * size)
    assert runs[1].t[-1] == 1.0
    assert runs[1].work == runs[0].work


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_a_scene_keeps_what_it_asks_for(formulation: str) -> None:
    """At least 201 states; those of steps to the bit."""
    settings = ["simulation.duration=0.02", f"simulation.formulation={formulation}", "simulation.step=2e-5"]
    every, few = (
        erls.simulate(erls.load_scene(ROBOT, [*settings, *more]), verdict=False)
        for more in ((), ("simulation.output_step=5e-3",))
    )
    assert (len(every.solution.t), len(few.solution.t)) == (1001, FEWEST + 1)
    np.testing.assert_array_equal(few.solution.y[:, :12], every.solution.y[::5, :12])
    np.testing.assert_allclose(few.position("end2", few.times), every.position("end2", few.times), atol=1e-15)


def test_distances_are_parts_of_what_a_scene_asks_for() -> None:
    """As fine as is asked for, never coarser than a part of the run, and its multiples are always stored."""
    coarse = ((0.5, 0.01), (0.03, 0.01), (0.025, 0.025 / 3), (2.0, 0.01), (1e300, 0.01))
    for asked, found in ((0.003, 0.003), (0.01, 0.01), *coarse):
        assert output_step(Simulation(2.0, output_step=asked)) == pytest.approx(found, rel=1e-12)
    assert output_step(Simulation(2.0)) is None


LOW = {"name": "low", "point": "tip", "coordinate": "z", "value": -0.3}


@pytest.mark.parametrize("integrator", ["lobatto", "generalized_alpha"])
def test_events_are_found_within_the_steps(integrator: str) -> None:
    """The same event, end and last position as where every step is kept; one there and back is not missed either."""
    far = {**LOW, "name": "far", "coordinate": "x", "value": 0.4999}
    for events in ([{**LOW, "stop": True}], [LOW, far]):
        settings = ["simulation.duration=0.3", f"simulation.integrator={integrator}", f"events={scenes.toml(events)}"]
        every, few = (
            erls.simulate(erls.load_scene(FLAT, [*settings, *more]), verdict=False)
            for more in ((), ("simulation.output_step=0.5",))
        )
        assert every.events
        assert [h.name for h in few.events] == [h.name for h in every.events]
        np.testing.assert_allclose([h.time for h in few.events], [h.time for h in every.events], atol=1e-12)
        assert few.end == every.end
        for happening in every.events:
            np.testing.assert_allclose(
                few.position("tip", happening.time), every.position("tip", happening.time), atol=1e-12
            )
        assert not [text for text in few.warnings if "output_step" not in text]
    assert every.events[-1].time == pytest.approx(0.2432, abs=5e-5)


@pytest.mark.parametrize("apart", [0.1, 100.0])
def test_energies_and_warnings_are_those_of_the_steps(apart: float) -> None:
    """States at multiples are those of the run that keeps all; the rest says that it is interpolated."""
    every, few = (
        erls.simulate(erls.load_scene(FLAT, ["simulation.duration=1.0", *more]), verdict=False)
        for more in ((), (f"simulation.output_step={apart}",))
    )
    times = np.arange(11) / 10
    np.testing.assert_allclose(few.position("tip", times), every.position("tip", times), atol=1e-9)
    drift = [run.summary()["energy"]["max_drift"] for run in (every, few)]
    assert drift[1] <= 1.1 * drift[0]
    assert not every.warnings
    assert all("interpolation is off by about" in text for text in few.warnings)
    between = np.linspace(0, 1, 2001)
    off = np.linalg.norm(few.position("tip", between) - every.position("tip", between), axis=1).max()
    assert 0.1 * off <= output_error(few) <= 10 * off


def test_what_is_not_resolved_is_told_once() -> None:
    """30 s of the L, of which states every 0.2 s say little: about as much as its tip is really off between them."""
    settings = ["simulation.duration=30", "simulation.output_step=0.2"]
    few = erls.simulate(erls.load_scene(FLAT, settings), verdict=False)
    (text,) = few.warnings
    assert text.startswith("simulation.output_step = 0.2 s: between stored states, 0.1 s apart, interpolation is off")
    every = erls.simulate(erls.load_scene(FLAT, settings[:1]), verdict=False)
    between = np.linspace(0, 30, 3001)
    off = np.linalg.norm(few.position("tip", between) - every.position("tip", between), axis=1).max()
    assert 0.1 * off <= output_error(few) <= 10 * off


def test_an_observer_sees_the_last_knot_and_a_failed_run_keeps_it() -> None:
    seen: list[float] = []

    def look(t: float, knots: Callable[[], Solution]) -> None:
        assert knots().t[-1] == t
        seen.append(t)
        if t > 0.35:
            raise SimulationError(Cause.INTERRUPTED, "enough")

    options = Options(1e-2, output_step=0.1)
    system = ElasticPendulum(50.0)
    found = integrator_named("generalized_alpha")(system, (0, 1), np.array([0.3, 0.0]), np.zeros(2), options, look)
    assert found.failure is not None
    np.testing.assert_allclose(found.t, [0, 0.1, 0.2, 0.3, 0.36], atol=1e-12)
    assert found.t[-1] == seen[-1]


def test_memory_does_not_grow_with_steps() -> None:
    """Ten times as many steps, the same knots: the same memory within a tenth."""
    peaks = []
    for step in (1e-4, 1e-5):
        tracemalloc.start()
        start, options = np.array([0.3, 0.01]), Options(step, output_step=0.1)
        run = integrator_named("generalized_alpha")(CompiledElasticPendulum(50.0), (0, 5), start, np.zeros(2), options)
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
