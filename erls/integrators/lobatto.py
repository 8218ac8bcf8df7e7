"""Lobatto IIIA collocation: implicit, order 4 or 6, adaptive steps, no numerical damping.
"""

from __future__ import annotations

import math
import time
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from erls.errors import Cause, SimulationError
from erls.integrators.base import Array, Integrator, Leg, Observer, Options, SecondOrderSystem, Solution, metre_scales
from erls.integrators.driver import Recorder, integrate_legs, not_finite

if TYPE_CHECKING:
    from erls.kernels.contract import CompiledSystem

_ROUNDING = 16 * np.finfo(float).eps
_PAUSE = 0.05  # s between looks at the observer and at interrupts
NODES = {4: (0.0, 0.5, 1.0), 6: (0.0, 0.5 - 0.05**0.5, 0.5 + 0.05**0.5, 1.0)}
DIFFERENCE={4: 1/90., 6: 1/90.}
GOAL = 0.01


@cache
def tableau(order: int) -> tuple[Array, Array, Array]:
    """Nodes (s,), weights of accelerations in h-scaled velocities (s, s) and in h²-scaled positions (s, s)."""
    nodes = np.array(NODES[order])
    powers = np.vander(nodes, increasing=True)
    counts = np.arange(1, len(nodes) + 1)
    rates = (nodes[:, None] * powers / counts) @ np.linalg.inv(powers)
    return nodes, rates, rates @ rates


def lobatto(order: int) -> Integrator:
    def integrate(
        system: SecondOrderSystem,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        recorder = Recorder(system.size, observer)
        run = _Run(order, system, times, options, recorder)
        return integrate_legs(system, times, y, v, recorder, run.advance)

    integrate.__name__ = f"lobatto{order}"
    return integrate


class _Run:
    """Memory of the loop over one run."""

    def __init__(
        self, order: int, system: SecondOrderSystem, times: tuple[float, float], options: Options, recorder: Recorder
    ) -> None:
        from erls.integrators.uncompiled import uncompiled
        from erls.kernels.stepping import lobatto as loop  # here: it imports the compiler

        self.loop, self.work, n = loop, recorder.work, system.size
        compiled: CompiledSystem | None = getattr(system, "compiled", None) if n else None
        self.system = compiled or uncompiled(system)
        self.advance_loop = loop.advance if compiled else getattr(loop.advance, "py_func", loop.advance)
        nodes, rates, places = tableau(order)
        m = len(nodes) - 1
        values, vectors = np.linalg.eig(rates[1:, 1:])
        inverse = np.linalg.inv(vectors)
        values = np.where(abs(values.imag) < 1e-9, values.real, values)
        kept = np.flatnonzero(values.imag > -1e-9)
        weights = np.where(values[kept].imag > 1e-9, 2.0, 1.0)  # conjugates count with their partners
        self.coefficients = np.zeros((loop.ROWS + 1, 4, 4))
        c = self.coefficients
        c[loop.RATES, : m + 1, : m + 1], c[loop.PLACES, : m + 1, : m + 1] = rates, places
        for k, pick in enumerate(kept):
            c[loop.FROM_RE, k, :m], c[loop.FROM_IM, k, :m] = inverse[pick].real, inverse[pick].imag
            to = weights[k] * vectors[:, pick]
            c[loop.TO_RE, :m, k], c[loop.TO_IM, :m, k] = to.real, to.imag
            c[loop.ROWS, loop.LAMBDA_RE, k], c[loop.ROWS, loop.LAMBDA_IM, k] = values[pick].real, values[pick].imag
        c[loop.ROWS, loop.NODES, : m + 1] = nodes
        gaps = nodes[:, None] - nodes + np.eye(m + 1)
        difference = 1 / gaps.prod(axis=1)
        c[loop.ROWS, loop.DIFFERENCE, : m + 1] = DIFFERENCE[order] * difference*math.factorial(m)/4
        self.stages, self.last = np.zeros((m + 1, 3, n)), np.zeros((m + 1, 3, n))
        self.matrices = np.zeros((loop.SOLVERS + 2 * len(kept), n, n))
        self.vectors = np.zeros((loop.RESIDUALS + 2 * m, n))
        self.vectors[loop.METRES] = metre_scales(system)
        self.known, self.counts = np.zeros(loop.KNOWN), np.zeros(loop.COUNTS, dtype=np.int64)
        self.counts[loop.MAX_ITERATIONS], self.counts[loop.REFRESH_COST] = 10, 2
        largest = options.step or (times[1] - times[0]) / 20
        self.known[loop.LARGEST], self.known[loop.TOLERANCE] = largest, options.tolerance
        self.known[loop.GOAL], self.known[loop.ROUNDING] = GOAL * options.tolerance, _ROUNDING
        self.known[loop.NEXT] = min(largest, 1e-4)
        self.known[loop.RATE] = loop.SLOWEST
        self.steps = 1 if compiled is None else 8

    def advance(self, leg: Leg, y: Array, v: Array, a: Array, recorder: Recorder) -> tuple[Array, Array]:
        """Adaptive steps over a leg."""
        loop, known, counts, m = self.loop, self.known, self.counts, len(self.stages) - 1
        known[[loop.START, loop.END, loop.FIRST, loop.LAST]] = leg
        known[loop.T], known[loop.BEFORE] = leg.start, leg.end - leg.start
        known[loop.SMALLEST] = 64 * np.spacing(max(abs(leg.start), abs(leg.end)))
        counts[[loop.FACTORED, loop.HISTORY]] = 0
        self.stages[0] = y, v, a
        self.last[:] = self.stages[0]
        while known[loop.T] < leg.end:
            times, knots = np.empty(self.steps * m), np.empty((self.steps * m, 3, len(y)))
            begun = time.perf_counter()
            made = self.advance_loop(
                self.system.residual,
                self.system.mass_matrix,
                self.system.stiffness_and_damping,
                self.system.reals,
                self.system.integers,
                self.system.scratch,
                known,
                counts,
                self.coefficients,
                self.stages,
                self.last,
                self.matrices,
                self.vectors,
                times,
                knots,
            )
            spent = time.perf_counter() - begun
            failed, made = made < 0, made if made >= 0 else -1 - made
            if self.steps > 1:
                self.steps = max(2, min(2 * self.steps, 4096, math.ceil(_PAUSE * self.steps / max(spent, 1e-6))))
            work = recorder.work
            work.rhs_calls += int(counts[loop.RHS_CALLS])
            work.newton_iterations += int(counts[loop.ITERATIONS])
            work.factorizations += int(counts[loop.FACTORIZATIONS])
            work.rejected_steps += int(counts[loop.REJECTED])
            steps = int(counts[loop.STEPS])
            counts[[loop.RHS_CALLS, loop.ITERATIONS, loop.FACTORIZATIONS, loop.REJECTED, loop.STEPS]] = 0
            recorder.extend(times[:made], knots[:made], steps)
            if failed:
                raise self.failure()
        return self.stages[0, 0].copy(), self.stages[0, 1].copy()

    def failure(self) -> SimulationError:
        """Why no step is small enough."""
        return SimulationError(Cause.STEP_TOO_SMALL, f"reason {self.counts[self.loop.REASON]}")
