"""Other equations, or other options, over the time of a run, and how far its points are from theirs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from erls.accuracy.judged_places import judged_places
from erls.auto.outputs import Watched
from erls.equations.formulation import Formulation
from erls.equations.substructures import solved
from erls.errors import Cause
from erls.integrate.base import Options, Solution, StopRun, hermite
from erls.integrate.choice import integrator
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

_PLACES = 60
_MOST = 4  # times the evaluations of the run that another one may take


def other_run(
    run: ChainRun, formulation: Formulation, options: Options, most: float = 0.0, **more: Any
) -> Solution | None:
    """Integrate other equations, or with other options, over the time of a run; None where that fails, or takes more
    than `_MOST` times its evaluations and than ``most``; ``more`` goes to what integrates.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    most = max(most, _MOST * run.solution.work.rhs_calls)

    def limit(t: float, knots: Callable[[], Solution]) -> None:
        if knots().work.rhs_calls > most:
            raise StopRun

    integrate = integrator(formulation.mechanism, run.scene.record.simulation)
    times = float(run.solution.t[0]), run.end
    found = integrate(formulation, times, *formulation.initial_state(), options, limit, **more)
    if found.failure is not None and found.failure.cause == Cause.INTERRUPTED:
        raise found.failure
    return found if found.failure is None and found.t[-1] >= run.end else None


def distance_from(
    run: ChainRun, watched: Watched, formulation: Formulation, other: Solution
) -> tuple[Array, Array]:
    """Times (k,) [s], and how far any judged point of a run and of other equations were apart up to each [m]."""
    looks, own = run.looks(_PLACES), run.solution
    here, there = (
        judged_places(of, watched, looks, *hermite(s.t, s.y, s.v, s.a, looks))
        for of, s in ((solved(run.formulation), own), (formulation, other))
    )
    return looks, np.maximum.accumulate(np.linalg.norm(here - there, axis=-1).max(axis=1, initial=0.0))
