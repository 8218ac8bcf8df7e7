"""Whichever form of the equations of ERLS serves a run: an effect that it asks for is in it."""

from __future__ import annotations

from pathlib import Path

import frozen_values
import numpy as np
import pytest
import stiffened_cases

from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain as Judge
from erls.equations.registry import formulate
from erls.errors import Cause, SceneError
from erls.scene.settings import Simulation


@pytest.mark.parametrize("gauge", ["joint-angle", "minimum-norm"])
def test_runs_get_the_inertia_of_modes_that_they_ask_for(gauge: str, tmp_path: Path) -> None:
    """The kinetic energy is that of the dense form, and not that without the effect."""
    plain = stiffened_cases.mechanism(tmp_path, stiffened_cases.CASES[0], frozen_values.SOURCE)
    asked = frozen_values.with_effects(plain, frozen_values.MODAL_INERTIA)
    judge = Judge(asked, gauge)
    state = 0.0, np.full(judge.size, 0.01), np.full(judge.size, 1.0)
    found = formulate(asked, Simulation(duration=1.0, gauge=gauge)).energy(*state).kinetic
    assert found == pytest.approx(judge.energy(*state).kinetic, rel=1e-12)
    assert found != pytest.approx(Judge(plain, gauge).energy(*state).kinetic, rel=1e-6)


def test_the_recursion_refuses_what_it_has_not(tmp_path: Path) -> None:
    """Built by hand, not by the registry, which takes the dense form."""
    plain = stiffened_cases.mechanism(tmp_path, stiffened_cases.CASES[0], frozen_values.SOURCE)
    with pytest.raises(SceneError, match="no inertia of modes") as caught:
        Erls(frozen_values.with_effects(plain, frozen_values.MODAL_INERTIA))
    assert caught.value.cause is Cause.BAD_FIELD
    assert "DenseChain" in str(caught.value)
