"""Derivatives of the state that a run starts from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from erls.equations.linearization import derivatives, difference_steps
from erls.equations.serial.equilibrium import Held
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.variants import Difference, Variant


def start_derivatives(run: ChainRun, differences: Sequence[Difference]) -> Array:
    """(2, n, p) derivatives of coordinates and rates at the start by p parameters.

    Parameters
    ----------
    run : ChainRun
    differences : sequence of Difference
    """
    base: Any = run.formulation
    if not base.mechanism.static_start:
        here = np.stack(base.initial_state())
        return np.stack([d.beside(_initial, here) for d in differences], axis=2)
    return _static(run, differences)


def _initial(variant: Variant) -> Array:
    """(2, n) where a variant starts, in the coordinates of the run."""
    return np.stack([variant.taken_back(x) for x in variant.formulation.initial_state()])


def _static(run: ChainRun, differences: Sequence[Difference]) -> Array:
    """Of equilibria with joints held: F(y) + Bᵀ μ = 0, Φ(y) = 0 differentiated as they stand, since iterations end
    before differences of them would be exact.
    """
    base: Any = run.formulation
    held: Held = base.held
    y, _ = base.initial_state()
    _, rows = held.conditions(y)
    multipliers = -np.linalg.lstsq(rows.T, held.forces(y[None], np.zeros(held.loops))[0], rcond=None)[0]
    loops = multipliers[: held.loops]
    steps = difference_steps(held.metres, float(base.mechanism.reach), held.stiffness)
    slope = derivatives(lambda many: held.forces(many, loops), y, steps)
    block = np.block([[slope, rows.T], [rows, np.zeros((len(rows),) * 2)]])

    def balance(variant: Variant) -> Array:
        own: Held = variant.formulation.held
        at = variant.placed(y)
        force = own.forces(at[None], loops)[0]
        return np.concatenate([force if variant.turn is None else force @ variant.turn, own.conditions(at)[0]])

    result = []
    here = _rates(base)
    for difference in differences:
        rates = difference.beside(lambda variant: variant.taken_back(_rates(variant.formulation)), here)
        moved = -np.linalg.solve(block, difference.of(balance))[: len(y)]
        result.append(np.stack([moved, rates]))
    return np.stack(result, axis=2)


def _rates(formulation: Any) -> Array:
    """(n,) rates at the start; those of a tree know no equilibrium."""
    found = formulation.initial_state() if formulation.mechanism.loops else formulation.undeformed_start()
    return np.asarray(found[1])
