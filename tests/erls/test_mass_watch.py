"""What is said of mass matrices that lose their sign."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution
from erls.maths.so3 import Array
from erls.run.watches.mass import indefinite_mass


@pytest.mark.parametrize(
    ("least", "said"),
    [
        (-1e-3, "the mass matrix is indefinite: .* got 'least eigenvalue -0.001, .*, limit above 0;"),
        (1e-13, "is about to turn indefinite: .* 1e-13, .*, limit above 5e-07, as it was 0.5 at the start;"),
        (1e-3, None),
    ],
)
def test_what_is_said_of_a_mass_matrix_fits_its_sign(least: float, said: str | None) -> None:
    """Of a run that failed at its last state: two unit masses, coupled by 1 - λ, have the eigenvalues λ and 2 - λ."""

    def mass_matrix(t: float, y: Array) -> Array:
        coupling = 1 - (0.5 if t == 0 else least)
        return np.array([[1.0, coupling], [coupling, 1.0]])

    zero = np.zeros((2, 2))
    failure = SimulationError(Cause.STEP_TOO_SMALL, "no step is small enough")
    solution = Solution(np.array([0.0, 1.0]), zero, zero, zero, failure=failure)
    formulation: Any = SimpleNamespace(size=2, mass_matrix=mass_matrix)
    found = indefinite_mass(formulation, solution)
    if said is None:
        assert found is None
        return
    assert found is not None
    assert found.cause == Cause.SINGULAR_MASS
    assert re.search(said, str(found)), str(found)
