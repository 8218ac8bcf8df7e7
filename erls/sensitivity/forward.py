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
from fe_import.model import IntArray

_ROOM = 4_000_000
"""Numbers of tangents that are held at a time."""

_SAMPLE = 12  # knots at which forces show whether they are linear in a parameter


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
        self.solution = run.solution
        system: Any = run.formulation
        tree: Any = getattr(system, "bare", system)  # under the loops
        stiffness, _ = elastic_on_diagonal(tree)
        self.steps = steps_of(metre_scales(system), size_of(system.mechanism), stiffness)
        self.system = system
        sample = self._sample()
        self.differences = [difference.thinned(sample) if difference.acts else None for difference in differences]

    def walks(self) -> list[Walk]:
        """Legs that were walked over."""
        t = self.solution.t
        ends = [0, *(np.flatnonzero(np.diff(t) == 0) + 1).tolist(), len(t)]
        whole = legs(self.system, (float(t[0]), float(t[-1])))
        return [Walk(first, end, leg) for first, end, leg in zip(ends[:-1], ends[1:], whole, strict=False)]

    def at(self, walk: Walk, first: int, end: int) -> Linear:
        """Of some knots of a leg."""
        knots, none = self._knots(walk, np.arange(first, end)), np.zeros((end - first, self.system.size))
        forces = [none if one is None else one.of(lambda variant: variant.forces(knots)) for one in self.differences]
        return Linear(tangents(self.system.compiled, knots, self.steps), np.stack(forces, axis=2))

    def _knots(self, walk: Walk, rows: IntArray) -> Knots:
        """Some of a leg, at the times at which forces were asked for."""
        s = self.solution
        return Knots(np.clip(s.t[rows], walk.leg.first, walk.leg.last), s.y[rows], s.v[rows], s.a[rows])

    def _sample(self) -> Knots:
        """Some of every leg."""
        walks = self.walks()
        each = max(3, _SAMPLE // len(walks))
        rows = [np.unique(np.linspace(walk.first, walk.end - 1, each).astype(int)) for walk in walks]
        parts = [self._knots(walk, some) for walk, some in zip(walks, rows, strict=True)]
        return Knots(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

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
    s = run.solution
    n, count = s.y.shape[1], len(differences)
    result = np.zeros((len(s.t), 3, n, count))
    if not n:  # every motion is prescribed, and no link deforms
        return result
    equations = Equations(run, differences)
    state = np.zeros((4, n, count))  # of y, v, a and α
    state[:2] = start_derivatives(run, differences)
    for walk in equations.walks():
        begun = equations.at(walk, walk.first, walk.first + 1)
        state[2] = _accelerations(begun, state)
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


def _accelerations(begun: Linear, state: Array) -> Array:
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
