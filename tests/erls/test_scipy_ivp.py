"""What is particular to SciPy's solvers: step limits of explicit ones, budgets, Jacobians."""

from __future__ import annotations

import numpy as np
import pytest
from small_systems import DoublePendulum, ElasticPendulum, Modes

from erls.integrate.base import Options
from erls.integrate.registry import integrator_named
from erls.integrate.scipy_ivp import METHODS, explicit_step_limit

ONE, ZERO = np.ones(1), np.zeros(1)


@pytest.mark.parametrize("name", ["rk45", "dop853"])
def test_the_step_limit_is_that_of_the_tableau(name: str) -> None:
    """R(z) = 1 + Σ zᵏ⁺¹ bᵀ Aᵏ 1 first exceeds 1 on the imaginary axis at ``stable_to`` (3 digits)."""
    solver = METHODS[name].solver
    n = len(solver.B)
    square = np.zeros((n, n))
    square[:, : solver.A.shape[1]] = solver.A[:n]
    vector, coefficients = np.ones(n), [1.0]
    for _ in range(n):
        coefficients.append(solver.B @ vector)
        vector = square @ vector
    y = np.linspace(0.01, 8, 80_000)
    growth = np.abs(np.polyval(coefficients[::-1], 1j * y))
    assert y[np.argmax(growth > 1 + 1e-9)] == pytest.approx(METHODS[name].stable_to, rel=1e-3)


@pytest.mark.parametrize("name", ["rk45", "dop853"])
def test_stiff_runs_of_explicit_methods_are_announced(name: str) -> None:
    system = Modes([10.0, 2 * np.pi * 1e4])
    frequency, limit = explicit_step_limit(system, 0.0, np.zeros(2), np.zeros(2), name)
    assert frequency == pytest.approx(1e4)
    assert limit == pytest.approx(METHODS[name].stable_to / (2 * np.pi * 1e4))

    def stop(t: float, knots: object) -> None:
        raise KeyboardInterrupt

    run = integrator_named(name)(system, (0, 20_001 * limit), np.zeros(2), np.zeros(2), Options(), stop)
    (warning,) = run.warnings
    assert "1e+04 Hz" in warning
    assert f"{limit:.3g} s" in warning
    assert "generalized_alpha" in warning
    assert integrator_named(name)(system, (0, 100 * limit), np.zeros(2), np.zeros(2), Options()).warnings == ()
    assert explicit_step_limit(DoublePendulum(), 0.0, np.zeros(2), np.zeros(2), name) == (0, np.inf)


@pytest.mark.parametrize(
    ("name", "limit"), [("rk45", 925), ("dop853", 1145), ("radau", 5400), ("bdf", 2050), ("lsoda", 1200)]
)
def test_work_on_a_double_pendulum(name: str, limit: int) -> None:
    """Right-hand sides for 2 s at rtol 1e-8: a third more than was measured with SciPy 1.17."""
    found = integrator_named(name)(DoublePendulum(), (0, 2), np.array([1.0, 0.5]), np.zeros(2), Options())
    assert found.work.rhs_calls <= limit


@pytest.mark.parametrize("name", ["radau", "bdf", "lsoda"])
def test_implicit_methods_do_not_follow_dead_vibrations(name: str) -> None:
    """A spring of 16 kHz, 10 % damped, for 1 s: an explicit method needs 1e5 steps."""
    system = ElasticPendulum(1e5, 0.1)
    found = integrator_named(name)(
        system, (0, 1), np.array([1.0, 0.0]), np.zeros(2), Options(rtol=1e-6, atol=1e-8)
    )
    assert found.failure is None
    assert found.work.steps < 2000


@pytest.mark.parametrize("name", sorted(METHODS))
def test_the_largest_step_is_respected(name: str) -> None:
    found = integrator_named(name)(Modes([0.1]), (0, 1), ONE, ZERO, Options(step=0.02))
    assert np.diff(found.t).max() <= 0.02 * (1 + 1e-12)


def test_rejected_steps_of_explicit_methods_are_counted() -> None:
    """A kick that no breakpoint announces is found by rejections: 6 calls for each attempt, 3 to start."""
    system = Modes([1.0], force=lambda t: 100.0 if t > 0.35 else 0.0)
    found = integrator_named("rk45")(system, (0, 1), ONE, ZERO, Options())
    work = found.work
    assert work.rejected_steps > 5
    assert work.rhs_calls == 6 * (work.steps + work.rejected_steps) + 3
