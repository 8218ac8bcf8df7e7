"""Every member of the registry keeps the contract of `erls.integrate.base`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from small_systems import DoublePendulum, Law, Modes

from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.base import Options, Solution, hermite
from erls.integrate.registry import integrator_named
from erls.maths.so3 import Array
from erls.scene.integrators import FIXED_STEP, INTEGRATORS

ADAPTIVE = sorted(set(INTEGRATORS) - {"generalized_alpha"})
MULTISTEP = {"bdf", "lsoda"}
START = np.array([1.0, 0.5])
END = 2.0
ONE, ZERO = np.ones(1), np.zeros(1)


def options(name: str) -> Options:
    """One setting for each: fixed steps of 1 ms, or tolerances of 1e-8."""
    return Options(step=1e-3) if name == "generalized_alpha" else Options(tolerance=1e-8)


@pytest.fixture(scope="module")
def exact() -> Callable[[Array], tuple[Array, Array]]:
    """The double pendulum by DOP853 with rtol 1e-13; its own error is near 1e-11."""
    pendulum = DoublePendulum()
    found = solve_ivp(
        lambda t, x: np.concatenate([x[2:], pendulum.acceleration(t, x[:2], x[2:])]),
        (0, END),
        np.concatenate([START, [0, 0]]),
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        dense_output=True,
    )
    return lambda t: (found.sol(t)[:2].T, found.sol(t)[2:].T)


def test_the_registry_is_described() -> None:
    assert all(callable(integrator_named(name)) and entry.description for name, entry in INTEGRATORS.items())
    assert FIXED_STEP in INTEGRATORS


@pytest.mark.parametrize("name", ADAPTIVE)
def test_errors_scale_with_tolerances(name: str, exact: Callable) -> None:
    """Within 10 rtol (SciPy's own tests allow 5 for 1 s; errors here grow threefold), and falling with it; steps of
    lobatto follow the fifth root of a tolerance that is met with some room at 1e-5.
    """
    errors = []
    for rtol in (1e-5, 1e-8):
        found = integrator_named(name)(
            DoublePendulum(), (0, END), START, np.zeros(2), Options(rtol=rtol, atol=rtol / 100, tolerance=rtol)
        )
        assert found.failure is None
        errors.append(np.abs(found.y - exact(found.t)[0]).max())
        assert errors[-1] <= 10 * rtol
    assert errors[1] <= errors[0] / (30 if name == "lobatto" else 100)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_motion_between_knots_is_as_accurate_as_at_knots(name: str, exact: Callable) -> None:
    """Threefold, or within the tolerance; velocities, from the derivative of a polynomial, fivefold, and those of
    multistep methods twentyfold (see scipy_ivp).
    """
    found = integrator_named(name)(DoublePendulum(), (0, END), START, np.zeros(2), options(name))
    at = np.random.default_rng(2).uniform(0, END, 1000)
    sampled = hermite(found.t, found.y, found.v, found.a, at)
    knots = (found.y, found.v)
    for allowed, knot, sample, k, s in zip(
        (3, 20 if name in MULTISTEP else 5), knots, sampled, exact(found.t), exact(at), strict=True
    ):
        assert np.abs(sample - s).max() <= max(allowed * np.abs(knot - k).max(), Options().rtol)
    expected = [
        DoublePendulum().acceleration(t, y, v) for t, y, v in zip(found.t, found.y, found.v, strict=True)
    ]
    # M ÿ = f at knots: generalized-α solves it within 1e-11 m, which is 3e-5 m/s² at 1 ms; knots inside steps
    # of DOP853 hold the acceleration of a state that differs by the tolerance
    np.testing.assert_allclose(found.a, expected, atol=5e-5 if name == "generalized_alpha" else 1e-5)


def pulse(t: float, y: float, v: float) -> float:
    """A push of 1 N s from 0.7003 s to 0.7013 s."""
    return 1000.0 if 0.7003 <= t < 0.7013 else 0.0


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_short_push_is_met_exactly(name: str) -> None:
    """Piecewise constant acceleration is integrated to rounding, by BDF and LSODA to tolerance."""
    times, setting = (0.7003, 0.7013), Options(step=0.02) if name == "generalized_alpha" else Options()
    found = integrator_named(name)(Law(pulse, times), (0, 1), ZERO, ZERO, setting)
    for t, a in zip(times, ([0, 1000], [1000, 0]), strict=True):
        np.testing.assert_allclose(found.a[found.t == t, 0], a, atol=1e-6)
    assert (np.diff(found.t) == 0).sum() == 2
    assert found.t[-1] == 1
    assert found.v[-1, 0] == pytest.approx(1, abs=1e-7)
    assert found.y[-1, 0] == pytest.approx(1 - 0.7008, abs=1e-7)
    unaware = integrator_named(name)(Law(pulse), (0, 1), ZERO, ZERO, setting)
    assert abs(unaware.v[-1, 0] - 1) > 0.5  # without breakpoints it is stepped over


@pytest.mark.parametrize("name", INTEGRATORS)
def test_units_of_coordinates_do_not_matter(name: str) -> None:
    """Coordinates in units of 2^-10 m: the same steps and, but for rounding, the same motion."""
    unit = 2.0**-10

    class Scaled(Modes):
        length_scales = np.full(2, unit)

    force = lambda t: 1 + np.sin(t)  # noqa: E731
    start, setting = np.array([0.1, 0.0]), options(name)
    metres = integrator_named(name)(Modes([3.0, 40.0], 0.1, force), (0, 1), start, np.zeros(2), setting)
    scaled = Scaled([3.0, 40.0], 0.1, lambda t: force(t) / unit)
    other = integrator_named(name)(scaled, (0, 1), start / unit, np.zeros(2), setting)
    assert other.work == metres.work
    np.testing.assert_allclose(other.y * unit, metres.y, atol=1e-12)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_observer_sees_every_step_and_inputs_stay(name: str) -> None:
    seen: list[tuple[float, Solution]] = []
    y, v = np.array([1.0]), np.array([0.0])
    found = integrator_named(name)(Modes([5.0]), (0, 1), y, v, options(name), lambda t, k: seen.append((t, k())))
    assert len(seen) == found.work.steps
    assert [t for t, _ in seen] == sorted(t for t, _ in seen)
    for t, so_far in seen:
        k = len(so_far.t)
        assert so_far.t[-1] == t
        np.testing.assert_array_equal(so_far.y, found.y[:k])  # later knots left it alone
    assert (y[0], v[0]) == (1, 0)
    assert found.failure is None
    assert found.warnings == ()


def stop(error: BaseException) -> Callable[[float, float, float], float]:
    """An oscillator whose force raises after half a second."""

    def law(t: float, y: float, v: float) -> float:
        if t > 0.5:
            raise error
        return -25 * y

    return law


FAILURES = {
    "interrupted": (stop(KeyboardInterrupt()), Cause.INTERRUPTED),
    "raised": (stop(SimulationError(Cause.SINGULAR_MASS, "no mass")), Cause.SINGULAR_MASS),
    "not finite": (lambda t, y, v: np.nan if t > 0.5 else -25 * y, Cause.NOT_FINITE),
}


@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("kind", FAILURES)
def test_a_failed_run_keeps_what_was_computed(name: str, kind: str) -> None:
    law, cause = FAILURES[kind]
    found = integrator_named(name)(Law(law), (0, 1), ONE, ZERO, options(name))
    assert found.failure is not None
    assert found.failure.cause is cause
    assert found.failure.where.startswith("t = 0.")
    assert 0.3 < found.t[-1] <= 0.5 + 1e-9
    # y = cos 5t so far, to the accuracy of the coarsest method at these settings
    np.testing.assert_allclose(found.y[:, 0], np.cos(5 * found.t), atol=1e-5)
    assert np.isfinite(found.a).all()


@pytest.mark.parametrize("name", INTEGRATORS)
def test_an_observer_can_end_the_run(name: str) -> None:
    def observer(t: float, knots: Callable[[], Solution]) -> None:
        if t > 0.5:
            raise KeyboardInterrupt

    found = integrator_named(name)(Modes([5.0]), (0, 1), ONE, ZERO, options(name), observer)
    assert found.failure is not None
    assert found.failure.cause is Cause.INTERRUPTED
    assert found.failure.exit_code == 130
    assert 0.5 < found.t[-1] <= 1


@pytest.mark.parametrize("name", INTEGRATORS)
def test_failures_at_the_start_leave_one_knot(name: str) -> None:
    infinite = integrator_named(name)(Law(lambda t, y, v: np.inf), (0, 1), ONE, ZERO, options(name))
    assert infinite.failure is not None
    assert infinite.failure.cause is Cause.NOT_FINITE
    assert infinite.t.tolist() == [0]
    nothing = integrator_named(name)(Modes([2.0]), (1, 1), ONE, ZERO, options(name))
    assert nothing.failure is None
    assert (nothing.t.tolist(), nothing.a.tolist()) == ([1], [[-4]])
    with pytest.raises(SceneError):
        integrator_named(name)(Modes([2.0]), (1, 0), ONE, ZERO, options(name))


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_motion_without_bound_ends_in_a_failure(name: str) -> None:
    """ÿ = 6 y² from rest at 1 is infinite at t = ∫₁^∞ dy/√(4 (y³ − 1)) = 1.214325..."""
    given = Options(tolerance=1e-2) if name == "lobatto" else options(name)  # 2e5 steps, not a million
    found = integrator_named(name)(Law(lambda t, y, v: 6 * y * y), (0, 2), ONE, ZERO, given)
    assert found.failure is not None
    expected = Cause.NEWTON_FAILED if name == "generalized_alpha" else Cause.STEP_TOO_SMALL
    assert found.failure.cause is expected
    assert "coordinate 0" in found.failure.message
    assert found.failure.remedy
    assert found.t[-1] == pytest.approx(1.214325, abs=2e-3)
    assert found.failure.exit_code == 3
