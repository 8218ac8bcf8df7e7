"""What an integrator says of its own work: warnings from its first step on, and the method that it chose."""

from __future__ import annotations

from erls.integrate.base import Solution
from erls.run.watches.base import NOTHING, Ended, Finding, Knots, Watch


class Integration(Watch):
    """Passes on what stands in a `Solution`."""

    of_bodies = True

    def __init__(self) -> None:
        self._first = True

    def during(self, t: float, knots: Knots) -> Finding:
        """Warnings about the start, while there is time to stop a long run."""
        if not self._first:
            return NOTHING
        self._first = False
        return Finding(knots().warnings)

    def ends(self, solution: Solution) -> Finding:
        """The choice of ``auto``."""
        return Finding(notes=(f"integrator: {solution.choice}",)) if solution.choice else NOTHING

    def after(self, ended: Ended) -> Finding:
        """All warnings."""
        solution = ended.run.solution
        return Finding((*solution.warnings, *solution.halved.warnings))
