"""Whichever form of the equations of ERLS serves a run: an effect that it asks for is in it."""

from __future__ import annotations

from pathlib import Path

import frozen_values
import numpy as np
import pytest
import stiffened_cases

from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.formulation import Ffr
from erls.equations.registry import formulate
from erls.scene.settings import Simulation


@pytest.mark.parametrize("gauge", ["joint-angle", "minimum-norm"])
def test_runs_get_the_inertia_of_modes_that_they_ask_for(gauge: str, tmp_path: Path) -> None:
    """The kinetic energy is that of its judge, dense or floating frames, and not that without the effect."""
    plain = stiffened_cases.mechanism(tmp_path, stiffened_cases.CASES[0], frozen_values.SOURCE)
    asked = frozen_values.with_effects(plain, frozen_values.MODAL_INERTIA)
    judge = DenseChain(asked, gauge) if gauge == "minimum-norm" else Ffr(asked)
    state = 0.0, np.full(judge.size, 0.01), np.full(judge.size, 1.0)
    found = formulate(asked, Simulation(duration=1.0, gauge=gauge)).energy(*state).kinetic
    # through numbers that are 1e5 times as large
    assert found == pytest.approx(judge.energy(*state).kinetic, rel=1e-10)
    without = formulate(plain, Simulation(duration=1.0, gauge=gauge)).energy(*state).kinetic
    assert found != pytest.approx(without, rel=1e-6)
