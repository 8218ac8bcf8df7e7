"""The error of an integration from a second run at a larger tolerance: where the error equation cannot be followed.

Errors grow with the tolerance, about as its power 0.6 to 1, but not where vibrations that either run does not resolve
decide: over 39 random and shipped scenes the run was off by 0.27 of the distance between the two in the median, by more
than 0.9 in one of ten, which `_SHARE` is set by.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.auto.outputs import Watched
from erls.equations.serial.state_series import state_series
from erls.errors import Cause
from erls.integrate.base import hermite
from erls.integrate.choice import integrator, options_of
from erls.maths.so3 import Array
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun

LARGER = 8.0
"""Tolerance of the second run, of that of the first."""

_SHARE = 1.2  # of the distance
_PLACES = 60


def second_run_error(run: ChainRun, watched: Watched) -> tuple[Array, Array] | None:
    """(k,) times [s] and largest error of a point up to each [m]; None where the second run fails.

    Parameters
    ----------
    run : ChainRun
        Whose steps follow a tolerance.
    watched : tuple of (int, int)
        Link and node of each judged point.
    """
    settings, formulation = run.scene.record.simulation, run.formulation
    given = options_of(settings)
    larger = replace(
        given,
        tolerance=LARGER * given.tolerance,
        rtol=min(LARGER * given.rtol, 0.1),
        atol=LARGER * given.atol,
        output_step=None,
    )
    times = float(run.solution.t[0]), run.end
    y, v = formulation.initial_state()
    found = integrator(formulation.mechanism, settings)(formulation, times, y, v, larger, None)
    if found.failure is not None:
        if found.failure.cause == Cause.INTERRUPTED:
            raise found.failure
        return None
    looks = run.looks(_PLACES)
    own = run.series(looks)
    other = state_series(formulation, looks, *hermite(found.t, found.y, found.v, found.a, looks))
    apart = np.zeros(len(looks))
    for link, node in watched:
        places = [node_positions(formulation.mechanism, s, link, np.array([node]))[..., 0, :] for s in (own, other)]
        apart = np.maximum(apart, np.linalg.norm(places[0] - places[1], axis=-1))
    return looks, _SHARE * np.maximum.accumulate(apart)
