"""Steps of generalized-α for an error over the whole run: cheaper runs tell how small they must be.

The error of a run is not the sum of what its steps do wrong: phases drift, disturbances grow or are damped. So a run is
made with few steps first, which follow their local error and tell where the motion needs small ones; then one with
equal steps in stretches of time, and one with four times as many, whose distance (`erls.integrate.step_distance`) tells
their errors. The run itself takes as many more steps in every stretch as bring that error below the tolerance; it keeps
one of its forerunners, whose distance tells its own error.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from erls.equations.constrained_system import ConstrainedSystem
from erls.errors import Cause
from erls.integrate.base import Companion, Observer, Work
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.step_distance import Bands, Track, distance_bands, factor_needed, parted_at, samples, step_ratio
from erls.integrate.step_plans import Plan, finer, plan_like

FINER = 4.0
"""Steps of a run for each of the one that its error is told by, which takes a quarter of its time."""

_FIRST_FINER = 2.5  # of the second forerunner: Newton's method, not accuracy, may have kept the first one's steps small
_GOOD = 1.25  # times as many steps as would be wanted are not worth another run
_LOOSE = 4.0  # local error of the first run, of the tolerance
_LARGEST = 1 / 50  # first steps, of the run
_APART = 2.0  # times as many steps that two runs must have for their distance to tell
_CLOSE = 8.0  # times as many steps as the last forerunner that the run may take
_MOST_UNSEEN = 200_000  # steps of a forerunner, which nobody can watch
_MOST = 16.0  # times as many steps as those of the last forerunner
_LATER = 2.0  # times as late that points part with four times as many steps, where their distance grows as by drift
_TIGHT = 1e-3  # local error of a run whose forerunners failed, of the tolerance
_PROPORTION = 0.2  # more apart than foretold, at the least, where rounding decides
_DOUBT = 3.0  # times what was foretold of the runs before was off by
_POINTS = 12  # that move most


class _Rung(NamedTuple):
    """A run with ``density`` times the steps of the plan."""

    run: ConstrainedSolution
    density: float


class Attempt(Protocol):
    """One run over all legs."""

    def __call__(
        self,
        options: ConstrainedOptions,
        observer: Observer | None = None,
        plan: Plan | None = None,
        known: ConstrainedSolution | None = None,
    ) -> ConstrainedSolution:
        """With the steps of a plan, or those that the options say; or a run that is known, told to the observer."""


def to_tolerance(
    attempt: Attempt,
    system: ConstrainedSystem,
    span: float,
    options: ConstrainedOptions,
    observer: Observer | None,
) -> ConstrainedSolution:
    """Make a run as ``options.tolerance`` asks.

    Parameters
    ----------
    attempt : Attempt
    system : ConstrainedSystem
        Which points tell errors.
    span : float
        Length of the run [s].
    options : ConstrainedOptions
    observer : callable or None
        Of the last run alone, and so is the keeper of ``options``: who resumes makes the forerunners again.
    """
    plain = replace(options, follows_tolerance=False)
    cheap = replace(plain, keeper=None, output_step=None, step=options.step or _LARGEST * span)
    first = attempt(replace(cheap, error_tolerance=_LOOSE * options.tolerance, rough=True))
    plan, made, rungs, factor = plan_like(first.t), [first], list[_Rung](), FINER
    density, parted = 1.0, np.inf
    while plan and made[-1].failure is None:
        rungs.append(_Rung(attempt(cheap, plan=finer(plan, density)), density))
        made.append(rungs[-1].run)
        if len(rungs) > 1 and made[-1].failure is None:
            bands = _distance(system, made[-1], _below(rungs, density).run, options.spectral_radius)
            before, parted = parted, parted_at(bands) - first.t[0]
            if parted < _LATER * before < np.inf:  # disturbances grow: smaller steps put it off, no more
                factor = factor_needed(bands, options.tolerance, FINER, first.t[0] + parted)
                break
            factor = factor_needed(bands, options.tolerance, _MOST)
            if factor <= _CLOSE or FINER * made[-1].work.steps > _MOST_UNSEEN:
                break
        density *= _FIRST_FINER if len(rungs) == 1 else FINER
    failure = made[-1].failure
    if failure is not None and failure.cause == Cause.INTERRUPTED:
        return made[-1]
    if failure is not None or not plan:
        tight = replace(plain, step=cheap.step, error_tolerance=_TIGHT * options.tolerance)
        return _with_work(attempt(tight, observer), made)
    if factor <= _GOOD:
        found = attempt(plain, observer, known=made.pop())
    else:
        density *= factor
        found = attempt(plain, observer, finer(plan, density))
    partner = _below(rungs, density)
    coarser = [rung.run for rung in reversed(rungs) if rung.density <= partner.density]
    beyond = _beyond(system, [found, *coarser], options)
    companion = Companion(partner.run.t, partner.run.y, partner.run.v, partner.run.a, beyond)
    return replace(_with_work(found, made), companion=companion)


def _below(rungs: list[_Rung], density: float) -> _Rung:
    """The last run that has few enough steps to be compared with one of a density."""
    return [rung for rung in rungs if rung.density * _APART <= density][-1]


def _beyond(system: ConstrainedSystem, runs: list[ConstrainedSolution], options: ConstrainedOptions) -> float:
    """What a run and the one before it, first of a list, are more apart than those before foretell [m]; or 0."""
    if len(runs) < 4 or any(run.failure is not None for run in runs):  # two proportions tell whether they hold
        return 0.0
    bands = [_distance(system, fine, coarse, options.spectral_radius) for fine, coarse in pairwise(runs[:4])]
    if np.isfinite([parted_at(found) for found in bands]).any():  # disturbances grow: their size foretells nothing
        return 0.0
    apart = [float(found.slow.max(initial=0.0)) for found in bands]
    pairs = zip(pairwise(bands), apart[1:], strict=True)
    foretold = [size * (1 - near.ratio**-2) / (far.ratio**2 - 1) for (near, far), size in pairs]
    if len(foretold) < 2 or not foretold[1] > 0.0:
        return 0.0
    doubt = max(_PROPORTION, _DOUBT * abs(apart[1] / foretold[1] - 1))
    return apart[0] - foretold[0] if apart[0] > (1 + doubt) * foretold[0] else 0.0


def _distance(
    system: ConstrainedSystem, fine: ConstrainedSolution, coarse: ConstrainedSolution, radius: float
) -> Bands:
    looks = samples(fine.t)
    t, places = fine.t[looks], system.places(fine.y[looks])
    most = np.argsort(np.linalg.norm(np.ptp(places, axis=0), axis=-1))[-_POINTS:]
    other = Track(coarse.t, *(system.places(part)[:, most] for part in (coarse.y, coarse.v, coarse.a)))
    ratio = step_ratio(fine.t, coarse.t)
    return distance_bands(t, places[:, most], other.at(t), fine.work.steps, ratio, radius)


def _with_work(found: ConstrainedSolution, before: list[ConstrainedSolution]) -> ConstrainedSolution:
    """A run with the work of its forerunners, but its own steps."""
    runs = [run.work for run in (*before, found)]
    sums = {name: sum(getattr(w, name) for w in runs) for name in vars(found.work)}
    return replace(found, work=Work(**{**sums, "steps": found.work.steps}))
