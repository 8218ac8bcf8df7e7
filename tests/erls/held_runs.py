"""Runs of equations at other values of a parameter by the steps of a run, their iterations carried to rounding: what
central differences are taken of.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from complex_runs import collocation

from erls.equations.series import residual_series
from erls.integrate.base import walked
from erls.integrate.choice import integrator, options_of
from erls.integrate.lobatto import NODES
from erls.run.chain.run import ChainRun
from erls.sensitivity.variants import Variant

ENOUGH = 25  # iterations at the most: each leaves a tenth or less


def tightened(run: ChainRun, formulation: Any, tolerance: float = 0.0) -> ChainRun:
    """The run of equations with fixed steps whose iterations end at rounding."""
    settings = run.scene.record.simulation
    options = replace(options_of(settings), newton_tolerance=tolerance)
    start = formulation.initial_state()
    solution = integrator(formulation.mechanism, settings)(
        formulation, (0.0, settings.duration), *start, options, None
    )
    assert solution.failure is None
    return replace(run, formulation=formulation, solution=solution)


def collocated(run: ChainRun, variant: Variant) -> ChainRun:
    """A variant by Lobatto collocation with the steps of the run, in its own coordinates."""
    chain: Any = variant.formulation
    base: Any = run.formulation
    s, nodes = run.solution, len(NODES) - 1
    found = np.stack([variant.placed(x) for x in (s.y, s.v, s.a)], axis=1)  # where iterations begin
    y, v = chain.initial_state()
    for first, end, leg in walked(base, s.t):
        none = np.zeros((1, 1))
        found[first : first + 1] = _balanced(chain, [leg.first], found[first : first + 1], ([y], [v]), none, none)
        for at in range(first + 1, end, nodes):
            h = s.t[at + nodes - 1] - s.t[at - 1]
            times = np.clip(s.t[at : at + nodes], leg.first, leg.last).tolist()
            knots = found[at : at + nodes]
            found[at : at + nodes] = _balanced(chain, times, knots, *collocation(h, found[at - 1]))
        y, v, _ = found[end - 1]
    y, v, a = found.swapaxes(0, 1)
    return replace(run, formulation=chain, solution=replace(s, y=y.copy(), v=v.copy(), a=a.copy()))


def _balanced(
    chain: Any, t: list[float], guess: np.ndarray, given: Any, rates: np.ndarray, places: np.ndarray
) -> np.ndarray:
    """(s, 3, n) states at nodes: y = given + places a, v = given + rates a, forces in balance."""
    (y, v), (count, _, n) = given, guess.shape
    blocks = []
    for i, time in enumerate(t):
        stiff, damp = chain.stiffness_and_damping(time, guess[i, 0], guess[i, 1])
        mass = chain.mass_matrix(time, guess[i, 0])
        blocks.append([(i == j) * mass + rates[i, j] * damp + places[i, j] * stiff for j in range(count)])
    whole = np.block(blocks)
    a, best, least = guess[:, 2].copy(), guess, np.inf
    for _ in range(ENOUGH):
        state = np.stack([y + places @ a, v + rates @ a, a], axis=1)
        wrong = residual_series(chain.compiled, np.array(t), *(np.ascontiguousarray(x) for x in state.swapaxes(0, 1)))
        change = np.linalg.solve(whole, wrong.ravel()).reshape(count, n)
        size = float(np.abs(change).max())
        if size < least:
            best, least = state, size
        a = a - change
    return best
