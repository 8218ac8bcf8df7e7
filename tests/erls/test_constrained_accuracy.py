"""Generalized-α with steps for a tolerance over the whole run, and what such runs state of their error.

Actual errors come from tables, or from the same with steps so much smaller, extrapolated by their order, that what is
left is a hundredth of what is judged.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import heavy_top
import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, body_scene
from small_systems import Modes

import erls
from erls.accuracy.constrained_integration import ConstrainedError, constrained_integration_error
from erls.errors import Cause, SimulationError
from erls.integrate.alpha_spectrum import step_errors
from erls.integrate.base import Options, Solution
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.generalized_alpha import generalized_alpha
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.integrate.step_distance import distance_bands, errors_over_time, factor_needed, parted_at, step_ratio
from erls.integrate.step_plans import Stretch, finer, plan_like
from erls.maths.so3 import Array
from erls.run.bodies.motion import BodyMotion
from erls.run.chain.run import ChainRun

DATA = scenes.ROOT / "data"
AIM = 1e-5
"""Of integration, a tenth of the default tolerance [m]."""

TOO_LARGE = 5.0
"""Stated over actual errors, at most: what issue and documentation call well stated."""

ABSOLUTE = ("simulation.formulation=ffr", "simulation.coordinates=absolute", "simulation.duration=0.2")
NODAL = ("simulation.formulation=nodal", "simulation.elements_per_member=4", "simulation.duration=0.4")
SLOW = DATA / "heavy_top" / "slow.toml"


def _run(path: Path, *changes: str) -> Any:
    return erls.simulate(erls.load_scene(path, changes), verdict=False)


def _stated(run: ChainRun | BodyMotion) -> ConstrainedError:
    found = constrained_integration_error(run)
    assert isinstance(found, ConstrainedError)
    return found


def _positions(run: ChainRun | BodyMotion, times: Array) -> Array:
    return np.stack([run.position(name, times) for name in run.point_names], axis=1)


def _apart(run: ChainRun | BodyMotion, exact: Array, times: Array) -> float:
    return float(np.linalg.norm(_positions(run, times) - exact, axis=-1).max())


def _extrapolated(path: Path, changes: tuple[str, ...], step: float, times: Array) -> Array:
    """(k, p, 3) places from two runs with small steps, of order 2."""
    one, two = (_positions(_run(path, *changes, f"simulation.step={h}"), times) for h in (step, step / 2))
    return two + (two - one) / 3


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.8, 1.0])
def test_what_a_step_makes_of_a_vibration(radius: float) -> None:
    """Against runs of an oscillator, amplitude and phase over 100 steps: to θ²/8, by which (y, v/ω) is an ellipse."""
    phase = np.array([0.05, 0.2, 0.5])
    steps, found = 200, step_errors(radius, phase)
    options = Options(1.0, spectral_radius=radius, newton_tolerance=1e-15)
    run = generalized_alpha(Modes(phase.tolist()), (0, steps), np.ones(3), np.zeros(3), options)
    motion = run.y - 1j * run.v / phase
    made = np.log(motion[-1] / motion[steps // 2] * np.exp(-1j * phase * steps / 2)) / (steps / 2)
    off = (made - found) * steps / 2
    assert (np.abs(off.real) <= phase**2 / 8).all()
    assert (np.abs(np.angle(np.exp(1j * off.imag))) <= phase**2 / 8).all()


def test_phase_of_the_trapezoidal_rule() -> None:
    """ρ = 1: nothing is lost, and θ³/12 of the phase, a closed form; 2 atan(θ/2) at any θ."""
    phase = np.array([1e-2, 1.0, 3.0])
    found = step_errors(1.0, phase)
    np.testing.assert_allclose(found.real, 0, atol=1e-12)
    np.testing.assert_allclose(found.imag, 2 * np.arctan(phase / 2) - phase, atol=1e-12)
    assert found[0].imag == pytest.approx(-(phase[0] ** 3) / 12, rel=1e-3)


def _vibration(phase: float, steps: int, amplitude: float, ratio: float) -> tuple[Array, Array, Array]:
    """Exact places of one point, and those that runs with steps of phase θ and ratio θ make, at the finer steps."""
    n = np.arange(steps + 1)
    exact = amplitude * np.exp(1j * phase * n)
    runs = [exact * np.exp(n * step_errors(0.8, np.array([r * phase]))[0] / r) for r in (1.0, ratio)]
    slow = np.linspace(0, 1, steps + 1)  # it moves on meanwhile
    return tuple(np.stack([slow, z.real, z.imag], axis=1)[:, None] for z in (exact, *runs))  # type: ignore[return-value]


@pytest.mark.parametrize("phase", [0.01, 0.03, 0.1, 0.3])
@pytest.mark.parametrize("steps", [250, 1000])
def test_vibrations_out_of_step(phase: float, steps: int) -> None:
    """From resolved to lost phases: error within a factor of 2 of the actual one; the distance over r² - 1 says up to
    ten times too little.
    """
    exact, fine, coarse = _vibration(phase, steps, 1e-3, 4.0)
    t = np.linspace(0, 1, steps + 1)
    bands = distance_bands(t, fine, coarse, steps, 4.0, 0.8)
    actual = float(np.linalg.norm(fine - exact, axis=2).max())
    assert actual / 2 <= errors_over_time(bands).max() <= 2 * actual
    if phase == 0.3 and steps == 1000:
        assert np.linalg.norm(fine - coarse, axis=2).max() / 15 < actual / 8


def test_what_the_coarser_run_makes_up_does_not_count() -> None:
    """A vibration of the coarser run alone counts by 1/(r² - 1), within a factor of 2, not as lost."""
    _, fine, coarse = _vibration(0.2, 1000, 1e-3, 4.0)
    still = fine * [1, 0, 0]
    found = errors_over_time(
        distance_bands(np.linspace(0, 1, 1001), still, still + 1e-3 * (coarse - still), 1000, 4.0, 0.8)
    )
    assert found.max() <= 2 * 1e-6 / 15


def test_points_that_have_parted_count_in_full() -> None:
    """A distance of half the motion is the error itself; before, steps can be told that keep it small."""
    t = np.linspace(0, 1, 201)
    there = np.stack([t, 0 * t, 0 * t], axis=1)[:, None]
    bands = distance_bands(t, there, there + [0, 0.5, 0] * np.minimum(1, t**8)[:, None, None], 200, 4.0, 0.8)
    found = errors_over_time(bands)[:, 0]
    assert found[-1] == pytest.approx(0.5, rel=0.05)
    assert found[60] < 1e-4
    assert factor_needed(bands, 1e-4, 32.0) == 32.0
    assert factor_needed(bands, 1e-4, 32.0, parted_at(bands)) == pytest.approx((0.02 / 15 / 1e-4) ** 0.5, rel=0.25)


def test_plans() -> None:
    """As many steps per stretch, legs apart; a ratio of steps as errors feel it."""
    t = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 2, 801), np.linspace(2, 3, 33)])
    plan = plan_like(np.delete(t, 101))  # no jump at 1, one at 2
    assert [s.start for s in plan] == [0.0, 1.0, 2.0]
    assert [s.steps for s in plan] == [100, 800, 32]
    twice = np.concatenate([t[:901], [2.0 + 1e-11], 1e-11 + t[901:]])  # two switches at nearly the same time
    assert [s.steps for s in plan_like(np.delete(twice, 101))] == [100, 800, 32]
    assert finer(plan, 2.5)[1] == Stretch(1.0, 2.0, 2000)
    assert step_ratio(np.linspace(0, 1, 401), np.linspace(0, 1, 101)) == pytest.approx(4.0)
    assert step_ratio(np.linspace(0, 1, 401), np.linspace(0, 1, 401)) == pytest.approx(1.2)  # the least


@pytest.mark.parametrize("group", ["SE(3)", "R3xSO(3)"])
def test_slow_top(group: str) -> None:
    """The reference motion to what integration aims at, and no error stated that is far from it."""
    run = _run(SLOW, f"simulation.group={group}")
    table = heavy_top.reference()
    actual = float(np.linalg.norm(run.position("top", table["t"]) - table["slow_x"], axis=1).max())
    assert actual <= AIM
    assert actual <= _stated(run).total <= TOO_LARGE * actual


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_the_tolerance_is_kept(tolerance: float) -> None:
    """A tenth of it, and not much less than asked for: steps in proportion to its root."""
    run = _run(SLOW, f"simulation.tolerance={tolerance}")
    table = heavy_top.reference()
    actual = float(np.linalg.norm(run.position("top", table["t"]) - table["slow_x"], axis=1).max())
    assert 0.01 * tolerance <= actual <= 0.1 * tolerance


def test_fast_top_with_fixed_steps() -> None:
    """150 rad/s at 0.5 ms: 4.3 mm; a companion at a quarter of the work says so, and where 0.1 mm end."""
    run = _run(
        DATA / "heavy_top/fast.toml",
        "simulation.step=5e-4",
        "simulation.newton_tolerance=1e-11",
        "simulation.duration=1",
    )
    table, found = heavy_top.reference(), _stated(run)
    early = table["t"] <= 1.0
    off = np.linalg.norm(run.position("top", table["t"][early]) - table["fast_x"][early], axis=1)
    assert off.max() <= found.total <= TOO_LARGE * off.max()
    assert found.evaluations <= 0.5 * run.solution.work.rhs_calls  # more iterations a step, not more than twice as many
    horizon = found.horizon(1e-4)
    assert 0 < horizon < 1
    assert off[table["t"][early] <= horizon].max() <= 1e-4
    assert (np.diff(found.error) >= 0).all()


CASES: dict[str, tuple[Path, tuple[str, ...], float]] = {
    "nodal": (DATA / "l_shape/steel_tall.toml", NODAL, 1e-4),
    "absolute": (DATA / "robot/two_link.toml", ABSOLUTE, 2.5e-5),
    "bodies": (DATA / "slider_crank/fast_beams.toml", ("simulation.duration=0.03",), 2e-5),
}


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> tuple[Path, tuple[str, ...], Array, Array]:
    path, changes, step = CASES[request.param]
    times = np.linspace(0, erls.load_scene(path, changes).record.simulation.duration, 301)
    return path, changes, times, _extrapolated(path, changes, step, times)


def test_default_steps_keep_what_integration_aims_at(case: tuple[Path, tuple[str, ...], Array, Array]) -> None:
    """Within 1e-5 m; stated no less than the actual error, and at most `TOO_LARGE` times that, above 1e-6 m."""
    path, changes, times, exact = case
    run = _run(path, *changes)
    actual, found = _apart(run, exact, times), _stated(run)
    assert actual <= AIM
    assert actual <= found.total <= TOO_LARGE * max(actual, 2e-6)
    assert found.evaluations == 0


@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
def test_fixed_steps_state_their_error(case: tuple[Path, tuple[str, ...], Array, Array], step: float) -> None:
    """A fifth of these steps where a rod vibrates at 3 kHz."""
    path, changes, times, exact = case
    run = _run(path, *changes, f"simulation.step={step / 5 if 'slider' in str(path) else step}")
    actual, found = _apart(run, exact, times), _stated(run)
    assert actual <= found.total <= TOO_LARGE * actual
    assert found.evaluations > 0


def test_a_start_that_larger_steps_do_not_resolve() -> None:
    """A robot whose last joint is let go to its motor, which it follows within a step: at 1 ms 9.1e-5 m off after 43
    ms, at 4 ms no more than 2.6e-4 m in place of 16 times as much, so that the distance alone would say 3.7e-5 m.
    """
    path, times = DATA / "optimization/three_link_scene.toml", np.linspace(0, 0.1, 201)
    exact = _extrapolated(path, ("simulation.duration=0.1",), 1e-4, times)
    run = _run(path, "simulation.duration=0.1")
    actual = _apart(run, exact, times)
    assert actual > 8e-5
    assert actual <= _stated(run).total <= 3 * actual


def test_steps_that_cannot_be_larger() -> None:
    """Newton's method halves larger steps of the soft L, which then say nothing: steps half as large do."""
    path = DATA / "l_shape/torque.toml"
    changes, times = ("simulation.formulation=nodal", "simulation.duration=0.3"), np.linspace(0, 0.3, 301)
    exact = _extrapolated(path, changes, 1e-4, times)
    run = _run(path, *changes, "simulation.step=1e-3")
    actual, found = _apart(run, exact, times), _stated(run)
    assert actual <= found.total <= TOO_LARGE * actual
    assert found.evaluations > run.solution.work.rhs_calls


def test_independent_coordinates_too() -> None:
    """Fixed steps of a chain in joint angles, against its own adaptive method at a thousandth of what is judged."""
    path, changes = DATA / "robot/two_link.toml", ("simulation.formulation=ffr", "simulation.duration=0.2")
    run = _run(path, *changes, "simulation.step=5e-4")
    times = np.linspace(0, 0.2, 301)
    exact = _positions(_run(path, *changes, "simulation.tolerance=1e-7"), times)
    actual, found = _apart(run, exact, times), _stated(run)
    assert actual <= found.total <= TOO_LARGE * actual


def test_coordinates_agree_by_default() -> None:
    """Absolute coordinates and joint angles, each with steps of its own, within what integration aims at."""
    one = _run(DATA / "robot/two_link.toml", *ABSOLUTE)
    other = _run(DATA / "robot/two_link.toml", "simulation.formulation=ffr", "simulation.duration=0.2")
    times = np.linspace(0, 0.2, 101)
    assert _apart(one, _positions(other, times), times) <= AIM


def _chain_of_rods(folder: Path, count: int) -> Path:
    """Rods of 0.3 m on pins, let go near their upper rest: from two on, disturbances grow."""
    names, up = [f"rod{k}" for k in range(count)], np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    bodies = [
        {"name": name, "mass": 1.0, "inertia": [7.5e-3, 7.5e-3, 7.5e-3], "position": ((0.15 + 0.3 * k) * up).tolist()}
        for k, name in enumerate(names)
    ]
    pins = [
        {"name": f"pin{k}", "type": "revolute", "node": name, "position": (0.3 * k * up).tolist(), "axis": [0, 1, 0]}
        | ({"to": names[k - 1]} if k else {})
        for k, name in enumerate(names)
    ]
    simulation = {"type": "dynamics", "duration": 2.5}
    return body_scene(folder, {**PENDULUM, "simulation": simulation}, bodies=bodies, connections=pins)


def test_growing_disturbances_are_told(tmp_path: Path) -> None:
    """A triple pendulum that tumbles, at 1 ms: the stated error is of the size of the motion in the end, and up to the
    horizon of 1 mm it is right. Steps by the tolerance do not fight it: at most ten times as many.
    """
    path, times = _chain_of_rods(tmp_path, 3), np.linspace(0, 2.5, 501)
    exact = _positions(_run(path, "simulation.step=2.5e-5"), times)
    run = _run(path, "simulation.step=1e-3")
    off, found = np.linalg.norm(_positions(run, times) - exact, axis=-1).max(axis=1), _stated(run)
    assert off.max() > 0.1
    assert found.total > 0.1
    horizon = found.horizon(1e-3)
    assert 0.1 < horizon < 2.5
    assert off[times <= horizon].max() <= 1e-3
    own = _run(path)
    told = _stated(own).horizon(1e-4)
    assert told > horizon
    assert np.linalg.norm(_positions(own, times) - exact, axis=-1).max(axis=1)[times <= told].max() <= 1e-4
    assert own.solution.work.steps <= 10 * 20_000


def _watched(
    options: ConstrainedOptions, watch: Callable[[float, Callable[[], Solution]], None] | None = None
) -> Solution:
    system = heavy_top.heavy_top("SE(3)")
    spin = heavy_top.SPINS["slow"]
    start = np.concatenate([np.cross(spin, heavy_top.ARM), spin])
    return lie_generalized_alpha(system, (0, 0.5), system.start, start, options, watch)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-2])  # with a run of its own, and the last forerunner told again
def test_forerunners_are_not_seen(tolerance: float) -> None:
    """Times that an observer is told rise, and all work is counted, but no step of forerunners."""
    seen: list[float] = []
    found = _watched(ConstrainedOptions(tolerance=tolerance, follows_tolerance=True), lambda t, knots: seen.append(t))
    assert found.failure is None
    assert (np.diff(seen) > 0).all()
    assert seen[-1] == 0.5
    assert found.work.steps == len(found.t) - 1
    assert found.work.newton_iterations > 2 * found.work.steps
    assert found.companion is not None
    assert len(found.companion.t) < len(found.t) / 2


def test_states_apart_in_time() -> None:
    """``output_step`` thins the run, not its companion, and what is stated stays."""
    whole, few = (_run(SLOW, *changes) for changes in ((), ("simulation.duration=2.0",)))
    assert _stated(whole).total == _stated(few).total
    thin = _watched(ConstrainedOptions(follows_tolerance=True, output_step=0.01))
    full = _watched(ConstrainedOptions(follows_tolerance=True))
    assert len(thin.t) < len(full.t)
    assert thin.work.steps == full.work.steps
    assert thin.companion is not None
    assert full.companion is not None
    np.testing.assert_array_equal(thin.companion.t, full.companion.t)


def test_an_observer_that_fails_ends_the_run() -> None:
    """At its first step, not after the forerunners' end: whoever watches sees the run alone."""

    def watch(t: float, knots: Callable[[], Solution]) -> None:
        raise SimulationError(Cause.RUNAWAY, "enough")

    found = _watched(ConstrainedOptions(follows_tolerance=True), watch)
    assert found.failure is not None
    assert found.failure.cause is Cause.RUNAWAY
    assert found.t[-1] < 0.5


def test_points_on_rigid_nodal_links_tell_their_error() -> None:
    """The one node of a rigid link sits in its joint, and rests; the errors of its turning are those of its points."""
    path = DATA / "l_shape/steel_tall.toml"
    rigid = ("links.l.flexible=false", "simulation.formulation=nodal", "simulation.duration=0.5")
    times = np.linspace(0, 0.5, 301)
    exact = _extrapolated(path, rigid, 1e-3, times)
    run = _run(path, *rigid, "simulation.step=8e-3")
    actual, found = _apart(run, exact, times), _stated(run)
    assert actual > 1e-6
    assert actual <= found.total <= TOO_LARGE * actual
    adaptive = _run(path, *rigid)
    assert _apart(adaptive, exact, times) <= _stated(adaptive).total
