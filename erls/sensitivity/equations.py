"""Linearized equations of a run at its knots, a stretch of steps at a time.

With R(t, y, v, a; p) = 0 at every node of a step and the formulas of the method (`erls.sensitivity.schemes`),

    M δa_i + D δv_i + K δy_i + ∂R/∂p = 0

is one linear system for the accelerations of a step, whose factors serve all parameters, and transposed all outputs.
The steps are held: this is the derivative of the discrete scheme, iterated to the end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import lapack

from erls.equations.serial.equilibrium import elastic_on_diagonal
from erls.equations.system import metre_scales
from erls.equations.tangents import Evaluation, Knots, Tangents, steps_of
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg, walked
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.forces import force_derivative
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.variants import Difference
from fe_import.model import IntArray

_ROOM = 2_000_000
"""Numbers of tangents that are held at a time."""

_SAMPLE = 64  # knots at which forces show how they depend on a parameter


class Walk(NamedTuple):
    """A leg of a run: number of its first knot and the one after its last, and its times."""

    first: int
    end: int
    leg: Leg


class Step(NamedTuple):
    """What the methods need of a step of s nodes, both ways.

    Attributes
    ----------
    t : float
        Of its first node [s].
    h : float
        [s]
    rows : slice
        Its nodes among those of the stretch.
    rescaled : array or None
        See `Scheme.rescaled`; None where nothing changes.
    block : (s n, s n) array
        Of the accelerations, overwritten by `solve`.
    damping, stiffness : (s, n, n) arrays
    to_y, to_v, kept, added : arrays
        See `Scheme.history` and `Scheme.moved_on`.
    """

    t: float
    h: float
    rows: slice
    rescaled: Array | None
    block: Array
    damping: Array
    stiffness: Array
    to_y: Array
    to_v: Array
    kept: Array
    added: Array


@dataclass(frozen=True)
class Stretch:
    """Whole steps of a leg, linearized.

    Attributes
    ----------
    first : int
        Number of the first knot, an inner node or the end of the first step.
    h : (j,) array
        Steps [s].
    before : float or None
        The step before the first one, of the same leg.
    knots : Knots
        j s of them.
    tangents : Tangents
    scheme : Scheme
    """

    first: int
    h: Array
    before: float | None
    knots: Knots
    tangents: Tangents
    scheme: Scheme

    @cached_property
    def blocks(self) -> Array:
        """(j, s n, s n) matrices of the accelerations of each step."""
        scheme, (mass, damping, stiffness) = self.scheme, self.tangents
        j, s, n = len(self.h), scheme.count, mass.shape[1]
        damping, stiffness = (x.reshape(j, s, 1, n, n) for x in (damping, stiffness))
        rates = np.multiply.outer(self.h, scheme.rates)[..., None, None]
        places = np.multiply.outer(self.h**2, scheme.places)[..., None, None]
        found = rates * damping + places * stiffness
        for i in range(s):
            found[:, i, i] += mass.reshape(j, s, n, n)[:, i]
        return np.asarray(found.swapaxes(2, 3).reshape(j, s * n, s * n))

    @cached_property
    def history(self) -> tuple[Array, Array]:
        """See `Scheme.history`."""
        return self.scheme.history(self.h)

    @cached_property
    def moved_on(self) -> tuple[Array, Array]:
        """See `Scheme.moved_on`."""
        return self.scheme.moved_on(self.h)

    def step(self, number: int) -> Step:
        """One of them."""
        rows = slice(number * self.scheme.count, (number + 1) * self.scheme.count)
        _, damping, stiffness = self.tangents
        to_y, to_v = (part[number] for part in self.history)
        kept, added = (part[number] for part in self.moved_on)
        t, h, block = float(self.knots.t[rows.start]), float(self.h[number]), self.blocks[number]
        own = damping[rows], stiffness[rows], to_y, to_v, kept, added
        return Step(t, h, rows, self._rescaled(number), block, *own)

    def _rescaled(self, step: int) -> Array | None:
        before = float(self.h[step - 1]) if step else self.before
        found = self.scheme.rescaled(float(self.h[step]), before)
        return None if found[3, 3] == 1 else found


def solve(block: Array, right: Array, transposed: bool, t: float) -> Array:
    """(m, c) solution x of B x = b, or of Bᵀ x = b; the matrix is overwritten.

    Raises
    ------
    SimulationError
        NOT_FINITE: the matrix is singular; ``t`` says when.
    """
    factors, pivots, status = lapack.dgetrf(block.T, overwrite_a=True)  # of the transpose, which lies column by column
    if status:
        raise SimulationError(
            Cause.NOT_FINITE,
            "the motion has no derivative here: the linearized equations of a step are singular",
            where=f"t = {t:.9g} s",
            remedy="look for a coordinate that nothing moves or holds there, or take smaller steps",
        )
    found, _ = lapack.dgetrs(factors, pivots, right, trans=0 if transposed else 1)
    return np.asarray(found)


class Equations:
    """Linearized equations of a run at its knots.

    Parameters
    ----------
    run : ChainRun
    differences : sequence of Difference
        By each parameter.
    scheme : Scheme
        Of the method that made the run.
    moving : SecondOrderSystem, optional
        What that method integrated, where it was not the formulation itself.
    """

    def __init__(
        self, run: ChainRun, differences: Sequence[Difference], scheme: Scheme, moving: Any = None
    ) -> None:
        self.solution, self.scheme = run.solution, scheme
        system: Any = run.formulation
        tree: Any = getattr(system, "bare", system)  # under the loops
        stiffness, _ = elastic_on_diagonal(tree)
        steps = steps_of(metre_scales(system), float(system.mechanism.reach), stiffness)
        self.system = system if moving is None else moving
        self.evaluation = Evaluation.of(self.system.compiled, steps, len(run.solution.t))
        sample = self._sample()
        self.derivatives = [force_derivative(self.system.compiled, one, sample, self.evaluation) for one in differences]

    @cached_property
    def walks(self) -> list[Walk]:
        """Legs that were walked over."""
        return [Walk(*part) for part in walked(self.system, self.solution.t)]

    def stretches(self, walk: Walk, between: tuple[int, int] | None = None) -> list[tuple[int, int]]:
        """First knot of each stretch of whole steps of a leg, or of a part of it, and the one after its last."""
        begun, last = between or (walk.first + 1, walk.end)
        n, nodes = int(self.system.size), self.scheme.count
        some = max(1, _ROOM // (max(3, nodes * nodes) * n * n + 1) // nodes) * nodes
        return [(first, min(first + some, last)) for first in range(begun, last, some)]

    def stretch(self, walk: Walk, first: int, end: int) -> Stretch:
        """Linearized."""
        ends = self.solution.t[first - 1 : end : self.scheme.count]
        h = np.diff(ends)
        earlier = first - 1 - self.scheme.count
        before = float(self.solution.t[first - 1] - self.solution.t[earlier]) if earlier >= walk.first else None
        knots = self.knots(walk, np.arange(first, end))
        return Stretch(first, h, before, knots, self.tangents(knots), self.scheme)

    def tangents(self, knots: Knots) -> Tangents:
        """∂R/∂a, ∂R/∂v, ∂R/∂y."""
        return self.evaluation.tangents(self.system.compiled, knots)

    def forces(self, knots: Knots) -> Array:
        """(k, n, p) ∂R/∂p."""
        found = np.zeros((*knots.y.shape, len(self.derivatives)))
        for k, force in self.each_force(knots):
            found[..., k] = force
        return found

    def each_force(self, knots: Knots) -> Iterator[tuple[int, Array]]:
        """Numbers of the parameters on which forces depend, with (k, n) ∂R/∂p of each."""
        known: dict[int, Array] = {}
        for k, one in enumerate(self.derivatives):
            if one is not None:
                yield k, one.at(knots, self.evaluation, known)

    def knots(self, walk: Walk, rows: IntArray) -> Knots:
        """Some of a leg, at the times at which forces were asked for."""
        s = self.solution
        return Knots(np.clip(s.t[rows], walk.leg.first, walk.leg.last), s.y[rows], s.v[rows], s.a[rows])

    def _sample(self) -> Knots:
        """Some of every leg."""
        each = max(3, _SAMPLE // len(self.walks))
        rows = [np.unique(np.linspace(walk.first, walk.end - 1, each).astype(int)) for walk in self.walks]
        parts = [self.knots(walk, some) for walk, some in zip(self.walks, rows, strict=True)]
        return Knots(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
