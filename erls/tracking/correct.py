"""Inversion on a model that only runs forward, such as nodal elements: a quasi-Newton iteration whose steps are those
of the modal inversion.

    y_d⁽ʲ⁺¹⁾ = y_d⁽ʲ⁾ - L (y⁽ʲ⁾ - y_d),    y⁽ʲ⁾: what the model does with the drives that modes need for y_d⁽ʲ⁾

L passes what belongs to the demanded motion alone: at higher frequencies the models differ by all that they are, and
corrections would feed vibrations. What is left falls by how much the models differ, over how far drives of rigid links
would miss.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from erls.errors import SimulationError
from erls.inverse.conditions import Demand
from erls.inverse.internal import second_difference
from erls.inverse.inversion import Inversion
from erls.inverse.work import Work
from erls.maths.so3 import Array
from erls.scene.build import Message
from erls.tracking.confirm import Confirmation, confirmed

_PASSES = 8
_WORTH = 0.8  # of what was missed before: less is no progress


class Corrected(NamedTuple):
    """An inversion, its forward run, and how many corrections it took."""

    inversion: Inversion
    confirmation: Confirmation
    corrections: int


def corrected(
    inversion: Inversion,
    first: Confirmation,
    goal: float,
    tell: Message = lambda text: None,
    told: Callable[[int, float], None] = lambda number, missed: None,
) -> Corrected:
    """Correct an inversion until its forward run misses less than a goal, or corrections do not help.

    Parameters
    ----------
    inversion : Inversion
    first : Confirmation
        Its forward run, in whose formulation the others are made.
    goal : float
        Largest miss [m, and rad of angles].
    told : callable
        Told the number of each correction, and what its run misses.
    """
    problem, best = inversion.problem, Corrected(inversion, first, 0)
    formulation = first.run.scene.record.simulation.formulation
    wanted, run, before = problem.conditions.demand(problem.t), first, _missed(first)
    added = np.zeros_like(wanted.value)
    if before <= goal:
        return best
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # found and reported
        work = Work(problem, inversion.rigid)
        work.resume(inversion)
        for number in range(1, _PASSES + 1):
            added = added - smoothed(_at_knots(problem.t, run), problem.step, work.nature.excited)
            try:
                found = work.again(_with(wanted, added))
                now = replace(inversion, states=work.solved.states, left=found.left)
                run = confirmed(now, now.efforts, now.start, formulation, tell)
            except SimulationError:
                break
            missed = _missed(run)
            told(number, missed)
            if missed < _missed(best.confirmation):
                best = Corrected(now, run, number)
            if missed <= goal or missed > _WORTH * before:
                break
            before = missed
    return best


def _missed(run: Confirmation) -> float:
    return max(run.error, *run.largest)


def _at_knots(t: Array, run: Confirmation) -> Array:
    """(k, p) what conditions miss at knots."""
    return np.stack([np.interp(t, run.t, each) for each in run.missed.T], axis=1)


def smoothed(values: Array, step: float, fastest: float) -> Array:
    """(k, p) without what is faster than a frequency [rad/s], and without delay: a Gaussian in time."""
    from scipy.ndimage import gaussian_filter1d  # here: few need it

    return np.asarray(gaussian_filter1d(values, 1 / (fastest * step), axis=0, mode="nearest"))


def _with(demand: Demand, added: Array) -> Demand:
    rate = np.gradient(added, demand.t, axis=0)
    return Demand(
        demand.t, demand.value + added, demand.rate + rate, demand.acceleration + second_difference(demand.t, added)
    )
