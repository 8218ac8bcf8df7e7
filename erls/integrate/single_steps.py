"""Generalized-α one step at a time, for whoever decides on the way: the steps of runs, without their record."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from erls.equations.consistency import consistent_acceleration, consistent_start, refuse_redundant
from erls.equations.formulation import Formulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.system import SecondOrderSystem
from erls.errors import SimulationError
from erls.integrate.alpha_rules import Limit
from erls.integrate.alpha_steps import Steps, equal_steps
from erls.integrate.base import Leg, Options
from erls.integrate.closed_loops import TiedCoordinates, tied_options
from erls.integrate.driver import Recorder, not_finite
from erls.integrate.generalized_alpha import steps_of
from erls.integrate.lie_generalized_alpha import steps_of as tied_steps
from erls.integrate.memory import Memory
from erls.integrate.stepping.alpha_memory import DONE
from erls.maths.so3 import Array

_SAME = 1e-9  # of a step: what rounding of times leaves


class Latest(Recorder):
    """A recorder that keeps nothing: steps hold the last knot themselves."""

    def __init__(self, size: int) -> None:
        super().__init__(size, None, 1)
        self.release()

    def extend(self, t: Array, knots: Array, steps: int | None = None, beside: Array | None = None) -> None:
        """Nothing."""


class SingleSteps:
    """Steps of a formulation in independent coordinates, whose loops may be closed.

    Parameters
    ----------
    formulation : Formulation
    options : Options

    Attributes
    ----------
    recorder : Latest
        It knows the work, and which steps were halved.
    """

    def __init__(self, formulation: Formulation, options: Options) -> None:
        self.recorder = Latest(formulation.size)
        self._system: SecondOrderSystem = cast(Any, formulation)
        self._tied: TiedCoordinates | None = None
        self._steps: Steps | None = None  # where every motion is prescribed and no link deforms
        if not formulation.size:
            return
        if isinstance(formulation, ClosedChain) and len(formulation.kept):
            self._tied = TiedCoordinates(formulation)
            self._steps = tied_steps(self._tied, tied_options(options), self.recorder, formulation.size)
        else:
            self._steps = steps_of(self._system, options, self.recorder)

    def begin(self, t: float, y: Array, v: Array, first: bool) -> None:
        """Stand at a state, with accelerations that go with it; ``first``: loops that it leaves open are closed.

        Raises
        ------
        SimulationError
        """
        if self._steps is None:
            return
        if self._tied is None:
            a = self._system.acceleration(t, y, v)
        else:
            if first:
                refuse_redundant(self._tied, t, y)
                y, v = consistent_start(self._tied, t, y, v, self.recorder.warnings)
            a = np.concatenate(consistent_acceleration(self._tied, t, y, v))
        if not np.isfinite(a).all():
            raise not_finite(t, a)
        self._steps.begin(y, v, a)
        if self._steps.h:
            self._steps.set_step(self._steps.h)  # which foretells nothing from before

    def advance(self, leg: Leg) -> None:
        """One step over a leg; where Newton's method fails, in parts, all of them or none.

        Raises
        ------
        SimulationError
            NEWTON_FAILED, or what the system says of a state that it refuses.
        """
        steps, h = self._steps, leg.end - leg.start
        if steps is None:
            return
        if abs(steps.h - h) > _SAME * h:
            steps.set_step(h)
        if steps.stretch(np.array([leg.end]), leg.last, Limit())[1] == DONE:
            return
        before = self.memory()
        try:
            equal_steps(steps, leg, h, True, self.recorder)
        except SimulationError:
            self.restore(before)
            steps.h = 0.0  # of which no factors are known: those that there are belong to what failed
            raise

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """(n,) coordinates, rates and accelerations, copies."""
        if self._steps is None:
            return np.zeros(0), np.zeros(0), np.zeros(0)
        y, v = self._steps.end()
        return y, v, self._steps.accelerations[: len(v)]

    def memory(self) -> Memory:
        """Copies of all that the next step depends on."""
        return {} if self._steps is None else {name: np.array(x) for name, x in self._steps.memory().items()}

    def restore(self, memory: Memory) -> None:
        """Stand where a memory was taken."""
        if self._steps is not None:
            self._steps.restore(memory)
