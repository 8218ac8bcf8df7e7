"""Compiled chains with static modes: against the NumPy equations, and against the same source uncompiled."""

from __future__ import annotations

from pathlib import Path

import chain_cases
import pytest
import quasi_static_cases as cases
from twins import distance, uncompiled

LIKE_NUMPY = 1e-10  # relative: two orders of summation, through about a hundred terms
# relative: sums in another order change mass matrices by 1e-15 of each entry, and that changes these results, through
# the modes of the mechanism, by up to 7.4e-12 ("controllers", damping; measured by such disturbances); ten times that
LIKE_TWIN = 7.4e-11


@pytest.mark.parametrize("static", [True, False])
@pytest.mark.parametrize("name", cases.BANDWIDTHS)
def test_kernels_equal_the_numpy_equations(name: str, static: bool, tmp_path: Path) -> None:
    """Residual, mass, stiffness, damping, acceleration; with static modes, and with these left out."""
    system = cases.equations(tmp_path, name, static)
    assert system.compiled is not None
    assert (len(system.modes.stiffness) > 0) == static
    for at in cases.states(system, name):
        found = chain_cases.evaluate(system.compiled, at)
        assert distance(found["residual"], system.residual(at.t, at.y, at.v, at.a)) <= LIKE_NUMPY
        assert distance(found["mass"], system.mass_matrix(at.t, at.y)) <= LIKE_NUMPY
        stiffness, damping = system.stiffness_and_damping(at.t, at.y, at.v)
        assert distance(found["stiffness"], stiffness) <= LIKE_NUMPY
        assert distance(found["damping"], damping) <= LIKE_NUMPY
        assert distance(found["acceleration"], system.acceleration(at.t, at.y, at.v)) <= LIKE_NUMPY


def test_kernels_equal_their_uncompiled_twin(tmp_path: Path) -> None:
    """The same source as plain Python (``ERLS_JIT=0``) in a process of its own."""
    found, twin = cases.all_results(tmp_path), uncompiled(cases, tmp_path)
    assert set(twin) == set(found)
    for key, values in found.items():
        assert distance(values, twin[key]) <= LIKE_TWIN, key
