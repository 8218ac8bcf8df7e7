"""Derivatives of what was noted on a tape, against complex steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from erls.maths.jit import ENABLED
from erls.maths.linearized import jacobian
from erls.maths.tracing import Tape

compiled_only = pytest.mark.skipif(not ENABLED, reason="programs are for compiled code")


def _formula(z: Any) -> list[Any]:
    """Every operation; an output that is an input, one that is an output of another, and one that is nothing."""
    x, y, c, zero = z
    q = x * y / c + np.cos(x) * np.sqrt(y) - 2 * c**2 + 3 / y - np.tanh(x) / 4
    q -= np.exp(-x) * np.log(y) + np.sin(c) * np.tan(x) - np.cosh(x) / np.sinh(y) + np.arctan(0.7 * c)
    if q.real < 100.0 and q != 7.0 and x.real <= y.real:
        q = q * q + x * x + zero * np.exp(y)
    return [q, x, q * y**1.5, 0.0 * x]


@compiled_only
def test_derivatives() -> None:
    """Of twenty states to rounding, which terms of 20 have; a leaf that is always zero has no derivatives of others."""
    from erls.maths.programs import run

    tape, rng = Tape(), np.random.default_rng(1)
    z = tape.leaves([0.3, 0.8, 1.7, 0.0])
    out = [tape.literal(x) if isinstance(x, float) else x.place for x in _formula(z)]
    program, places = jacobian(tape, [x.place for x in z[:3]], out, [z[3].place])
    states = np.array([0.3, 0.8, 1.7]) + 0.1 * rng.uniform(size=(20, 3))
    states[11, 0] = 2.0  # above y: another way
    inputs = np.flatnonzero(np.isin(program.leaves, [x.place for x in z[:3]]))
    column = program.leaves[inputs] - z[0].place
    found, held = run(program, np.array(tape.values)[program.leaves], inputs, states[:, column])
    assert held.tolist() == [k != 11 for k in range(20)]
    whole = np.zeros((20, 4, 3))
    whole[:, places[:, 0], places[:, 1]] = found
    for k in np.flatnonzero(held):
        for j in range(3):
            moved = np.append(states[k], 0.0).astype(complex)
            moved[j] += 1e-30j
            expected = [complex(x).imag / 1e-30 for x in _formula(moved)]
            np.testing.assert_allclose(whole[k, :, j], expected, rtol=1e-14, atol=2e-14)


def test_absolute_value() -> None:
    tape = Tape()
    x = tape.leaves([-2.0, 3.0])
    for one, sign in zip(x, (-1.0, 1.0), strict=True):
        found = abs(one)
        assert found.value == abs(one.value)
        assert tape.values[tape.slope(found.place)] == sign


def test_no_single_value() -> None:
    """What takes a number for that of one state cannot be noted."""
    with pytest.raises(TypeError):
        float(Tape().leaves([1.0])[0])


def test_powers_and_truth() -> None:
    """Whole exponents of any type are products; others are of positive numbers; truth is noted as a choice."""
    tape = Tape()
    x, y, zero = tape.leaves([-2.0, 4.0, 0.0])
    assert [(x**k).value for k in (2, 2.0, np.int64(2))] == [4.0, 4.0, 4.0]
    assert (y**-0.5).value == pytest.approx(0.5, rel=1e-15)
    assert y**0 == 1.0
    with pytest.raises(TypeError, match="power"):
        x**0.5
    before = len(tape.guards)
    assert not zero
    assert y
    assert len(tape.guards) == before + 2


@compiled_only
@pytest.mark.parametrize("turn", [0.3, 1.8, 3.0, -0.2, -2.0, -3.0])
def test_angles(turn: float) -> None:
    """Of points on every side, with turns that are rounded down, and slopes of both: d φ = (c ds - s dc) / r²."""
    from erls.maths.programs import run

    tape = Tape()
    s, c = tape.leaves([2 * np.sin(turn), 2 * np.cos(turn)])
    angle = np.arctan2(s, c)
    turns = np.floor(angle)
    assert angle.value == pytest.approx(turn, rel=1e-15)
    assert turns.value == np.floor(turn)
    program, places = jacobian(tape, [s.place, c.place], [angle.place, turns.place], [])
    values = np.array([[s.value, c.value], [1.1 * s.value, 0.9 * c.value]])
    leaves = {place: k for k, place in enumerate(program.leaves)}
    found, held = run(program, np.array(tape.values)[program.leaves], np.array([leaves[0], leaves[1]]), values)
    assert held.all()
    expected = np.stack([values[:, 1], -values[:, 0]], axis=1) / (values**2).sum(axis=1)[:, None]
    whole = np.zeros((2, 2, 2))
    whole[:, places[:, 0], places[:, 1]] = found
    np.testing.assert_allclose(whole, np.stack([expected, 0 * expected], axis=1), rtol=1e-14, atol=1e-15)
