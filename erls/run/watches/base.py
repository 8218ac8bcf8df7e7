"""The contract of a watch: what looks at a run, so that nobody trusts a result beyond the range of its model.

Rules for adding a watch:

1. One file with one subclass of `Watch` (more beside it if it needs them) and one line in
   ``erls/run/watches/registry.py``. Watches look, and are told, in the order of the registry.
2. A run makes an instance of every watch that it concerns (`Watch.concerns`); what a watch remembers from one look to
   the next lies in its attributes.
3. It looks before a run: `Watch.before` at the mechanism, before anything is computed; `Watch.begins` at the equations
   of motion, when they and their start stand.
4. It looks while a run is computed: `Watch.during` whenever the integrator calls its observer (rule 7 of
   `erls.integrate.base`), which may be after each step, so it takes microseconds and asks for knots only where it needs
   them; `Watch.ends` at all knots, once the integrator has come back, whether it failed or not.
5. It looks after a run: `Watch.after` at the run, which may have failed: any number may be infinite or none, and there
   may be one knot.
6. It returns a `Finding`, and raises nothing of its own; an interrupt, or what a caller's progress raises, goes
   through. It never changes what it is given.
7. Warnings say what is wrong, where, by how much, and what to do; each is told once in a run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.registry import TREES
from erls.equations.serial.state_series import StateSeries, state_series
from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.scene.bodies.schema import BodyScene
from erls.scene.chain import Scene
from erls.scene.settings import Simulation

Knots = Callable[[], Solution]
"""Every knot so far, for who asks."""

_LOOKS = 101


class Finding(NamedTuple):
    """What a watch has to say; without arguments, nothing.

    Attributes
    ----------
    warnings : sequence of str
        What the user should know before trusting the run; they stand in the run.
    notes : sequence of str
        What the user may want to know; told, not kept.
    keep : sequence of float
        Of `Watch.during`: times whose knots on either side are to be kept.
    stop : bool
        Of `Watch.during`: whether the run ends here, with nothing wrong.
    failure : SimulationError or None
        Of `Watch.during`: why the run ends here. Of `Watch.ends` and `Watch.after`: what is wrong with it.
    end : float or None
        Of `Watch.ends`: time of the last knot worth keeping, or just before it [s].
    error : float or None
        Of `Watch.after`: estimated error of points that the model itself makes [m].
    """

    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()
    keep: Sequence[float] = ()
    stop: bool = False
    failure: SimulationError | None = None
    end: float | None = None
    error: float | None = None


NOTHING = Finding()


@dataclass(frozen=True)
class Plan:
    """What is to be run: a mechanism, as its scene says; whether anybody asks how far off links are that bend."""

    scene: Scene
    mechanism: Mechanism
    bending: bool = True

    @property
    def settings(self) -> Simulation:
        """Of the simulation."""
        return self.scene.record.simulation

    @property
    def modal(self) -> bool:
        """Whether links are modal models, linear in their own frames."""
        return self.settings.formulation in TREES


@dataclass(frozen=True)
class BodyPlan:
    """The same of a scene of bodies and beams."""

    scene: BodyScene


@dataclass(frozen=True)
class Started:
    """A run of any kind of scene: how long it will be [s]; ``run_of`` makes a run of knots so far.

    One that is resumed was looked at before, up to ``since`` [s].
    """

    duration: float
    run_of: Callable[[Any], Run]
    since: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True)
class Begun(Started):
    """A run of a chain whose equations of motion stand."""

    plan: Plan
    formulation: Formulation


@dataclass(frozen=True)
class Ended:
    """A run that has come to its end, as planned or not."""

    run: ChainRun

    @cached_property
    def seen(self) -> StateSeries:
        """States at about a hundred times along it: some of those that the run holds, where it holds as many."""
        held = self.run.solution
        if len(held.t) < _LOOKS:
            return self.run.series(self.run.looks(_LOOKS))
        some = np.linspace(0, len(held.t) - 1, _LOOKS).astype(np.int64)
        return state_series(self.run.formulation, held.t[some], held.y[some], held.v[some])

    @property
    def meaningless(self) -> bool:
        """Whether links deflected beyond any meaning: what a model says of its own errors then says nothing."""
        return self.run.failure is not None and self.run.failure.cause == Cause.RUNAWAY


class Watch:
    """Looks at a run; what a watch does not override finds nothing.

    Attributes
    ----------
    of_bodies : bool
        Whether it looks at motions of bodies and beams as well: it then asks its runs for nothing but their solution,
        and looks neither before them nor when they begin.
    """

    of_bodies: ClassVar[bool] = False

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Whether there is anything for it to look at in such a run."""
        return True

    def before(self, plan: Plan) -> Finding:
        """At the mechanism, before anything is computed."""
        return NOTHING

    def begins(self, begun: Begun) -> Finding:
        """At the equations of motion and their start."""
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """At what was computed so far, up to ``t``."""
        return NOTHING

    def ends(self, solution: Solution) -> Finding:
        """At all that was computed."""
        return NOTHING

    def after(self, ended: Ended) -> Finding:
        """At the run."""
        return NOTHING
