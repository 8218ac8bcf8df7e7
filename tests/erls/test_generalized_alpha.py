"""Order, damping, stability and work of generalized-α."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from small_systems import DoublePendulum, ElasticPendulum, Law, Modes

from erls.errors import Cause
from erls.integrate.base import Options
from erls.integrate.generalized_alpha import generalized_alpha
from erls.maths.so3 import Array

RADII = (0.0, 0.5, 0.8, 1.0)
ONE, ZERO = np.ones(1), np.zeros(1)


@pytest.mark.parametrize("radius", RADII)
def test_order_two_in_position_velocity_and_acceleration(radius: float) -> None:
    """Double pendulum, variable mass matrix: observed order 2.0 ± 0.1, against DOP853 with rtol 1e-13."""
    system, start = DoublePendulum(), np.array([1.0, 0.5, 0, 0])

    def rates(t: float, x: Array) -> Array:
        return np.concatenate([x[2:], system.acceleration(t, x[:2], x[2:])])

    exact = solve_ivp(rates, (0, 2), start, method="DOP853", rtol=1e-13, atol=1e-13, dense_output=True).sol
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        setting = Options(step=step, spectral_radius=radius, newton_tolerance=1e-13)
        found = generalized_alpha(system, (0, 2), start[:2], start[2:], setting)
        x = exact(found.t)
        a = np.array([rates(t, k)[2:] for t, k in zip(found.t, x.T, strict=True)])
        pairs = ((found.y, x[:2].T), (found.v, x[2:].T), (found.a, a))
        errors.append([np.abs(mine - his).max() for mine, his in pairs])
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.1)


@pytest.mark.parametrize("radius", RADII)
def test_damping_at_infinite_frequency_is_the_spectral_radius(radius: float) -> None:
    """Knots follow y₃ = c₂ y₂ + c₁ y₁ + c₀ y₀ whose roots all tend to −ρ∞, so that they come from the knots.

    A triple root moves by the cube root of a perturbation, here of (ω h)⁻² = 1e-8 and rounding: 1e-2.
    """
    setting = Options(step=1.0, spectral_radius=radius, newton_tolerance=0.0)
    found = generalized_alpha(Modes([1e4]), (0, 8), ONE, np.array([1e4]), setting)
    # three independent columns: divided by what the radius leaves of them
    y = found.y[1:, 0] / max(radius, 1e-2) ** np.arange(8)
    columns = np.array([y[:-3], y[1:-2], y[2:-1]]).T
    c = np.linalg.lstsq(columns, y[3:], rcond=1e-9)[0]
    roots = np.roots([1, *-c[::-1]]) * max(radius, 1e-2)
    assert np.abs(roots).max() == pytest.approx(radius, abs=1e-2)


def test_energy_of_a_linear_oscillator_without_damping_is_kept() -> None:
    """ρ∞ = 1 is the trapezoidal rule, which keeps quadratic invariants: 1e4 steps of rounding only."""
    omega = np.array([1.0, 30.0, 4000.0])
    setting = Options(step=1e-3, spectral_radius=1.0)
    found = generalized_alpha(Modes(list(omega)), (0, 10), 1 / omega, np.ones(3), setting)
    energy = ((found.v**2 + (omega * found.y) ** 2) / 2).sum(axis=1)
    assert np.abs(energy / energy[0] - 1).max() < 1e-11
    damped = generalized_alpha(
        Modes([4000.0]), (0, 1), ONE / 4000, ONE, Options(step=1e-3, spectral_radius=0.5)
    )
    assert abs(damped.v[-1, 0]) < 1e-12  # the mode that the step cannot resolve dies


@pytest.mark.parametrize("radius", RADII)
def test_stiff_modes_are_stable(radius: float) -> None:
    """Modes up to 1e5 Hz with 1 ms: bounded by their static response, and the slow mode is right."""
    omega = 2 * np.pi * np.array([0.5, 1e3, 1e5])
    setting = Options(step=1e-3, spectral_radius=radius)
    found = generalized_alpha(
        Modes(list(omega), force=lambda t: 1.0), (0, 2), np.zeros(3), np.zeros(3), setting
    )
    assert found.failure is None
    assert (np.abs(found.y) <= 4 / omega**2).all()  # true motion: twice the static response
    exact = (1 - np.cos(omega[0] * found.t)) / omega[0] ** 2
    np.testing.assert_allclose(found.y[:, 0], exact, atol=1e-5)  # (ω h)²/12 t ω of the amplitude


def test_work_on_a_linear_stiff_oscillator() -> None:
    """One factorization, and at most two iterations in a step: one that solves and one that confirms."""
    counts: list[int] = []
    system = Modes([1.0, 1e3, 1e5], zeta=0.01, force=np.sin)
    found = generalized_alpha(
        system,
        (0, 1),
        np.full(3, 1e-3),
        np.zeros(3),
        Options(step=1e-3),
        lambda t, knots: counts.append(knots().work.newton_iterations),
    )
    assert found.work.factorizations == 1
    assert found.work.steps == 1000
    assert np.diff([0, *counts]).max() <= 2
    assert found.work.rhs_calls == found.work.newton_iterations + 1


# system, start, step, Newton iterations per step, factorizations per step: a third more than was measured
BUDGETS = [
    (DoublePendulum(), [1.0, 0.5], 1e-3, 1.8, 0.1),
    (DoublePendulum(), [3.0, 3.0], 4e-3, 4.0, 0.2),
    (ElasticPendulum(1e3), [1.0, 0.0], 1e-3, 2.7, 0.01),
    (ElasticPendulum(1e5), [1.0, 0.0], 1e-3, 1.6, 0.05),
]


@pytest.mark.parametrize("case", range(len(BUDGETS)))
def test_work_on_nonlinear_systems(case: int) -> None:
    system, start, step, iterations, factorizations = BUDGETS[case]
    found = generalized_alpha(system, (0, 2), np.array(start), np.zeros(2), Options(step=step))
    assert found.failure is None
    assert found.work.newton_iterations <= iterations * found.work.steps
    assert found.work.factorizations <= factorizations * found.work.steps


def test_steps_are_equal_inside_legs_and_end_on_breakpoints() -> None:
    breaks = (0.1234, 0.5)
    found = generalized_alpha(Modes([1.0], breakpoints=breaks), (0, 1), ONE, ZERO, Options(step=0.01))
    steps = np.diff(found.t)
    assert found.work.steps == 13 + 38 + 50
    for start, end in ((0, 0.1234), (0.1234, 0.5), (0.5, 1)):
        inside = steps[(found.t[:-1] >= start) & (found.t[1:] <= end) & (steps > 0)]
        np.testing.assert_allclose(inside, inside[0], rtol=1e-12)
        assert inside[0] <= 0.01 * (1 + 1e-9)
    assert generalized_alpha(Modes([1.0]), (0, 0.5), ONE, ZERO, Options()).work.steps == 1000
    assert generalized_alpha(Modes([1.0]), (0, 3), ONE, ZERO, Options()).work.steps == 3000  # at most 1 ms


def test_halved_steps_recover() -> None:
    """A stiff spring behind a gap, unknown to the iteration matrix, is too hard for the given step."""
    wall = Law(lambda t, y, v: -1e6 * max(y, 0.0) - 10.0 * min(y, 0.0))
    found = generalized_alpha(wall, (0, 4), -ONE, ZERO, Options(step=0.05, spectral_radius=1.0))
    steps = np.diff(found.t)
    assert found.failure is None
    assert found.work.rejected_steps > 0
    assert steps.min() < 0.02 < 0.0499 < steps[-1]
    assert found.t[-1] == 4
    # set times of the grid are met whatever happened in between
    np.testing.assert_allclose(
        np.min(np.abs(found.t[:, None] - np.linspace(0, 4, 81)), axis=0), 0, atol=1e-12
    )
    # and it is told which of them were made in parts: those with knots inside
    inside = np.histogram(found.t, np.linspace(0, 4, 81) + 1e-9)[0] - 1
    parts = np.flatnonzero(inside > 0)
    assert found.halved == (len(parts), 80, pytest.approx(0.05 * parts[0], abs=1e-12))
    (text,) = found.halved.warnings
    assert text.startswith(f"{len(parts)} of 80 steps were halved, first at t = {0.05 * parts[0]:.6g} s, since")
    assert "use a smaller simulation.step" in text


def test_nothing_is_told_where_no_step_was_halved() -> None:
    found = generalized_alpha(Modes([1.0]), (0, 0.5), ONE, ZERO, Options(step=0.01))
    assert (found.halved.steps, found.halved.given, found.halved.warnings) == (0, 50, ())


def test_a_system_without_solution_is_reported() -> None:
    """y = c + h² β 1e20 (1 + y²) has no real solution at any step tried."""
    found = generalized_alpha(Law(lambda t, y, v: 1e20 * (1 + y * y)), (0, 1), ZERO, ZERO, Options(step=1e-2))
    assert found.failure is not None
    assert found.failure.cause is Cause.NEWTON_FAILED
    assert found.failure.where.startswith("t = ")
    assert "coordinate 0" in found.failure.message
    assert found.failure.value == "step 2.44e-06 s"
    assert found.t.tolist() == [0]


def test_a_singular_iteration_matrix_is_reported() -> None:
    class Massless(Modes):
        def mass_matrix(self, t: float, y: Array) -> Array:
            return np.diag([1.0, 0.0])

    found = generalized_alpha(Massless([1.0, 0.0]), (0, 1), np.ones(2), np.zeros(2), Options())
    assert found.failure is not None
    assert found.failure.cause is Cause.NEWTON_FAILED
    assert "coordinate 1" in found.failure.message
    assert "singular" in found.failure.message
