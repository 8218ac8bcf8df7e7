"""The error of an integration from a second run: where the error equation cannot be followed.

Errors grow with the tolerance, about as its power 0.6 to 1, but not where vibrations that either run does not resolve
decide: over 39 random and shipped scenes the run was off by 0.27 of the distance between the two in the median, by more
than 0.9 in one of ten, which `_SHARE` is set by. Where a larger tolerance ends the run early, or takes the same steps,
the second run is the better one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from erls.accuracy.force_errors import force_differences
from erls.accuracy.integration import ITERATED
from erls.accuracy.judged_places import judged_places
from erls.auto.outputs import Watched
from erls.equations.formulation import Formulation
from erls.equations.substructures import solved
from erls.errors import Cause
from erls.integrate.base import Options, Solution, StopRun, hermite
from erls.integrate.choice import integrator, options_of
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

LARGER = 8.0
"""Tolerance of the second run, of that of the first; where that tells nothing, so much smaller."""

_SHARE, _SHARE_SMALLER = 1.2, 2.0  # of the distance; of a better run, which still errs where friction decides
_PLACES, _FORCES = 60, 8
_LIKE = 0.95  # steps of a run at a larger tolerance, of those of the run: as many are the same ones
_MOST = 4  # times the evaluations of the run that a second one may take


@dataclass(frozen=True)
class SecondRun:
    """What a second run tells.

    Attributes
    ----------
    times : (k,) array
        [s]
    error : (k,) array
        Largest error of a point up to each time [m].
    effort, reaction : (joints,) arrays
        Relative to the peak of each; NaN where they are not known.
    """

    times: Array
    error: Array
    effort: Array
    reaction: Array


def second_run_error(run: ChainRun, watched: Watched) -> SecondRun | None:
    """Estimate it; None where second runs fail.

    Parameters
    ----------
    run : ChainRun
        Whose steps follow a tolerance.
    watched : tuple of (int, int)
        Link and node of each judged point.
    """
    found, share = _second(run, LARGER), _SHARE
    if found is None or found.work.steps > _LIKE * run.solution.work.steps:
        better = _second(run, 1 / LARGER)
        found, share = (found, _SHARE) if better is None else (better, _SHARE_SMALLER)
    if found is None:
        return None
    own, formulation = run.solution, solved(run.formulation)
    looks, apart = distance_from(run, watched, formulation, found)
    few = looks[np.unique(np.linspace(0, len(looks) - 1, _FORCES).astype(int))]
    (y, v), (other_y, other_v) = (hermite(s.t, s.y, s.v, s.a, few) for s in (own, found))
    known = force_differences(run.formulation, few, (y, v), (other_y, other_v))
    effort = reaction = np.full(len(run.joint_names), np.nan)
    if known is not None:
        effort, reaction = known.relative(share * known.apart.max(axis=1, initial=0.0))
    aim = options_of(run.scene.record.simulation).tolerance
    return SecondRun(looks, share * apart + ITERATED * aim, effort, reaction)


def _second(run: ChainRun, times: float) -> Solution | None:
    """A run at so many times the tolerance; None where it fails."""
    given = options_of(run.scene.record.simulation)
    changed = replace(
        given,
        tolerance=times * given.tolerance,
        rtol=float(np.clip(times * given.rtol, 3e-14, 0.1)),
        atol=times * given.atol,
        output_step=None,
    )
    return other_run(run, solved(run.formulation), changed)


def other_run(run: ChainRun, formulation: Formulation, options: Options) -> Solution | None:
    """Integrate other equations, or with other options, over the time of a run; None where that fails, or takes much
    longer.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    most = _MOST * run.solution.work.rhs_calls

    def limit(t: float, knots: Callable[[], Solution]) -> None:
        if knots().work.rhs_calls > most:
            raise StopRun

    integrate = integrator(formulation.mechanism, run.scene.record.simulation)
    found = integrate(formulation, (float(run.solution.t[0]), run.end), *formulation.initial_state(), options, limit)
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
