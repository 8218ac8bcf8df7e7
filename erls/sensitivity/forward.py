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
    scheme, shape = stretch.scheme, state.shape
    _, damping, stiffness = stretch.tangents
    to_y, to_v = stretch.history
    kept, added = stretch.moved_on
    count, n, columns = scheme.count, shape[1], shape[2]
    nodes = count, n, columns
    flat = state.reshape(4, -1)
    for step, h in enumerate(stretch.h.tolist()):
        rows, rescaled = stretch.rows(step), stretch.rescaled(step)
        if rescaled is not None:
            flat = rescaled @ flat
        y, v = to_y[step] @ flat, to_v[step] @ flat
        right = forces[rows] + damping[rows] @ v.reshape(nodes) + stiffness[rows] @ y.reshape(nodes)
        t = float(stretch.knots.t[rows.start])
        a = -solve(stretch.blocks[step], right.reshape(count * n, columns), False, t).reshape(count, -1)
        y += (h * h * scheme.places) @ a
        v += (h * scheme.rates) @ a
        for k, x in enumerate((y, v, a)):
            out[rows, k] = x.reshape(nodes)
        flat = kept[step] @ flat + added[step] @ a
    return flat.reshape(shape)
