"""Generalized-α over a system in compiled form: the same steps in chunks, with Python in between for the observer."""

from __future__ import annotations

import math
import time

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.integrate.base import Leg
from erls.integrate.driver import Recorder
from erls.integrate.stepping import generalized_alpha as loop
from erls.integrate.stepping.absent import FACTORING
from erls.maths.so3 import Array

_PAUSE = 0.05  # s between looks at the observer and at interrupts
_SINGLE = 32  # first steps of an observed run, each looked at: a short run is seen step by step
_FIRST, _LARGEST = 32, 4096  # steps in one go


class Chunks:
    """Memory of the compiled loop over one run.

    Parameters
    ----------
    system : CompiledSystem
    known, counts : mappings of places in those arrays of the loop to numbers
        What stays the same over the run, and what it starts from.
    metres : (n,) array
        Per unit of each coordinate.
    """

    def __init__(self, system: CompiledSystem, known: dict[int, float], counts: dict[int, int], metres: Array) -> None:
        n = system.size
        self.system = system
        self.known, self.counts = np.zeros(loop.KNOWN), np.zeros(loop.COUNTS, dtype=np.int64)
        self.known[list(known)], self.counts[list(counts)] = list(known.values()), list(counts.values())
        self.factoring = system.factoring or FACTORING
        self.own = np.zeros(self.factoring.size)
        dense = 0 if self.factoring.size else n
        self.state, self.matrices = np.zeros((loop.STATE, n)), np.zeros((4, dense, dense))
        self.state[loop.METRES], self.state[loop.PER_METRE] = metres, 1 / metres
        self.pivots = np.zeros(n, dtype=np.int64)
        self.steps = _FIRST

    def advance(self, leg: Leg, count: int, y: Array, v: Array, a: Array, recorder: Recorder) -> bool:
        """``count`` equal steps over a leg from (y, v) with acceleration ``a``; False when one fails."""
        known, counts, state = self.known, self.counts, self.state
        known[[loop.START, loop.SPAN, loop.LAST, loop.END]] = leg.start, leg.end - leg.start, leg.last, leg.end
        unit = 1 << int(counts[loop.MAX_HALVINGS])
        counts[[loop.AT, loop.TOTAL, loop.UNIT]] = 0, count * unit, unit
        counts[[loop.HALVINGS, loop.SERVED]] = 0
        for row, start in ((loop.Y, y), (loop.V, v), (loop.ACC, a), (loop.ALG, a)):
            state[row] = start
        state[[loop.CHANGE, loop.GUESS]] = 0.0
        functions = self.system.residual, self.system.mass_matrix, self.system.stiffness_and_damping
        own = self.factoring.factor, self.factoring.solve
        while counts[loop.AT] < counts[loop.TOTAL]:
            size = 1 if recorder.observed and recorder.steps < _SINGLE else self.steps
            times, knots = np.empty(size), np.empty((size, 3, self.system.size))
            begun = time.perf_counter()
            made = loop.advance(
                *functions,
                *own,
                self.system.reals,
                self.system.integers,
                self.system.scratch,
                self.own,
                known,
                counts,
                state,
                self.matrices,
                self.pivots,
                times,
                knots,
            )
            spent = time.perf_counter() - begun
            failed, made = made < 0, made if made >= 0 else -1 - made
            self.steps = max(1, min(4 * size, _LARGEST, math.ceil(_PAUSE * size / max(spent, 1e-6))))
            work = recorder.work
            work.rhs_calls += int(counts[loop.RHS_CALLS])
            work.newton_iterations += int(counts[loop.ITERATIONS])
            work.factorizations += int(counts[loop.FACTORIZATIONS])
            work.rejected_steps += int(counts[loop.REJECTED])
            counts[[loop.RHS_CALLS, loop.ITERATIONS, loop.FACTORIZATIONS, loop.REJECTED]] = 0
            recorder.extend(times[:made], knots[:made])
            if failed:
                return False
        return True
