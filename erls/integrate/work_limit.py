"""An observer that ends an integration which takes more than it may."""

from __future__ import annotations

import math
from collections.abc import Callable

from erls.integrate.base import Observer, Solution, StopRun


def work_limit(evaluations: float = math.inf, steps: float = math.inf, refused: float = math.inf) -> Observer:
    """End it, with no failure, at the first look that finds more.

    Parameters
    ----------
    evaluations : float
        Of the equations.
    steps, refused : float
        Steps taken, and steps that were refused.
    """

    def limit(t: float, knots: Callable[[], Solution]) -> None:
        work = knots().work
        if work.rhs_calls > evaluations or work.steps > steps or work.rejected_steps > refused:
            raise StopRun

    return limit
