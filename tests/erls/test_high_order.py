"""Lobatto IIIA: order, tolerance, stiff and unresolved vibrations, energy, compiled loop, failures, budgets of work."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from compiled_modes import CompiledElasticPendulum, TwinPendulum
from small_systems import DoublePendulum, ElasticPendulum, Law, Modes

from erls import load_scene
from erls.equations.registry import formulate
from erls.equations.system import SecondOrderSystem
from erls.errors import Cause
from erls.integrate import lobatto
from erls.integrate.base import Options, Solution, hermite
from erls.integrate.registry import integrator_named
from erls.maths.so3 import Array
from erls.scene.build import build_mechanism

DATA = Path(__file__).parents[2] / "data"
run = integrator_named("lobatto")
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7)


def test_collocation_weights_integrate_cubic_accelerations() -> None:
    """∫₀^c τᵏ dτ for k = 0..3, and ∫₀^c (c − τ) τᵏ dτ for k = 0..2, at every node."""
    nodes, (rates, places) = np.array(lobatto.NODES), lobatto.tableau()
    for k in range(4):
        np.testing.assert_allclose(rates @ nodes**k, nodes ** (k + 1) / (k + 1), atol=1e-14)
    for k in range(3):
        np.testing.assert_allclose(places @ nodes**k, nodes ** (k + 2) / (k + 1) / (k + 2), atol=1e-14)
    # the last row is the Lobatto quadrature, exact to degree 5
    for k in range(6):
        assert rates[-1] @ nodes**k == pytest.approx(1 / (k + 1), abs=1e-14)


def test_order_is_six(monkeypatch: pytest.MonkeyPatch) -> None:
    """Double pendulum, steps of 50, 25, 12.5 ms (the first ones smaller), against DOP853 at 1e-13: order 6 at the ends
    of steps, within 0.5 below and 2 above; 5 at the knots inside, whose errors do not add up.
    """
    monkeypatch.setattr(lobatto, "_ITERATED", 1e-13)
    start, rest = np.array([1.0, 0.5]), np.zeros(2)
    system = DoublePendulum()
    tight = integrator_named("dop853")(system, (0, 1.0), start, rest, Options(rtol=1e-13, atol=1e-14))
    errors = []
    for step in (0.05, 0.025, 0.0125):
        found = run(system, (0, 1.0), start, rest, Options(step=step, tolerance=1.0))
        assert found.failure is None
        exact = hermite(tight.t, tight.y, tight.v, tight.a, found.t)
        miss = np.abs(np.stack((found.y, found.v)) - exact).max(axis=(0, 2))
        errors.append((miss[::3].max(), miss.max()))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > (5.5, 4.7)).all()
    assert (orders < 8).all()


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_the_tolerance_is_met_within_a_factor_of_five_on_a_stiff_system(tolerance: float) -> None:
    """Oscillators of 3 to 1e5 rad/s from amplitudes that fall with their frequency, as those of a released link do."""
    omega = np.array([3.0, 40.0, 300.0, 3e3, 1e5])
    amplitude = 0.1 / omega**2
    found = run(Modes(list(omega)), (0, 2), amplitude, np.zeros(5), Options(tolerance=tolerance))
    assert found.failure is None
    at = np.linspace(0, 2, 4001)
    error = np.abs(hermite(found.t, found.y, found.v, found.a, at)[0] - amplitude * np.cos(np.outer(at, omega)))
    assert error.max() <= 5 * tolerance


def test_modes_that_hardly_move_cost_no_steps_and_stay_small() -> None:
    """A mode of 1e5 rad/s with an amplitude far below the tolerance leaves the steps as they are."""
    slow = run(Modes([3.0, 40.0]), (0, 2), np.array([0.1, 1e-3]), np.zeros(2), Options(tolerance=1e-6))
    start = np.array([0.1, 1e-3, 1e-8])
    stiff = run(Modes([3.0, 40.0, 1e5]), (0, 2), start, np.zeros(3), Options(tolerance=1e-6))
    assert stiff.work.steps <= 1.05 * slow.work.steps
    assert stiff.work.rhs_calls <= 1.3 * slow.work.rhs_calls
    assert np.abs(stiff.y[:, 2]).max() <= 1.01e-8


def energy(system: ElasticPendulum, found: Solution) -> Array:
    """(k,) of the elastic pendulum."""
    (angle, stretch), (turn, rate) = found.y.T, found.v.T
    r = 1 + stretch
    return np.asarray(
        ((r * turn) ** 2 + rate**2 + (system.omega * stretch) ** 2) / 2 - system.gravity * r * np.cos(angle)
    )


def test_energy_of_a_stiff_pendulum_stays() -> None:
    """A spring of 500 rad/s, excited with A = 1 mm, coupled with the swing: A changes by no more than 5 tolerances, so
    the energy by no more than 5 tol ω² A.
    """
    system = ElasticPendulum(500.0)
    found = run(system, (0, 3), np.array([1.0, 1e-3]), np.zeros(2), Options(tolerance=1e-6))
    drift = energy(system, found) - energy(system, found)[0]
    assert found.failure is None
    assert np.abs(drift).max() <= 5e-6 * 500**2 * 1e-3
    # the vibration is kept: numerical damping would take it
    late = found.t > 2.5
    mean = found.y[late, 1].mean()
    assert np.abs(found.y[late, 1] - mean).max() > 0.9e-3


@pytest.mark.parametrize("zeta", [0.0, 0.05])
def test_compiled_and_uncompiled_loop_agree(zeta: float) -> None:
    start, options = np.array([1.0, 1e-3]), Options(tolerance=1e-6)
    plain = run(TwinPendulum(300.0, zeta), (0, 1), start, np.zeros(2), options)
    seen: list[float] = []
    compiled = run(
        CompiledElasticPendulum(300.0, zeta), (0, 1), start, np.zeros(2), options, lambda t, knots: seen.append(t)
    )
    assert compiled.work == plain.work
    np.testing.assert_allclose(compiled.t, plain.t, atol=1e-12)
    np.testing.assert_allclose(compiled.y, plain.y, atol=1e-12)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    assert len(seen) < compiled.work.steps  # in chunks


class WrongMass(Law):
    """Tells a mass matrix that is not that of its equations."""

    def __init__(self, factor: float) -> None:
        super().__init__(lambda t, y, v: -25 * y)
        self.factor = factor

    def mass_matrix(self, t: float, y: Array) -> Array:
        return self.factor * np.eye(1)


@pytest.mark.parametrize(("factor", "words"), [(0.0, "singular"), (0.1, "does not converge")])
def test_iterations_that_cannot_work_are_reported(factor: float, words: str) -> None:
    found = run(WrongMass(factor), (0, 1), np.ones(1), np.zeros(1), Options())
    assert found.failure is not None
    assert found.failure.cause is Cause.STEP_TOO_SMALL
    assert words in found.failure.message
    assert "coordinate 0" in found.failure.message
    assert found.failure.remedy


def test_the_largest_step_is_respected() -> None:
    found = run(Modes([1.0]), (0, 1), np.ones(1), np.zeros(1), Options(step=0.01, tolerance=1e-2))
    assert found.work.steps >= 100
    ends = found.t[::3]
    assert np.diff(ends).max() <= 0.01 * (1 + 1e-9)


def formulation(path: str, *overrides: str) -> tuple[SecondOrderSystem, tuple[Array, Array]]:
    scene = load_scene(DATA / path, overrides)
    system = formulate(build_mechanism(scene, lambda text: None).mechanism, scene.record.simulation)
    return system, system.initial_state()  # type: ignore[return-value]


MODES = "links.l.elastic_modes=4"
KINDS = {
    "compiled chain": ("l_shape/steel_flat.toml", 0.3, MODES),
    "five rows per joint": ("l_shape/steel_flat.toml", 0.03, MODES, "simulation.gauge=minimum-norm"),
    "floating frames": ("l_shape/steel_flat.toml", 0.03, MODES, "simulation.formulation=ffr"),
    "closed loop": ("four_bar/rigid.toml", 0.05),
    "robot": ("robot/two_link.toml", 0.03, "links.0.elastic_modes=2", "links.1.elastic_modes=2"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_system_agrees_with_an_explicit_method(kind: str) -> None:
    """DOP853 at 1e-10; the two may differ by five tolerances, 5e-6 m."""
    path, duration, *overrides = KINDS[kind]
    system, (y, v) = formulation(path, *overrides)
    times, at = (0.0, duration), np.linspace(0, duration, 50)
    tight = integrator_named("dop853")(system, times, y, v, Options(rtol=1e-10, atol=1e-12))
    found = run(system, times, y, v, Options(tolerance=1e-6))
    assert (tight.failure, found.failure) == (None, None)
    ours, exact = (hermite(s.t, s.y, s.v, s.a, at)[0] for s in (found, tight))
    assert np.abs((ours - exact) * system.length_scales).max() <= 5e-6


BUDGETS = {
    # at 1e-5 m: steps, evaluations of the equations, factorizations; what it takes and a fifth more, on a machine whose
    # routines turn modes of equal frequency to its cost
    "l, 18 modes, 0.5 s": ("l_shape/steel_flat.toml", 0.5, 190, 1067, 55),
    "two-link robot, 24 modes, 0.5 s": ("robot/two_link.toml", 0.5, 270, 1720, 113),
}


@pytest.mark.parametrize("name", BUDGETS)
def test_work_budgets(name: str) -> None:
    path, duration, *budget = BUDGETS[name]
    system, (y, v) = formulation(path)
    found = run(system, (0.0, duration), y, v, Options(tolerance=1e-5))
    work = asdict(found.work)
    spent = [work[key] for key in ("steps", "rhs_calls", "factorizations")]
    assert found.failure is None
    assert all(used <= allowed for used, allowed in zip(spent, budget, strict=True)), spent
