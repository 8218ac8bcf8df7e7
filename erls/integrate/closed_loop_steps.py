"""Steps of generalized-α on coordinates tied by loops, by the kernels of `erls.equations.loops`."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.constrained_system import Configuration
from erls.equations.loops import tree
from erls.equations.loops.closed_chain import OPEN
from erls.equations.loops.closure import closure
from erls.errors import SimulationError
from erls.integrate.base import Leg
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.constrained_run import ConstrainedRecorder
from erls.integrate.lie_formulas import (
    DONE,
    FAILED,
    FASTEST_TRUSTED,
    MAX_ITERATIONS,
    REFRESH_COST,
    ROUNDING,
    SINGULAR,
    SLOWEST_KNOWN,
    TOLERATED,
    Formulas,
    Limit,
    newton_failure,
    too_slow,
)
from erls.integrate.lie_steps import start_of_leg
from erls.integrate.stepping import loops as loop
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops
    from erls.integrate.closed_loops import TiedCoordinates

_PAUSE = 0.05  # s between looks at the observer and at interrupts
_FIRST, _LARGEST = 8, 4096  # steps in one go
_FORMULAS = {
    loop.H: "h",
    loop.BETA: "beta",
    loop.GAMMA: "gamma",
    loop.SHARE: "share",
    loop.PULL: "pull",
    loop.KEEP: "keep",
    loop.TO_V: "to_v",
    loop.TO_A: "to_a",
    loop.PERIOD: "period",
    loop.TOLERANCE: "tolerance",
}


class ClosedSteps:
    """State and memory of one run, as `erls.integrate.lie_formulas.Steps`; a matrix is kept while it serves.

    Parameters
    ----------
    system : TiedCoordinates
    compiled : CompiledLoops
        Its chain.
    options : ConstrainedOptions
    recorder : ConstrainedRecorder
    """

    def __init__(
        self,
        system: TiedCoordinates,
        compiled: CompiledLoops,
        options: ConstrainedOptions,
        recorder: ConstrainedRecorder,
    ) -> None:
        self.system, self.compiled, self.options, self.recorder = system, compiled, options, recorder
        n, whole = system.size, system.size + system.constraints
        self.known, self.counts = np.zeros(loop.KNOWN), np.zeros(loop.COUNTS, dtype=np.int64)
        self.state, self.unknowns = np.zeros((loop.STATE, n)), np.zeros((loop.UNKNOWNS, whole))
        self.matrix, self.pivots = np.zeros((whole, whole)), np.zeros(whole, dtype=np.int64)
        reach = float(system.length_scales.max(initial=1.0))
        settings = {
            loop.ROUNDING: ROUNDING * reach,
            loop.REACH: reach,
            loop.BALANCE: options.residual_tolerance,
            loop.SLOWEST: SLOWEST_KNOWN,
            loop.FASTEST: FASTEST_TRUSTED,
            loop.PATIENCE: REFRESH_COST,
            loop.TOLERATED: TOLERATED,
            loop.GAP: OPEN * system.chain.reach,
            loop.RATE: SLOWEST_KNOWN,
        }
        self.known[list(settings)] = list(settings.values())
        self.counts[[loop.USUAL, loop.MAX_ITERATIONS]] = MAX_ITERATIONS
        self.h, self.error = 0.0, 0.0
        self.steps = _FIRST

    def begin(self, leg: Leg, q: Configuration, v: Array) -> None:
        """Acceleration and multipliers at the start of a leg."""
        start = start_of_leg(self.system, leg, q, v, self.recorder)
        for row, values in ((loop.Y, start.q), (loop.V, start.v), (loop.ACC, start.a), (loop.ALG, start.a)):
            self.state[row] = values

    def set_step(self, h: float) -> None:
        """Formulas for steps of ``h``; a step that differs only by rounding keeps the matrix."""
        if abs(h - self.h) > 1e-6 * h:
            self.counts[loop.FACTORED] = 0
        if self.h:
            acc, alg = self.state[loop.ACC], self.state[loop.ALG]
            alg[:] = acc + (alg - acc) * (h / self.h)
        self.h = h
        formulas = Formulas.of(self.options, h)
        self.known[list(_FORMULAS)] = [getattr(formulas, name) for name in _FORMULAS.values()]

    def stretch(self, times: Array, last: float, limit: Limit) -> tuple[int, int]:
        """Chunks of steps, of which each takes about `_PAUSE`."""
        self.known[loop.LAST] = last
        done, status, compiled = 0, loop.DONE, self.compiled
        while done < len(times) and status == loop.DONE:
            part = np.ascontiguousarray(times[done : done + self.steps])
            knots = np.empty((len(part), 3, self.system.size))
            multipliers = np.empty((len(part), self.system.constraints))
            begun = time.perf_counter()
            status = loop.advance(
                closure,
                tree.forces,
                tree.matrices,
                compiled.reals,
                compiled.integers,
                compiled.scratch,
                self.known,
                self.counts,
                self.state,
                self.unknowns,
                self.matrix,
                self.pivots,
                part,
                knots,
                multipliers,
            )
            spent = time.perf_counter() - begun
            made = self._count()
            self.recorder.extend_with(part[:made], knots[:made], knots[:made, 2], multipliers[:made])
            done += made
            self.steps = max(1, min(2 * self.steps, _LARGEST, math.ceil(_PAUSE * max(made, 1) / max(spent, 1e-6))))
        if status == loop.OPEN:  # it says which
            self.system.stored(float(times[done]), *self.state[[loop.Y1, loop.V1, loop.ACC1]])
        return done, DONE if status == loop.DONE else FAILED

    def end(self) -> tuple[Configuration, Array]:
        """Coordinates and velocity."""
        return self.state[loop.Y].copy(), self.state[loop.V].copy()

    def failure(self, t: float) -> SimulationError:
        """Why the step to ``t`` failed."""
        known = self.known
        slow = too_slow(float(known[loop.BEFORE]), float(known[loop.SIZE]), float(known[loop.GOAL]))
        reason = SINGULAR if self.counts[loop.REASON] == loop.SINGULAR else slow
        return newton_failure(self.system, self.options, t, self.h, self.unknowns[loop.CORRECTION], reason)

    def _count(self) -> int:
        """Steps made by the last call, whose work is added to that of the run."""
        counts, work = self.counts, self.recorder.work
        work.rhs_calls += int(counts[loop.EVALUATIONS])
        work.newton_iterations += int(counts[loop.ITERATIONS])
        work.factorizations += int(counts[loop.FACTORIZATIONS])
        counts[[loop.EVALUATIONS, loop.ITERATIONS, loop.FACTORIZATIONS]] = 0
        return int(counts[loop.STEPS])
