"""Direct differentiation: derivatives of all states of a run by all parameters, along the steps that it accepted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.equations import Equations, Stretch, Walk, solve
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.start import start_derivatives
from erls.sensitivity.variants import Difference


def differentiated(run: ChainRun, differences: Sequence[Difference], scheme: Scheme) -> Array:
    """(k, 3, n, p) derivatives of coordinates, rates and accelerations at the knots of a run by p parameters.

    Parameters
    ----------
    run : ChainRun
        Without loops, or with loops whose forces are part of the equations (`lobatto`).
    differences : sequence of Difference
    scheme : Scheme
        Of the method that made the run.
    """
    s = run.solution
    n, count = s.y.shape[1], len(differences)
    result = np.zeros((len(s.t), 3, n, count))
    if not n:  # every motion is prescribed, and no link deforms
        return result
    equations = Equations(run, differences, scheme)
    state = np.zeros((4, n, count))  # of y, v, a and α
    state[:2] = start_derivatives(run, differences)
    for walk in equations.walks:
        knots = equations.knots(walk, np.array([walk.first]))
        mass, damping, stiffness = (x[0] for x in equations.tangents(knots))
        right = equations.forces(knots)[0] + damping @ state[1] + stiffness @ state[0]
        state[2] = state[3] = -solve(mass, right, False, float(knots.t[0]))
        result[walk.first] = state[:3]
        state = stepped(equations, walk, (walk.first + 1, walk.end), state, result)
    return result


def stepped(
    equations: Equations, walk: Walk, between: tuple[int, int], state: Array, result: Array
) -> Array:
    """(4, n, p) derivatives at the end of some steps of a leg; those at their knots go into ``result``."""
    for first, end in equations.stretches(walk, between):
        stretch = equations.stretch(walk, first, end)
        state = _steps(stretch, equations.forces(stretch.knots), state, result[first:end])
    return state


def _steps(stretch: Stretch, forces: Array, state: Array, out: Array) -> Array:
    """Derivatives ``out`` (j s, 3, n, p) at the nodes of a stretch, and (4, n, p) at its end."""
    scheme, (_, n, columns) = stretch.scheme, state.shape
    nodes, flat = (scheme.count, n, columns), state.reshape(4, -1)
    for number in range(len(stretch.h)):
        step = stretch.step(number)
        if step.rescaled is not None:
            flat = step.rescaled @ flat
        y, v = step.to_y @ flat, step.to_v @ flat
        right = forces[step.rows] + step.damping @ v.reshape(nodes) + step.stiffness @ y.reshape(nodes)
        a = -solve(step.block, right.reshape(-1, columns), False, step.t).reshape(scheme.count, -1)
        y += (step.h**2 * scheme.places) @ a
        v += (step.h * scheme.rates) @ a
        for k, x in enumerate((y, v, a)):
            out[step.rows, k] = x.reshape(nodes)
        flat = step.kept @ flat + step.added @ a
    return flat.reshape(state.shape)
