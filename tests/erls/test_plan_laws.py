"""Laws of motion and what oscillators do after them: closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import factorial2, spherical_jn

from erls.tracking.laws import folded, polynomial, shaper
from erls.tracking.vibration import Mode, seen, swing


def oscillator(omega: float, damping: float = 0.0) -> Mode:
    """Of 1 m per unit, excited by the whole motion."""
    return Mode(omega, damping, 1.0, np.eye(1, 3), np.ones(1))


@pytest.mark.parametrize("degree", [3, 5, 7, 9])
def test_what_polynomials_leave_is_a_spherical_bessel_function(degree: int) -> None:
    """|Γ| (2 n + 1)!! |j_n(x)| / xⁿ at x = ω T / 2: s' is the weight (1 - u²)ⁿ, whose transform that is. To what the
    spline of 2000 knots leaves of the polynomial; that of degree 3 begins with a jump of acceleration.
    """
    n, law = (degree - 1) // 2, polynomial(1.0, degree, 2001)
    for x in (0.5, 3.0, 7.0, 12.0):
        closed = float(factorial2(2 * n + 1)) * abs(spherical_jn(n, x)) / x**n
        assert swing((oscillator(2 * x),), law) == pytest.approx(closed, abs=1e-6)


@pytest.mark.parametrize(("degree", "zero"), [(3, 4.493409458), (5, 5.763459197), (7, 6.987932001), (9, 8.182561453)])
def test_nothing_is_left_at_the_known_periods(degree: int, zero: float) -> None:
    """First zeros of j_1 to j_4 (tan x = x of degree 3): durations of zero / π periods leave nothing."""
    law = polynomial(zero / np.pi, degree, 2001)
    assert swing((oscillator(2 * np.pi),), law) < 1e-6
    assert swing((oscillator(2.2 * np.pi),), law) > 1e-4


def test_shapers_leave_nothing_and_two_of_them_hold_two_modes() -> None:
    """Of their own frequencies, damped or not, whatever the law; and what that costs is half a period each. To what the
    spline leaves of the folded law.
    """
    modes = (oscillator(9.0, 0.05), oscillator(23.0))
    found = folded([shaper(mode.omega, mode.damping) for mode in modes])
    plain, shaped = polynomial(0.31, 7, 4001), polynomial(0.31, 7, 4001, found)
    assert swing(modes, plain) > 0.5
    assert swing(modes, shaped) < 1e-7
    assert shaped.duration == pytest.approx(0.31 + np.pi / 9.0 / np.sqrt(1 - 0.05**2) + np.pi / 23.0)


def test_answers_are_those_of_an_integrator() -> None:
    """η̈ of a damped oscillator by SciPy at 1e-10, on a coarse law whose acceleration is linear between knots."""
    law, mode = polynomial(1.0, 7, 11), oscillator(15.0, 0.1)

    def slopes(t: float, x: np.ndarray) -> list[float]:
        pushed = float(np.interp(t, law.t, law.acceleration))
        return [x[1], -pushed - 2 * 0.1 * 15.0 * x[1] - 225.0 * x[0]]

    found = solve_ivp(slopes, (0.0, 1.0), [0.0, 0.0], t_eval=law.t, rtol=1e-10, atol=1e-12, max_step=0.01)
    there = [slopes(t, x)[1] for t, x in zip(law.t, found.y.T, strict=True)]
    np.testing.assert_allclose(mode.accelerations(law.step, law.acceleration), there, atol=1e-6)
    last = found.y[:, -1]
    own = 15.0 * np.sqrt(1 - 0.01)
    left = np.hypot(last[0], (last[1] + 1.5 * last[0]) / own)
    assert swing((mode,), law) == pytest.approx(left, rel=1e-6)


def test_amplitudes_are_seen_in_what_points_do() -> None:
    """Of two modes after a law, from the motion of two points that SciPy's answer of either makes: the complex
    amplitudes that the law leaves.
    """
    law = polynomial(0.6, 7, 51)
    rng = np.random.default_rng(1)
    modes = [Mode(w, z, g, rng.normal(size=(2, 3)), np.ones(1)) for w, z, g in ((9.0, 0.05, 2.0), (31.0, 0.0, -0.5))]
    later = np.linspace(0.6, 2.0, 401)
    places = np.zeros((401, 2, 3)) + rng.normal(size=(2, 3))
    for mode in modes:

        def slopes(t: float, x: np.ndarray, mode: Mode = mode) -> list[float]:
            pushed = float(np.interp(t, law.t, law.acceleration, right=0.0)) * mode.excitation
            return [x[1], -pushed - 2 * mode.damping * mode.omega * x[1] - mode.omega**2 * x[0]]

        x = solve_ivp(slopes, (0.0, 2.0), [0.0, 0.0], t_eval=later, rtol=1e-10, atol=1e-12, max_step=0.01).y[0]
        places += np.multiply.outer(x, mode.sway)
    wanted = [mode.ending(law.step, len(law.t)) @ law.acceleration for mode in modes]
    np.testing.assert_allclose(seen(modes, later, places), wanted, atol=1e-6)
