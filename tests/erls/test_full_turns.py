"""Rotation vectors that differ by full turns: one rotation, one angular velocity."""

from __future__ import annotations

import numpy as np
import pytest

from erls.maths.full_turns import nearest, turned_on, turns_to
from erls.maths.rotation_maps import exp, tangent

PSI = np.array([[0.4, -1.1, 2.0], [3.0, 1.0, -0.5], [1e-3, 2e-3, -1e-3]])
RATE = np.array([[1.0, 0.3, -0.2], [-0.4, 2.0, 0.1], [0.0, 1.0, 0.5]])


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_they_turn_alike(turns: int) -> None:
    psi, rate = turned_on(PSI, RATE, turns)
    assert np.allclose(exp(psi), exp(PSI), atol=1e-12)
    spin, before = (np.einsum("kij,kj->ki", tangent(x), v) for x, v in ((psi, rate), (PSI, RATE)))
    assert np.allclose(spin, before, atol=1e-9)  # T is 1e3 times as large for the small vector


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_the_nearest_is_the_one_they_came_from(turns: int) -> None:
    psi, rate = turned_on(PSI, RATE, turns)
    assert np.allclose(nearest(psi, PSI + 0.1), PSI, atol=1e-12)
    back, there = turned_on(psi, rate, turns_to(psi, PSI))
    assert np.allclose(back, PSI, atol=1e-12)
    assert np.allclose(there, RATE, atol=1e-9)


def test_no_turn_is_none() -> None:
    assert np.array_equal(nearest(np.zeros((1, 3)), np.ones((1, 3))), np.zeros((1, 3)))
