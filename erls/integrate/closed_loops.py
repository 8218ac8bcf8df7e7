"""Integration of chains with loops: constrained coordinates for generalized-α, decaying errors for the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.tied import OPEN
from erls.equations.system import SecondOrderSystem
from erls.errors import Cause, SimulationError
from erls.integrate.base import Integrator, Observer, Options, Solution
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.integrate.memory import time_of
from erls.integrate.registry import integrator_named
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.stepped import Stepped

NEAR = 0.05  # of the smallest singular value at the start: a run that fails nearer than this to a dead point died of it
AT = 1e-3  # of the same: adaptive steps would shrink for ever
_ITS_OWN = (Cause.INTERRUPTED, Cause.OUT_OF_MEMORY, Cause.SINGULAR_MASS, Cause.RUNAWAY)


class TiedCoordinates:
    """The coordinates of a chain with the conditions of its loops; a `ConstrainedSystem`."""

    def __init__(self, chain: ClosedChain) -> None:
        self.chain, self.kept = chain, chain.kept
        self.size, self.constraints = chain.size, len(chain.kept)
        self.constraint_names = tuple(chain.rows.names[k] for k in chain.kept)
        self.length_scales, self.breakpoints = chain.metres, chain.breakpoints
        self._still = np.zeros(chain.size)

    def compose(self, q: Array, increment: Array) -> Array:
        """q + increment."""
        return q + increment

    def tangent(self, increment: Array) -> None:
        """The identity."""
        return None

    def residual(self, t: float, q: Array, v: Array, a: Array) -> Array:
        """(n,) of the chain."""
        return self.chain.loops.forces(t, q, v, a)

    def mass_matrix(self, t: float, q: Array) -> Array:
        """(n, n) of the chain."""
        return self.chain.loops.masses(t, q)

    def stiffness_and_damping(self, t: float, q: Array, v: Array, a: Array, multipliers: Array) -> tuple[Array, Array]:
        """Those of the chain."""
        return self.chain.loops.matrices(t, q, v)

    def constraint(self, t: float, q: Array) -> Array:
        """(m,) Φ."""
        return np.asarray(self.chain.closure(t, q, self._still).violation[self.kept])

    def constraint_matrix(self, t: float, q: Array) -> Array:
        """(m, n) Φ_y."""
        return np.asarray(self.chain.closure(t, q, self._still).rows[self.kept][:, self.chain.bare.free])

    def constraint_rate(self, t: float, q: Array) -> Array:
        """(m,) Φ_t."""
        return np.asarray(self.chain.closure(t, q, self._still).rate[self.kept])

    def constraint_bias(self, t: float, q: Array, v: Array) -> Array:
        """(m,) Φ̈ at zero accelerations."""
        return np.asarray(self.chain.closure(t, q, v).bias[self.kept])

    def stored(self, t: float, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """The coordinates themselves.

        Raises
        ------
        SimulationError
            LOOP_OPEN: a condition left out as redundant is violated.
        """
        self._refuse_open(t, q, v)
        return q, v, a

    def places(self, stored: Array) -> Array:
        """(k, n, 1) coordinates in metres."""
        return (stored * self.length_scales)[..., None]

    @property
    def compiled(self) -> Stepped:
        """By kernels."""
        from erls.equations.loops.steps import stepped  # here: it imports the compiler

        return stepped(self.chain.loops, self._refuse_open)

    def _refuse_open(self, t: float, q: Array, v: Array) -> None:
        self.chain.refuse_open(t, self.chain.closure(t, q, v))


def tied_options(options: Options) -> ConstrainedOptions:
    """The same for constrained coordinates."""
    return ConstrainedOptions(
        options.step,
        options.rtol,
        options.atol,
        options.spectral_radius,
        options.newton_tolerance,
        output_step=options.output_step,
        keeper=options.keeper,
    )


def loop_integrator(name: str) -> Integrator:
    """The integrator of that name for a `ClosedChain`; failures near a dead point name the loop."""

    def integrate(
        system: SecondOrderSystem,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        assert isinstance(system, ClosedChain)
        solution: Solution
        if name == "generalized_alpha" and len(system.kept):
            solution = lie_generalized_alpha(TiedCoordinates(system), times, y, v, tied_options(options), observer)
        else:
            watch = Watch(system, observer, time_of(options.keeper))
            solution = integrator_named(name)(system, times, y, v, options, watch)
            if solution.failure is not None and solution.failure.cause == Cause.LOOP_OPEN:
                solution = _first(solution, watch.good)
        failure = solution.failure
        if failure is None or failure.cause in _ITS_OWN:
            return solution
        return replace(solution, failure=_dead_point(system, solution) or failure)

    return integrate


class Watch:
    """An observer that refuses steps at which a loop has come apart or locks; within a step a trial may.

    Parameters
    ----------
    chain : ClosedChain
    observer : callable or None
        Told of what is not refused.
    since : float or None
        Time up to which a run that goes on was looked at.
    """

    def __init__(self, chain: ClosedChain, observer: Observer | None, since: float | None = None) -> None:
        self.chain, self.observer = chain, observer
        self.good = -np.inf if since is None else since
        """Time of the first knot that was refused, or of the last one that was looked at."""

    def __call__(self, t: float, knots: Callable[[], Solution]) -> Sequence[float] | None:
        found = knots()
        suspects, last = self._suspects(found), float(found.t[-1])
        for k in suspects:
            self.good = float(found.t[k])
            try:
                self._refuse(self.good, found.y[k], found.v[k])
            except SimulationError as problem:
                problem.whole = (self.good,)
                raise
        self.good = last
        return None if self.observer is None else self.observer(t, knots)

    def _suspects(self, found: Solution) -> list[int]:
        """Numbers of new knots that are open or lock."""
        chain = self.chain
        first = int(np.searchsorted(found.t, self.good))
        gaps, stiffest = chain.loops.watched(found.t[first:], found.y[first:])
        suspect = (gaps > OPEN * chain.reach) | (stiffest < AT * chain.stiffest_at_start)
        return [first + int(k) for k in np.flatnonzero(suspect)]

    def _refuse(self, t: float, y: Array, v: Array) -> None:
        chain = self.chain
        closure = chain.closure(t, y, v)
        chain.refuse_open(t, closure)
        here = chain.stiffest(closure)
        if here[0] < AT * chain.stiffest_at_start:
            raise chain.locked(t, here)


def _first(solution: Solution, time: float) -> Solution:
    """Less what many steps at once made after a loop came apart or locked."""
    knots = int(np.searchsorted(solution.t, time, side="right"))
    arrays = {name: getattr(solution, name)[:knots] for name in ("t", "y", "v", "a")}
    return replace(solution, **arrays) if knots else solution


def _dead_point(chain: ClosedChain, solution: Solution) -> SimulationError | None:
    """A failed run that ended where a loop locks."""
    t, y, v = float(solution.t[-1]), solution.y[-1], solution.v[-1]
    if not (np.isfinite(y).all() and np.isfinite(v).all()):
        return None
    here = chain.stiffest(chain.closure(t, y, v))
    return chain.locked(t, here) if here[0] < NEAR * chain.stiffest_at_start else None
