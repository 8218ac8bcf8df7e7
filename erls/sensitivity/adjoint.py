"""The adjoint method: derivatives of a few outputs by many parameters, backward over the steps of a run.

Of an output g that depends on the states at some knots, λ with Bᵀ λ = -∂g/∂a of each step, B its matrix of
accelerations, gives dg/dp = Σ λᵀ ∂R/∂p over all nodes of all steps, and what a start owes to p: the transpose of
`erls.sensitivity.forward`, step for step, so that both agree to rounding. What a step leaves to the one before it are
derivatives of g by (y, v, a, α) at its start. Tangents are found again a stretch at a time, from the knots that the run
keeps, so that memory does not grow with its length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.equations import Equations, Stretch, Walk, solve
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.start import start_derivatives
from erls.sensitivity.variants import Difference

Seeds = Mapping[int, Array]
"""(3, n, c) derivatives of c outputs by coordinates, rates and accelerations at some knots, by number."""


def gradients(run: ChainRun, differences: Sequence[Difference], scheme: Scheme, seeds: Seeds, count: int) -> Array:
    """(p, c) derivatives of ``count`` outputs by p parameters, through the motion.

    Parameters
    ----------
    run, differences, scheme
        As of `erls.sensitivity.forward.differentiated`.
    seeds : mapping of int to (3, n, c) array
    count : int
        c.
    """
    n = run.solution.y.shape[1]
    total = np.zeros((len(differences), count))
    if not n:  # every motion is prescribed, and no link deforms
        return total
    equations = Equations(run, differences, scheme)
    state = np.zeros((4, n, count))  # by y, v, a and α
    for walk in reversed(equations.walks):
        state = stepped_back(equations, walk, (walk.first + 1, walk.end), seeds, state, total)
        knots = equations.knots(walk, np.array([walk.first]))
        mass, damping, stiffness = (x[0] for x in equations.tangents(knots))
        y, v, a, algorithmic = state
        if walk.first in seeds:
            y, v, a = (x + seed for x, seed in zip((y, v, a), seeds[walk.first], strict=True))
        found = -solve(mass, a + algorithmic, True, float(knots.t[0]))
        for k, force in equations.each_force(knots):
            total[k] += force[0] @ found
        state = np.stack([y + stiffness.T @ found, v + damping.T @ found, 0 * y, 0 * y])
    start = start_derivatives(run, differences)
    return np.asarray(total + np.tensordot(start, state[:2], ((0, 1), (0, 1))))


def stepped_back(
    equations: Equations, walk: Walk, between: tuple[int, int], seeds: Seeds, state: Array, total: Array
) -> Array:
    """Derivatives by (4, n, c) at the start of some steps of a leg from those at their end; what parameters do between
    is added to ``total`` (p, c).
    """
    for first, end in reversed(equations.stretches(walk, between)):
        stretch = equations.stretch(walk, first, end)
        multipliers = np.empty((end - first, *state.shape[1:]))
        state = _steps_back(stretch, _within(seeds, first, end), state, multipliers)
        for k, force in equations.each_force(stretch.knots):
            total[k] += np.tensordot(force, multipliers, 2)
    return state


def _within(seeds: Seeds, first: int, end: int) -> dict[int, Array]:
    """Those of some knots, counted from the first of them."""
    return {knot - first: seed for knot, seed in seeds.items() if first <= knot < end}


def _steps_back(stretch: Stretch, seeds: Seeds, state: Array, multipliers: Array) -> Array:
    """λ (j s, n, c) at the nodes of a stretch, and derivatives by (4, n, c) at its start from those at its end."""
    scheme, (_, n, columns) = stretch.scheme, state.shape
    nodes, flat = (scheme.count, n, columns), state.reshape(4, -1)
    for number in range(len(stretch.h) - 1, -1, -1):
        step = stretch.step(number)
        right = step.added.T @ flat
        asked = _asked(seeds, step.rows, nodes)
        if asked is not None:
            by_y, by_v, by_a = asked
            right = right + by_a + (step.h**2 * scheme.places.T) @ by_y + (step.h * scheme.rates.T) @ by_v
        found = -solve(step.block, right.reshape(-1, columns), True, step.t).reshape(nodes)
        multipliers[step.rows] = found
        before_y = (step.stiffness.swapaxes(1, 2) @ found).reshape(scheme.count, -1)
        before_v = (step.damping.swapaxes(1, 2) @ found).reshape(scheme.count, -1)
        if asked is not None:
            before_y, before_v = before_y + asked[0], before_v + asked[1]
        flat = step.kept.T @ flat + step.to_y.T @ before_y + step.to_v.T @ before_v
        if step.rescaled is not None:
            flat = step.rescaled.T @ flat
    return flat.reshape(state.shape)


def _asked(seeds: Seeds, rows: slice, nodes: tuple[int, int, int]) -> Array | None:
    """(3, s, n c) what outputs ask of the nodes of a step; None where they ask nothing."""
    some = [i for i in range(nodes[0]) if rows.start + i in seeds]
    if not some:
        return None
    found = np.zeros((3, *nodes))
    for i in some:
        found[:, i] = seeds[rows.start + i]
    return found.reshape(3, nodes[0], -1)
