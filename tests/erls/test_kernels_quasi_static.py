"""Compiled chains with static modes: against the NumPy equations, and against the same source uncompiled."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import chain_cases
import pytest
import quasi_static_cases as cases
from twins import distance, uncompiled

from erls.equations.erls.formulation import Erls
from erls.equations.quasi_static.formulation import QuasiStatic, quasi_static
from erls.mechanism.effects import SECOND_KINEMATICS

LIKE_NUMPY = 1e-10  # relative: two orders of summation, through about a hundred terms
# relative: sums in another order change mass matrices by 1e-15 of each entry, and that changes these results, through
# the modes of the mechanism, by up to 7.4e-12 ("controllers", damping; measured by such disturbances); ten times that
LIKE_TWIN = 7.4e-11


WAYS = [(name, static, frozenset[str]()) for name in cases.BANDWIDTHS for static in (True, False)]
WAYS += [(name, static, SECOND_KINEMATICS) for name in ("one link", "controllers") for static in (True, False)]


@pytest.mark.parametrize(("name", "static", "more"), WAYS)
def test_kernels_equal_the_numpy_equations(name: str, static: bool, more: frozenset[str], tmp_path: Path) -> None:
    """Residual, mass, stiffness, damping, acceleration; with static modes, and with these left out; with second-order
    displacements too.
    """
    mechanism = cases.mechanism(tmp_path, name, static)
    system = quasi_static(Erls, replace(mechanism, effects=mechanism.effects | more), 1.0)
    assert isinstance(system, QuasiStatic)
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
