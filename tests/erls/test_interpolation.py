"""Interpolation between knots, legs between breakpoints, and settings of integrations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_systems import Modes

from erls.equations.system import metre_scales
from erls.errors import Cause, SceneError
from erls.integrate.base import Options, breakpoints, hermite, legs

ROUNDING = 1e-12  # a few hundred operations on numbers of size 1 to 30


def test_quintics_are_interpolated_exactly() -> None:
    rng = np.random.default_rng(1)
    curves = [np.polynomial.Polynomial(rng.normal(size=6)) for _ in range(3)]
    t = np.array([0.0, 0.3, 1.0, 1.9])

    def values(order: int, at: np.ndarray) -> np.ndarray:
        return np.array([(c.deriv(order) if order else c)(at) for c in curves]).T

    at = np.sort(np.concatenate([t, rng.uniform(0, 1.9, 50)]))  # first and last knot included
    y, v = hermite(t, values(0, t), values(1, t), values(2, t), at)
    np.testing.assert_allclose(y, values(0, at), atol=100 * ROUNDING)
    np.testing.assert_allclose(v, values(1, at), atol=100 * ROUNDING)


def test_a_jump_of_acceleration_stays_at_its_knots() -> None:
    """Rest until t = 1, then unit acceleration: y = (t − 1)²/2; the last time is a jump as well."""
    t = np.array([0.0, 1.0, 1.0, 3.0, 3.0])
    y, v = np.array([[0.0], [0.0], [0.0], [2.0], [2.0]]), np.array([[0.0], [0.0], [0.0], [2.0], [2.0]])
    a = np.array([[0.0], [0.0], [1.0], [1.0], [5.0]])
    at = np.array([0.0, 0.5, 1.0, 1.5, 3.0])
    found, rate = hermite(t, y, v, a, at)
    np.testing.assert_allclose(found[:, 0], np.maximum(at - 1, 0) ** 2 / 2, atol=ROUNDING)
    np.testing.assert_allclose(rate[:, 0], np.maximum(at - 1, 0), atol=ROUNDING)


def test_one_knot_is_a_constant() -> None:
    y, v = hermite(np.zeros(1), np.ones((1, 2)), np.full((1, 2), 3.0), np.zeros((1, 2)), np.zeros(4))
    assert y.shape == v.shape == (4, 2)
    assert (y == 1).all()
    assert (v == 3).all()


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ((), [2.0]),
        ((0.5, 1.0), [0.5, 1.0, 2.0]),
        ((1.0, 0.5, 0.5), [0.5, 1.0, 2.0]),
        ((-1.0, 0.0, 2.0, 3.0), [2.0]),  # ends and outside
        ((0.3, 0.1 + 0.2), [0.3, 2.0]),  # apart by rounding
        ((2.0 - 1e-15, 1e-15), [2.0]),
    ],
)
def test_breakpoints(given: tuple[float, ...], expected: list[float]) -> None:
    assert breakpoints(Modes([1.0], breakpoints=given), (0.0, 2.0)) == expected


def test_legs_meet_and_keep_a_hair_from_their_ends() -> None:
    found = legs(Modes([1.0], breakpoints=(0.5, 0.5 + 1.5e-12)), (-1.0, 1.0))
    assert [leg.start for leg in found[1:]] == [leg.end for leg in found[:-1]]
    assert (found[0].start, found[-1].end) == (-1.0, 1.0)
    assert len(found) == 3
    assert all(leg.start < leg.first <= leg.last < leg.end for leg in found)
    assert legs(Modes([1.0]), (1.0, 1.0)) == []


@pytest.mark.parametrize("times", [(1.0, 0.0), (0.0, math.nan), (0.0, math.inf)])
def test_times_that_make_no_run_are_refused(times: tuple[float, float]) -> None:
    with pytest.raises(SceneError) as caught:
        legs(Modes([1.0]), times)
    assert caught.value.cause is Cause.BAD_FIELD


@pytest.mark.parametrize(
    "setting",
    [
        {"step": 0.0},
        {"step": math.nan},
        {"rtol": 1e-16},
        {"atol": 0.0},
        {"spectral_radius": 1.1},
        {"newton_tolerance": -1.0},
    ],
)
def test_settings_out_of_range_are_refused(setting: dict[str, float]) -> None:
    with pytest.raises(SceneError, match=next(iter(setting))) as caught:
        Options(**setting)
    assert caught.value.cause is Cause.BAD_FIELD


def test_scales_are_never_zero() -> None:
    system = Modes([1.0, 1.0])
    assert (metre_scales(system) == 1).all()

    class Still(Modes):
        length_scales = np.array([0.0, 2.0])

    assert (metre_scales(Still([1.0, 1.0])) == [2e-6, 2.0]).all()
