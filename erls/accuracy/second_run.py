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
from erls.accuracy.judged_places import judged_places
from erls.auto.outputs import Watched
from erls.equations.substructures import solved
from erls.errors import Cause
from erls.integrate.base import Solution, StopRun, hermite
from erls.integrate.choice import integrator, options_of
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

LARGER = 8.0
"""Tolerance of the second run, of that of the first; where that tells nothing, so much smaller."""

_SHARE = 1.2  # of the distance
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
    found = _second(run, LARGER)
    if found is None or found.work.steps > _LIKE * run.solution.work.steps:
        found = _second(run, 1 / LARGER) or found
    if found is None:
        return None
    formulation, own = solved(run.formulation), run.solution
    looks = run.looks(_PLACES)
    states = [hermite(s.t, s.y, s.v, s.a, looks) for s in (own, found)]
    here, there = (judged_places(formulation, watched, looks, *at) for at in states)
    apart = np.linalg.norm(here - there, axis=-1).max(axis=1, initial=0.0)
    few = np.unique(np.linspace(0, len(looks) - 1, _FORCES).astype(int))
    (y, v), (other_y, other_v) = states
    known = force_differences(run.formulation, looks[few], (y[few], v[few]), (other_y[few], other_v[few]))
    effort = reaction = np.full(len(run.joint_names), np.nan)
    if known is not None:
        effort, reaction = known.relative(_SHARE * known.apart.max(axis=1, initial=0.0))
    return SecondRun(looks, _SHARE * np.maximum.accumulate(apart), effort, reaction)


def _second(run: ChainRun, times: float) -> Solution | None:
    """A run at so many times the tolerance; None where it fails."""
    settings, formulation = run.scene.record.simulation, solved(run.formulation)
    given = options_of(settings)
    changed = replace(
        given,
        tolerance=times * given.tolerance,
        rtol=float(np.clip(times * given.rtol, 3e-14, 0.1)),
        atol=times * given.atol,
        output_step=None,
    )
    y, v = formulation.initial_state()
    span = float(run.solution.t[0]), run.end
    most = _MOST * run.solution.work.rhs_calls

    def limit(t: float, knots: Callable[[], Solution]) -> None:
        if knots().work.rhs_calls > most:
            raise StopRun

    found = integrator(formulation.mechanism, settings)(formulation, span, y, v, changed, limit)
    if found.failure is not None and found.failure.cause == Cause.INTERRUPTED:
        raise found.failure
    return found if found.failure is None and found.t[-1] >= run.end else None
