"""Steps of Lie-group generalized-α by compiled kernels, many at once, for systems that offer them."""

from __future__ import annotations

import math
import time
from typing import Any, Protocol

import numpy as np

from erls.equations.constrained_system import Configuration, ConstrainedState, ConstrainedSystem
from erls.equations.system import metre_scales
from erls.errors import SimulationError
from erls.integrate.alpha_rules import (
    FASTEST_TRUSTED,
    GROWTH,
    MAX_ITERATIONS,
    ROUNDING,
    SINGULAR,
    SLOWEST_KNOWN,
    Formulas,
    Limit,
    Rules,
    Words,
    newton_failure,
    too_slow,
)
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.constrained_run import ConstrainedRecorder
from erls.maths.so3 import Array
from erls.scene.integrators import MATRICES, STARTS

_PAUSE = 0.05  # s between looks at the observer and at interrupts


class Compiled(Protocol):
    """A system as arrays; see `erls.equations.nodal.compiled.CompiledSteps`."""

    model: Any
    stored: int
    """How many numbers the system stores of a knot."""

    def samples(self, times: Array) -> Array:
        """(times, ...) what depends on time alone."""

    def state(self, known: ConstrainedState, algorithmic: Array) -> Any:
        """A copy as arrays."""

    def configuration(self, state: Any) -> Configuration:
        """The other way."""

    def work(self) -> Any:
        """Memory for steps."""


class CompiledSteps:
    """State and memory of one run, as `erls.integrate.alpha_steps.Steps`."""

    def __init__(
        self,
        system: ConstrainedSystem,
        compiled: Compiled,
        options: ConstrainedOptions,
        rules: Rules,
        recorder: ConstrainedRecorder,
    ) -> None:
        self.rules = rules
        from erls.equations.nodal import contract, matrix, step, sums

        self._kernel, self._functions = step, (sums.forces, matrix.iteration_matrix)
        self._contract = contract
        self.system, self.compiled, self.options, self.recorder = system, compiled, options, recorder
        self.memory = compiled.work()
        self.progress = contract.Progress(np.zeros(6), np.zeros(8, dtype=np.int64))
        self.progress.rates[step.RATE] = SLOWEST_KNOWN
        self.progress.counts[step.USUAL] = MAX_ITERATIONS
        self.h, self.error = 0.0, 0.0
        self.steps = 8
        self.reach = float(metre_scales(system).max(initial=1.0))
        self.state: Any

    def begin(self, q: Configuration, v: Array, a: Array) -> None:
        """Start a leg with acceleration and multipliers."""
        n = self.system.size
        self.state = self.compiled.state(ConstrainedState(q, v, a[:n], a[n:]), a[:n])

    def set_step(self, h: float) -> None:
        """A step that differs only by rounding keeps the matrix."""
        if abs(h - self.h) > 1e-6 * h:
            self.progress.counts[self._kernel.MATRIX] = 0
        if self.h:
            self.state.algorithmic[:] = self.state.a + (self.state.algorithmic - self.state.a) * (h / self.h)
        self.h = h

    def stretch(self, times: Array, last: float, limit: Limit) -> tuple[int, int]:
        """Chunks of steps, of which each takes about `_PAUSE`."""
        kernel, settings = self._kernel, self._settings(limit)
        done, status = 0, kernel.DONE
        while done < len(times) and status == kernel.DONE:
            part = times[done : done + self.steps]
            sizes = self.system.size, self.system.constraints
            knots = self._contract.Knots(
                np.empty((len(part), 3, self.compiled.stored)), *(np.empty((len(part), size)) for size in sizes)
            )
            begun = time.perf_counter()
            samples = self.compiled.samples(np.minimum(part, last))
            status = kernel.advance(
                *self._functions,
                self.compiled.model,
                self.state,
                self.memory,
                settings,
                self.progress,
                samples,
                knots,
                0,
            )
            spent = time.perf_counter() - begun
            made = self._count()
            beside = np.hstack([knots.accelerations, knots.multipliers])
            self.recorder.extend(part[:made], knots.states[:made], beside=beside[:made])
            done += made
            self.steps = max(1, min(2 * self.steps, 4096, math.ceil(_PAUSE * max(made, 1) / max(spent, 1e-6))))
        self.error = float(self.progress.rates[kernel.ERROR])
        return done, status

    def end(self) -> tuple[Configuration, Array]:
        """Configuration and velocity."""
        return self.compiled.configuration(self.state), self.state.v.copy()

    def failure(self, t: float) -> SimulationError:
        """Why the step to ``t`` failed."""
        kernel, rates = self._kernel, self.progress.rates
        slow = too_slow(rates[kernel.BEFORE], rates[kernel.SIZE], rates[kernel.GOAL])
        reason = SINGULAR if self.progress.counts[kernel.REASON] == kernel.SINGULAR else slow
        words = Words(self.system.constraint_names, "there", "a smaller step")
        return newton_failure(words, self.system.size, self.rules, t, self.h, self.memory.correction, reason)

    def _settings(self, limit: Limit) -> Any:
        use, options = Formulas.of(self.rules, self.h), self.options
        return self._contract.Settings(
            **{
                name: getattr(use, name)
                for name in ("h", "beta", "gamma", "share", "pull", "keep", "to_v", "to_a", "tolerance")
            },
            period=use.to_a**-0.5,
            rounding=ROUNDING * self.reach,
            reach=self.reach,
            balance=options.residual_tolerance,
            slowest=SLOWEST_KNOWN,
            fastest=FASTEST_TRUSTED,
            patience=self.rules.patience,
            tolerated=self.rules.tolerated,
            error_limit=limit.error,
            error_factor=use.error,
            growth=GROWTH if limit.can_grow else 0.0,
            mode=MATRICES.index(options.iteration_matrix),
            iterations=MAX_ITERATIONS,
            predict=STARTS.index(options.start_from),
        )

    def _count(self) -> int:
        """Steps made by the last call, whose work is added to that of the run."""
        kernel, counts, work = self._kernel, self.progress.counts, self.recorder.work
        work.rhs_calls += int(counts[kernel.EVALUATIONS])
        work.newton_iterations += int(counts[kernel.ITERATIONS])
        work.factorizations += int(counts[kernel.FACTORIZATIONS])
        counts[[kernel.EVALUATIONS, kernel.ITERATIONS, kernel.FACTORIZATIONS]] = 0
        return int(counts[kernel.STEPS])
