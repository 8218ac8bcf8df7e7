"""Direct differentiation: derivatives of all states of a run by all parameters, along the steps that it accepted.

With R(t, y, v, a; p) = 0 at every node of a step and the formulas of the method (`erls.sensitivity.schemes`),

    M δa_i + D δv_i + K δy_i + ∂R/∂p = 0

is one linear system for the accelerations of a step, whose factors serve all parameters. The steps are held: this is
the derivative of the discrete scheme, iterated to the end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from erls.equations.serial.equilibrium import elastic_on_diagonal, size_of
from erls.equations.system import metre_scales
from erls.integrate.base import Leg, legs
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.start import start_derivatives
from erls.sensitivity.tangents import Knots, Tangents, steps_of, tangents
from erls.sensitivity.variants import Difference

_ROOM = 4_000_000
"""Numbers of tangents that are held at a time."""


class Walk(NamedTuple):
    """A leg of a run: number of its first knot and the one after its last, and its times."""

    first: int
    end: int
    leg: Leg


class Linear(NamedTuple):
    """What one stretch of knots needs: tangents, and (k, n, p) ∂R/∂p."""

    tangents: Tangents
    forces: Array


class Equations:
    """Linearized equations of a run at its knots.

    Parameters
    ----------
    run : ChainRun
    differences : sequence of Difference
        By each parameter.
    """

    def __init__(self, run: ChainRun, differences: Sequence[Difference]) -> None:
        self.solution, self.differences = run.solution, differences
        system: Any = run.formulation
        tree: Any = getattr(system, "bare", system)  # under the loops
        stiffness, _ = elastic_on_diagonal(tree)
        self.steps = steps_of(metre_scales(system), size_of(system.mechanism), stiffness)
        self.system = system
        self.acting = [difference.acts for difference in differences]

    def walks(self) -> list[Walk]:
        """Legs that were walked over."""
        t = self.solution.t
        ends = [0, *(np.flatnonzero(np.diff(t) == 0) + 1).tolist(), len(t)]
        whole = legs(self.system, (float(t[0]), float(t[-1])))
        return [Walk(first, end, leg) for first, end, leg in zip(ends[:-1], ends[1:], whole, strict=False)]

    def at(self, walk: Walk, first: int, end: int) -> Linear:
        """Of some knots of a leg."""
        s = self.solution
        at = np.clip(s.t[first:end], walk.leg.first, walk.leg.last)
        knots = Knots(at, *(np.ascontiguousarray(x[first:end]) for x in (s.y, s.v, s.a)))
        every, none = zip(self.differences, self.acting, strict=True), np.zeros_like(knots.y)
        forces = [one.of(lambda variant: variant.forces(knots)) if acts else none for one, acts in every]
        return Linear(tangents(self.system.compiled, knots, self.steps), np.stack(forces, axis=2))

    def chunk(self, nodes: int) -> int:
        """Knots to linearize at a time: whole steps of so many nodes."""
        n = int(self.system.size)
        return max(1, _ROOM // (3 * n * n + 1) // nodes) * nodes


def step_blocks(scheme: Scheme, h: float, found: Tangents) -> Array:
    """(s n, s n) matrix of the accelerations of a step, from the tangents at its s nodes."""
    mass, damping, stiffness = found
    blocks = h * np.einsum("ij,ikl->ikjl", scheme.rates, damping)
    blocks += h * h * np.einsum("ij,ikl->ikjl", scheme.places, stiffness)
    for i in range(scheme.count):
        blocks[i, :, i] += mass[i]
    size = scheme.count * mass.shape[1]
    return np.asarray(blocks.reshape(size, size))


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
    equations, s = Equations(run, differences), run.solution
    n, count = s.y.shape[1], len(differences)
    result = np.zeros((len(s.t), 3, n, count))
    state = np.zeros((4, n, count))  # of y, v, a and α
    state[:2] = start_derivatives(run, differences)
    for walk in equations.walks():
        begun = equations.at(walk, walk.first, walk.first + 1)
        state[2] = accelerations(begun, state)
        state[3] = state[2]
        result[walk.first] = state[:3]
        before: float | None = None
        for first, end, found in _stretches(equations, walk, scheme):
            for at in range(first, end, scheme.count):
                h = float(s.t[at + scheme.count - 1] - s.t[at - 1])
                rows = slice(at - first, at - first + scheme.count)
                part = Linear(Tangents(*(x[rows] for x in found.tangents)), found.forces[rows])
                state = np.einsum("ij,jnp->inp", scheme.rescaled(h, before), state)
                nodes = _step(scheme, h, part, state)
                result[at : at + scheme.count] = nodes.swapaxes(0, 1)
                kept, added = scheme.moved_on(h)
                state = np.einsum("ij,jnp->inp", kept, state) + np.einsum("ij,jnp->inp", added, nodes[2])
                before = h
    return result


def accelerations(begun: Linear, state: Array) -> Array:
    """(n, p) derivatives of accelerations where a leg begins."""
    mass, damping, stiffness = (x[0] for x in begun.tangents)
    return np.asarray(-np.linalg.solve(mass, begun.forces[0] + damping @ state[1] + stiffness @ state[0]))


def _stretches(equations: Equations, walk: Walk, scheme: Scheme) -> Iterator[tuple[int, int, Linear]]:
    """Whole steps of a leg, some at a time."""
    chunk = equations.chunk(scheme.count)
    for first in range(walk.first + 1, walk.end, chunk):
        end = min(first + chunk, walk.end)
        yield first, end, equations.at(walk, first, end)


def _step(scheme: Scheme, h: float, found: Linear, state: Array) -> Array:
    """(3, s, n, p) derivatives at the nodes of a step."""
    to_y, to_v = scheme.history(h)
    y, v = np.einsum("ij,jnp->inp", to_y, state), np.einsum("ij,jnp->inp", to_v, state)
    _, damping, stiffness = found.tangents
    right = found.forces + damping @ v + stiffness @ y
    size, count = scheme.count * y.shape[1], y.shape[2]
    factors = la.lu_factor(step_blocks(scheme, h, found.tangents), check_finite=False)
    a = -la.lu_solve(factors, right.reshape(size, count), check_finite=False).reshape(y.shape)
    y += h * h * np.einsum("ij,jnp->inp", scheme.places, a)
    v += h * np.einsum("ij,jnp->inp", scheme.rates, a)
    return np.stack([y, v, a])
