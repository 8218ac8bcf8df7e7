"""The error of an integration from a second run: where the error equation cannot be followed.

Errors grow with the tolerance, about as its power 0.6 to 1, but not where vibrations that either run does not resolve
decide: over 39 random and shipped scenes the run was off by 0.27 of the distance between the two in the median, by more
than 0.9 in one of ten, which `_SHARE` is set by. Where a larger tolerance ends the run early, or takes the same steps,
the second run is the better one; so it is where joints stick, since a larger tolerance adds switches of its own, where
friction or limits of motors act on rigid mechanisms, which may pass the turn of a joint in steps as large, and where
points touch, much better still: few steps within an impact are off by as much at tolerances that are alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.accuracy.error_over_time import ErrorOverTime
from erls.accuracy.force_errors import force_differences
from erls.accuracy.integration import ITERATED, sudden
from erls.accuracy.other_run import distance_from, other_run
from erls.auto.outputs import Watched
from erls.equations.substructures import solved
from erls.integrate.base import Solution, hermite
from erls.integrate.choice import options_of
from erls.run.chain.run import ChainRun

LARGER = 8.0
"""Tolerance of the second run, of that of the first; where that tells nothing, so much smaller."""

_OF_IMPACTS = 64.0
"""So much smaller is that of the second run where points touch: steps of high order become little shorter by it."""

_SHARE, _SHARE_SUDDEN = 1.2, 2.0  # of the distance; where friction and limits decide, or of a better run, which errs
_FORCES = 8  # instants at which they are compared
LIKE = 0.95  # steps of a run at a larger tolerance, of those of the run: as many are the same ones


def second_run_error(run: ChainRun, watched: Watched) -> ErrorOverTime | None:
    """Estimate it; None where second runs fail.

    Parameters
    ----------
    run : ChainRun
        Whose steps follow a tolerance.
    watched : tuple of (int, int)
        Link and node of each judged point.
    """
    found, share = None, _SHARE_SUDDEN if sudden(run) else _SHARE
    mechanism, enough = run.formulation.mechanism, LIKE * run.solution.work.steps
    rigid = not any(link.elastic_modes for link in mechanism.links)
    larger = not (mechanism.sticks or mechanism.touches or (rigid and sudden(run)))
    if larger:
        found = run_at(run, LARGER, enough)
    if found is None or found.work.steps > enough:
        better = run_at(run, 1 / (_OF_IMPACTS if mechanism.touches else LARGER))
        if better is not None:
            found, share = better, _SHARE_SUDDEN
        elif larger:
            found, share = found or run_at(run, LARGER), _SHARE
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
    return ErrorOverTime(looks, share * apart + ITERATED * aim, effort, reaction)


def run_at(run: ChainRun, times: float, steps: float = np.inf) -> Solution | None:
    """A second run at so many times the tolerance; None where it fails, or takes more ``steps``."""
    given = options_of(run.scene.record.simulation)
    changed = replace(
        given,
        tolerance=times * given.tolerance,
        rtol=float(np.clip(times * given.rtol, 3e-14, 0.1)),
        atol=times * given.atol,
        output_step=None,
    )
    return other_run(run, solved(run.formulation), changed, steps=steps)
