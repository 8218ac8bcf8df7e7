"""Lobatto IIIA collocation: implicit, order 6, adaptive steps, no numerical damping.

E. Hairer, G. Wanner, Solving ODEs II (1996), sec. IV.5. The acceleration of a step is a polynomial of degree 3 that
fulfils M(y, t) a = f at the nodes c = 0, ½ ∓ √0.05, 1, with v and y its integrals:

    v_i = v₀ + h Σ A_ij a_j,  y_i = y₀ + c_i h v₀ + h² Σ (A²)_ij a_j

The method is symmetric: vibrations keep their amplitude, whether steps resolve them or not. Node 0 is the end of the
last step, so a step has three unknown stages, and all its nodes become knots. Chord iterations with
(M + λ h C + λ² h² K)⁻¹ for the eigenvalues λ of A, one real, two conjugate, start from the polynomial through the last
step's M a + C v + K y, which is smooth also where vibrations are not resolved.

Error control: with D the third divided difference of the accelerations, scaled to nodes 0 to 1, the error estimate

    e = κ (M + h C + h² K)⁻¹ M h² D

is κ/6 (ωh)⁵/(1 + (ωh)²) times the amplitude of a vibration that the step resolves, and at most 2.6 times that of one
which it does not, whatever its frequency: such a vibration cannot cost more accuracy than its amplitude. A step is
accepted when e in metres is below ``options.tolerance``, which is an aim for the error over the whole run. κ = `WEIGHT`
is fitted to runs of 1.5 to 2 s of an L with 18 and 30 modes and of robots with two and three links, at 1e-3 to 1e-7 m:
there the largest error of the tip came out at 0.3 to 4 times the tolerance. Errors of phase add up, so it grows with
the length of a run: after 6000 rad of a vibration whose amplitude is near the tolerance it was ten times the tolerance.
Joints that stick and slide cost up to five times the tolerance; motors that come to their limits on flexible links,
where small vibrations decide when, up to thirty times, which `erls.integrate.choice` makes up for.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from erls.equations.system import SecondOrderSystem, metre_scales
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg, Observer, Options, Solution
from erls.integrate.driver import Pace, Recorder, integrate_legs, not_finite, recorder_for
from erls.integrate.memory import Memory, flat, recall
from erls.maths.jit import plain
from erls.maths.so3 import Array

NODES = (0.0, 0.5 - 0.05**0.5, 0.5 + 0.05**0.5, 1.0)
WEIGHT = 0.08  # κ
_ITERATED = 3e-4  # of the tolerance: where iterations stop; what they leave of a smooth motion adds up over its steps
_FIRST_STEP = 1e-4  # s, at most
_MAX_ITERATIONS = 10
_REFRESH_COST = 2  # of fresh factors, in iterations
_ROUNDING = 16 * np.finfo(float).eps


def lobatto(
    system: SecondOrderSystem,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None = None,
) -> Solution:
    """Integrate to ``options.tolerance``; ``options.step`` is the largest step (default: a twentieth of the run).

    A system in compiled form runs in a compiled loop, whose observer is called some 20 times per second.
    """
    recorder = recorder_for(system, observer, options)
    if system.size == 0:  # nothing to integrate
        return integrate_legs(system, times, y, v, recorder, None)
    run = _Run(system, times, options, recorder)
    found = integrate_legs(system, times, y, v, recorder, run, options.keeper)
    return replace(found, nodes_per_step=len(NODES) - 1)


@cache
def tableau(nodes: tuple[float, ...] = NODES) -> tuple[Array, Array]:
    """Weights (s, s) of the accelerations at s nodes in the velocities, and in the positions of the nodes."""
    at = np.array(nodes)
    powers = np.vander(at, increasing=True)
    rates = (at[:, None] * powers / np.arange(1, len(at) + 1)) @ np.linalg.inv(powers)
    return rates, rates @ rates


class _Run:
    """A `Method`: memory of the loop (`erls.integrate.stepping.lobatto`) over one run."""

    resumable = True

    def __init__(
        self, system: SecondOrderSystem, times: tuple[float, float], options: Options, recorder: Recorder
    ) -> None:
        from erls.equations.uncompiled import uncompiled  # here: they import the compiler
        from erls.integrate.stepping import lobatto as loop
        from erls.integrate.stepping import stages as at

        self.at, self.recorder, n = at, recorder, system.size
        compiled = system.compiled
        self.system = compiled or uncompiled(system)
        self.step = loop.advance if compiled else plain(loop.advance, within=False)
        self.pace = Pace(recorder, compiled is not None, single=False)
        self.functions, factoring = self.system.functions(), self.system.factoring
        self.mixed = np.zeros(n, dtype=complex)
        self.coefficients = coefficients(NODES)
        self.stages, self.last = np.zeros((4, 3, n)), np.zeros((4, 3, n))
        size, exchanged = (n * n, n) if factoring is None else (factoring.size, 0)
        self.own = np.zeros((3, size)), np.zeros((2, size), dtype=complex), np.zeros((3, exchanged), dtype=np.int64)
        self.matrices = np.zeros((at.MATRICES, n, n))
        self.vectors = np.zeros((at.RESIDUALS + 6, n))
        self.vectors[at.METRES] = metre_scales(system)
        self.known, self.counts = np.zeros(at.KNOWN), np.zeros(at.COUNTS, dtype=np.int64)
        settings = {at.MAX_ITERATIONS: _MAX_ITERATIONS, at.REFRESH_COST: _REFRESH_COST, at.CALM: at.PATIENCE}
        self.counts[list(settings)] = list(settings.values())
        span = times[1] - times[0]
        largest = min(options.step or math.inf, span / 20)
        self.known[[at.LARGEST, at.NEXT]] = largest, min(largest, _FIRST_STEP, 1e-3 * span)
        self.known[[at.TOLERANCE, at.GOAL]] = options.tolerance, _ITERATED * options.tolerance
        self.known[[at.ROUNDING, at.RATE]] = _ROUNDING, at.SLOWEST

    def begin(self, leg: Leg, y: Array, v: Array, a: Array) -> None:
        """Stand at the start of a leg."""
        at, known = self.at, self.known
        known[[at.END, at.FIRST, at.LAST]] = leg.end, leg.first, leg.last
        known[at.T], known[at.BEFORE] = leg.start, leg.end - leg.start
        known[at.SMALLEST] = 64 * np.spacing(max(abs(leg.start), abs(leg.end)))
        self.counts[[at.FACTORED, at.HISTORY]] = 0
        self.stages[0] = y, v, a
        self.last[:] = self.stages[0]

    def finish(self, leg: Leg) -> tuple[Array, Array]:
        """Adaptive steps over the rest of a leg."""
        while self.known[self.at.T] < leg.end:
            if not self.make_steps():
                raise self.failure()
        return self.stages[0, 0].copy(), self.stages[0, 1].copy()

    def memory(self) -> Memory:
        """All that one call of the loop leaves to the next."""
        return {name: flat(array) for name, array in self._arrays()}

    def restore(self, memory: Memory) -> None:
        """As another run left it."""
        for name, array in self._arrays():
            recall(memory, name, array)

    def _arrays(self) -> list[tuple[str, NDArray[Any]]]:
        names = ("known", "counts", "mixed", "stages", "last", "matrices", "vectors")
        own = [(f"factors.{k}", array) for k, array in enumerate(self.own)]
        return [*((f"steps.{name}", getattr(self, name)) for name in names), *own, ("scratch", self.system.scratch)]

    def make_steps(self) -> bool:
        """A chunk of steps; False when no step is small enough to go on."""
        at, system, counts = self.at, self.system, self.counts
        room = 3 * self.pace.size()
        times, knots = np.empty(room), np.empty((room, 3, system.size))
        made = 0
        try:
            with self.pace:
                made = self.step(
                    self.functions,
                    system.reals,
                    system.integers,
                    system.scratch,
                    *self.own,
                    self.mixed,
                    self.known,
                    counts,
                    self.coefficients,
                    self.stages,
                    self.last,
                    self.matrices,
                    self.vectors,
                    times,
                    knots,
                )
        finally:
            work = self.recorder.work
            work.rhs_calls += int(counts[at.RHS_CALLS])
            work.newton_iterations += int(counts[at.ITERATIONS])
            work.factorizations += int(counts[at.FACTORIZATIONS])
            work.rejected_steps += int(counts[at.REJECTED])
            counts[[at.RHS_CALLS, at.ITERATIONS, at.FACTORIZATIONS, at.REJECTED]] = 0
        stored = made if made >= 0 else -1 - made
        self.recorder.extend(times[:stored], knots[:stored], stored // 3)
        return made >= 0

    def failure(self) -> SimulationError:
        """Why no step is small enough."""
        at, known = self.at, self.known
        reason, suspect, t = self.counts[at.REASON], int(self.counts[at.SUSPECT]), float(known[at.T])
        if reason == at.NOT_FINITE and suspect >= 0:
            rows = self.vectors[at.RESIDUALS : at.RESIDUALS + 3]
            return not_finite(t, rows[int(np.argmin(np.isfinite(rows).all(axis=1)))])
        why = {
            at.SINGULAR: "the iteration matrix is singular in",
            at.NOT_FINITE: "Newton's iterations grow without bound, first in",
            at.SLOW: "Newton's method does not converge in",
            at.INACCURATE: "the error of a step is largest in",
        }[int(reason)]
        return SimulationError(
            Cause.STEP_TOO_SMALL,
            f"no step is small enough: {why} coordinate {max(suspect, 0)} (counted from 0)",
            where=f"t = {t:.9g} s",
            value=f"step {known[at.H]:.3g} s",
            limit=f"tolerance {known[at.TOLERANCE]:.3g} m",
            remedy="check forces that act on this coordinate, for jumps without breakpoint and growth without bound "
            "first; then try a larger tolerance, or generalized_alpha",
        )


@cache
def coefficients(nodes: tuple[float, ...]) -> Array:
    """Blocks of coefficients as loops read them (`erls.integrate.stepping.stages`), of collocation at these nodes."""
    from erls.integrate.stepping import stages as at

    rates, places = tableau(nodes)
    stages = len(nodes) - 1
    result = np.zeros((at.ROWS + 1, stages + 1, stages + 1))
    result[at.RATES], result[at.PLACES] = rates, places
    values, vectors = np.linalg.eig(rates[1:, 1:])
    inverse = np.linalg.inv(vectors)
    kept = sorted(np.flatnonzero(values.imag > -1e-9), key=lambda k: float(values[k].imag))
    for row, k in enumerate(kept):
        real = abs(values[k].imag) < 1e-9
        back = vectors[:, k] * (1 if real else 2)  # a conjugate counts with its partner
        result[at.INTO_RE, row, :stages], result[at.INTO_IM, row, :stages] = inverse[k].real, inverse[k].imag
        result[at.BACK_RE, :stages, row], result[at.BACK_IM, :stages, row] = back.real, back.imag
        result[at.ROWS, at.LAMBDA_RE, row] = values[k].real
        result[at.ROWS, at.LAMBDA_IM, row] = 0.0 if real else values[k].imag
    places_of_nodes = np.array(nodes)
    result[at.ROWS, at.NODES] = places_of_nodes
    gaps = places_of_nodes[:, None] - places_of_nodes + np.eye(stages + 1)
    result[at.ROWS, at.DIFFERENCE] = WEIGHT / gaps.prod(axis=1)
    return result
