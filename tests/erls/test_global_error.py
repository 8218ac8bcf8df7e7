"""The global error of integrations: against closed forms, tighter runs, and Padé's error of phase."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scenes
from small_systems import DoublePendulum, Modes

import erls
from erls.accuracy.phase import lobatto_wrong, wrong_over_run
from erls.equations.quick import quick
from erls.equations.substructures import solved
from erls.integrate.base import Options, hermite
from erls.integrate.global_error import ENDS_STIFF, GlobalError, global_error
from erls.integrate.lobatto import lobatto
from erls.maths.so3 import Array

DATA = scenes.ROOT / "data"
SHORT = ["simulation.duration=0.2"]


def _largest(values: Array) -> float:
    return float(np.abs(values).max())


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5])
def test_a_resolved_vibration_is_off_by_what_is_found(tolerance: float) -> None:
    """3 rad/s over 60 s: the exact motion is a cosine; within a factor of two."""
    system, start = Modes([3.0]), np.array([1.0])
    run = lobatto(system, (0.0, 60.0), start, np.zeros(1), Options(tolerance=tolerance))
    found = global_error(system, run, tolerance, 10.0)
    actual = np.cos(3.0 * found.t)[:, None] - found.y
    assert found.whole
    assert _largest(actual) > 1e-3 * tolerance
    assert 1 / 2 <= _largest(found.error) / _largest(actual) <= 2
    assert found.evaluations <= 0.9 * run.work.rhs_calls


def test_the_error_of_a_double_pendulum_follows_a_run_at_a_thousandth() -> None:
    """Nonlinear, with a mass matrix that turns: position and velocity, within a factor of three."""
    system, y, v = DoublePendulum(), np.array([1.2, 0.4]), np.zeros(2)
    run = lobatto(system, (0.0, 6.0), y, v, Options(tolerance=1e-5))
    tight = lobatto(system, (0.0, 6.0), y, v, Options(tolerance=1e-8))
    found = global_error(system, run, 1e-5, 2.0)
    place, rate = hermite(tight.t, tight.y, tight.v, tight.a, found.t)
    for error, actual in ((found.error, place - found.y), (found.rate, rate - found.v)):
        assert _largest(actual) > 1e-6
        assert 1 / 3 <= _largest(error) / _largest(actual) <= 3


def test_a_jump_of_forces_passes_the_error_on() -> None:
    """A force that is switched off at 9 s: two legs, the error goes on from the one into the other; to a half."""

    def force(t: float) -> float:
        return 36.0 if t < 9.0 else 0.0

    system = Modes([6.0], force=force, breakpoints=(9.0,))
    run = lobatto(system, (0.0, 20.0), np.zeros(1), np.zeros(1), Options(tolerance=1e-4))
    found = global_error(system, run, 1e-4, 10.0)
    assert found.t[0] == 0.0
    assert found.t[-1] == 20.0
    pushed = 1.0 - np.cos(6 * found.t)
    freed = pushed - (1.0 - np.cos(6 * (found.t - 9.0)))
    actual = np.where(found.t < 9.0, pushed, freed)[:, None] - found.y
    assert _largest(actual) > 1e-6
    assert _largest(found.error - actual) <= 0.5 * _largest(actual)


def test_compiled_and_plain_steps_agree() -> None:
    """One source: the same errors to what summation in another order makes of an ill-conditioned interpolation."""
    run = erls.simulate(erls.load_scene(DATA / "l_shape/steel_flat.toml", SHORT), verdict=False)
    system, reach = solved(run.formulation), run.formulation.mechanism.reach

    def followed(own: object) -> GlobalError:
        return global_error(own, run.solution, 1e-5, reach)  # type: ignore[arg-type]

    compiled, plain = followed(system), followed(quick(system))
    assert np.array_equal(compiled.t, plain.t)
    assert compiled.evaluations == plain.evaluations
    assert _largest(compiled.error - plain.error) <= 1e-4 * _largest(compiled.error)


@pytest.mark.parametrize("duration", [2.0, 5.0])
def test_a_flexible_link_is_off_by_what_is_found_and_what_vibrations_lose(duration: float) -> None:
    """The steel L against a run at a thousandth of its tolerance: shoulder angle, within a factor of four."""
    path, longer = DATA / "l_shape/steel_tall.toml", f"simulation.duration={duration}"
    run = erls.simulate(erls.load_scene(path, [longer]), verdict=False)
    tight = erls.simulate(erls.load_scene(path, [longer, "simulation.tolerance=1e-7"]), verdict=False)
    found = global_error(solved(run.formulation), run.solution, 1e-5, 1.0, ends=ENDS_STIFF)  # type: ignore[arg-type]
    s = tight.solution
    actual = hermite(s.t, s.y, s.v, s.a, found.t)[0][:, 0] - found.y[:, 0]
    assert 1 / 4 <= _largest(found.error[:, 0]) / _largest(actual) <= 4
    assert found.evaluations <= 0.25 * run.solution.work.rhs_calls


def test_lobatto_loses_the_phase_of_a_pade_approximant() -> None:
    """|λ exp(-ix) - 1| → 3! 3! / (6! 7!) x⁷ (Hairer & Wanner, Solving ODEs II, sec. IV.3); steps that resolve nothing
    lose all.
    """
    grid, wrong = lobatto_wrong()
    small = grid < 0.03
    leading = math.factorial(3) ** 2 / (math.factorial(6) * math.factorial(7)) * grid[small] ** 7
    assert wrong[small] == pytest.approx(leading, rel=0.1)  # carried on from 0.3, where the next term is a tenth
    assert wrong[np.searchsorted(grid, 20.0)] > 0.1
    lost = wrong_over_run((grid, wrong), np.array([10.0]), np.full(1000, 0.01))[0]
    assert lost == pytest.approx(1000 * np.interp(0.1, grid, wrong), rel=0.05)


def test_a_disturbance_of_rounding_grows_where_the_motion_is_unstable(tmp_path: Path) -> None:
    """A rod that stands on its head, exactly: the run stands, the error grows as cosh(λt), λ² = 3g/2L."""
    run = _rod(tmp_path, 3.0, 90.0)
    found = global_error(solved(run.formulation), run.solution, 1e-5, 1.0, disturbance=1e-12)  # type: ignore[arg-type]
    grown = np.abs(found.error[-1] / found.error[0])
    assert grown == pytest.approx(np.cosh(math.sqrt(1.5 * 9.81) * 3.0), rel=0.2)


def _rod(folder: Path, duration: float, position: float) -> erls.ChainRun:
    """A rigid rod of 1 m on a hinge, at rest at an angle above the horizontal [deg]."""
    link = {"nodes": {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}}
    member = {"from": "root", "to": "tip", "elements": 2, "material": "m", "section": "s"}
    scenes.arm_link(folder, frame={**link, "members": [member]})
    path = scenes.write_toml(
        folder / "rod.toml",
        {
            "gravity": [0.0, -9.81, 0.0],
            "simulation": {"duration": duration},
            "joints": [{"name": "hinge", "dh": {"convention": "standard"}, "initial": {"position_deg": position}}],
            "links": [{"name": "rod", "model": "arm.toml", "flexible": False}],
            "points": [{"name": "tip", "link": "rod", "node": "tip"}],
        },
    )
    return erls.simulate(erls.load_scene(path), verdict=False)
