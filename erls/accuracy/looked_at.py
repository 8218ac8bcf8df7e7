"""What audits look at: the knots of a run, in panels, and the error that they grant it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from erls.accuracy.panels import Panels, panels_of
from erls.equations.erls.formulation import Erls
from erls.equations.ffr.formulation import Ffr
from erls.equations.formulation import Formulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.registry import TREES
from erls.equations.substructures import solved
from erls.equations.system import SecondOrderSystem, metre_scales
from erls.integrate.alpha_rules import Formulas, Rules
from erls.integrate.base import Solution
from erls.integrate.choice import options_of
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.scene.integrators import FIXED_STEP, INTEGRATORS
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.nodal.equations import Nodal

SLACK = 10.0
"""What audits grant beyond the error that a run states: that error is one of points, by norms that integrators take at
the start, and what audits measure gathers those of all coordinates."""

_MOST = 1e-2  # of the mechanism's size: larger errors are those of when things happen, which no audit feels
_GROWTH = 100.0  # of the errors of single steps that SciPy's integrators keep to, until the end of a run
_LEAST = 1e-10  # the same: rounding
_PER_PANELS, _FEWEST, _MOST_PANELS = 120, 3, 12  # panels of which one is looked at
_FEWEST_DEAR, _WORST = 2, 2


def truncation(t: Array, a: Array, spectral_radius: float) -> float:
    """Sum of the local errors of all steps of generalized-α [m], of accelerations (k, c) at the knots [m/s²]."""
    share = Formulas.of(Rules(spectral_radius, 0.0), 1.0).error
    return float(share * (np.diff(t) ** 2 @ np.abs(np.diff(a, axis=0))).max(initial=0.0))


@dataclass(frozen=True)
class LookedAt:
    """A run as audits look at it.

    Attributes
    ----------
    run : ChainRun
    integration : float or None
        Stated error of its integration [m].
    """

    run: ChainRun
    integration: float | None = None

    @cached_property
    def formulation(self) -> Formulation:
        """What was integrated."""
        return solved(self.run.formulation)

    @property
    def nodal(self) -> Nodal | None:
        """The same where its coordinates are frames of nodes."""
        of_modes = self.run.scene.record.simulation.formulation in TREES
        return None if of_modes else cast("Nodal", self.formulation)  # by its name: runs import what they need

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of these equations."""
        return self.formulation.mechanism

    @property
    def solution(self) -> Solution:
        """Its knots."""
        return self.run.solution

    @cached_property
    def panels(self) -> Panels:
        """Of all knots."""
        return panels_of(self.solution.t)

    @cached_property
    def _watched(self) -> tuple[Array, Array, Array, Array]:
        """Metres (c,), and positions, rates and accelerations (k, c), of the coordinates that are looked at: all, or,
        of frames of nodes, their places.
        """
        s = self.solution
        if self.nodal is None:
            return metre_scales(cast(SecondOrderSystem, self.formulation)), s.y, s.v, s.a
        own = (12 * np.arange(self.nodal.system.count)[:, None] + np.arange(3)).ravel()
        y, v, a = (np.ascontiguousarray(x[:, own]) for x in (s.y, s.v, s.a))
        return np.ones(len(own)), y, v, a

    @property
    def metres(self) -> Array:
        """(c,) largest displacement of any point per unit of each watched coordinate."""
        return self._watched[0]

    @property
    def rates(self) -> Array:
        """(k, c) of the watched coordinates."""
        return self._watched[2]

    @cached_property
    def speed(self) -> Array:
        """(k,) largest speed of any coordinate at the knots [m/s]."""
        return np.asarray((np.abs(self.rates) * self.metres).max(axis=1, initial=0.0))

    @cached_property
    def error(self) -> float:
        """Of the integration [m]: as stated; else the tolerance of the scene, or what the method's own formula for the
        truncation of a step adds up to. Loops close what is reported, and so take out errors of the coordinates that
        are integrated and looked at here: of these it is the larger of the two.
        """
        settings, size = self.run.scene.record.simulation, self.mechanism.reach
        options, fixed = options_of(settings), settings.integrator == FIXED_STEP
        steps = fixed and options.step is not None and (self.integration is None or self.loops)
        truncated = self._truncated(settings.spectral_radius) if steps else 0.0
        if self.integration is not None:
            found = max(self.integration, truncated)
        elif steps:
            found = truncated
        elif fixed or INTEGRATORS[settings.integrator].follows_tolerance:
            found = options.tolerance
        else:
            found = _GROWTH * (settings.rtol * size + settings.atol) * self.solution.work.steps
        return float(np.clip(found, _LEAST * size, _MOST * size))

    @property
    def loops(self) -> bool:
        """Whether loops are closed again at each state that is reported."""
        return isinstance(self.formulation, ClosedChain)

    def _truncated(self, spectral_radius: float) -> float:
        return truncation(self.solution.t, self._watched[3] * self.metres, spectral_radius)

    @cached_property
    def drift(self) -> Array:
        """(p, c) how far positions have moved beyond the integral of the rates at the end of each panel [m]."""
        p, y = self.panels, self._watched[1]
        beyond = (y[p.last] - y[p.first] - p.integrals(self.rates)) * self.metres
        return np.asarray(np.cumsum(beyond, axis=0))

    @property
    def dear(self) -> bool:
        """Whether powers at a state take more than an evaluation of the equations."""
        return not isinstance(self.formulation, Erls | Ffr)

    @cached_property
    def even(self) -> IntArray:
        """(e,) panels spread over the run, for what is dear."""
        count = len(self.panels.first)
        few = _FEWEST_DEAR if self.dear else max(_FEWEST, min(count // _PER_PANELS, _MOST_PANELS))
        return np.unique(((np.arange(few) + 0.5) * count / few).astype(np.int64))

    @cached_property
    def picked(self) -> IntArray:
        """(q,) the same, and those over which accelerations are resolved worst."""
        share = np.abs(self.panels.unresolved(self._watched[3])) @ self.metres
        worst = np.argsort(share * self.panels.lengths**2)[-1 if self.dear else -_WORST :]
        return np.unique(np.concatenate([self.even, worst]))
