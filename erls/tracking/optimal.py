"""Laws of a duration within bounds on efforts, rates and vibration, whose efforts are as small as can be.

    ṡ = x³ (1 - x)³ Σ cₖ Pₖ(2 x - 1),    x = t / T,

with Legendre polynomials P: smooth enough to leave fast vibrations alone, which no model would foretell along the way.
Rates, and the amplitude that a mode keeps, are linear in c, and efforts are next to a law: a linear program finds the
law whose largest effort, over its bound, is least, anew from each law that it gives. The shortest duration at which
forward runs keep the bounds, too, is looked for by `erls.tracking.plan`.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from erls.maths.so3 import Array
from erls.tracking.goal import Goal
from erls.tracking.laws import Law, law_of, polynomial

KNOTS = 201
_TERMS = 9
_PASSES = 5  # linear programs at a duration
_SIDES = 8  # of the polygon within which an amplitude is kept
_STEP = 1e-6  # of differences of efforts by s, its rate and its acceleration


@cache
def _shapes() -> tuple[Array, Array, Array]:
    """s, ṡ, s̈ (k, c) of every term over a duration of 1."""
    x = np.linspace(0.0, 1.0, KNOTS)
    weight = Polynomial([0.0, 1.0, -1.0]) ** 3
    rates = [weight * Legendre.basis(k, domain=[0, 1]).convert(kind=Polynomial) for k in range(_TERMS)]
    place, rate, acceleration = (np.stack([p(x) for p in each], 1) for each in _levels(rates))
    return place, rate, acceleration


def _levels(rates: list[Polynomial]) -> tuple[list[Polynomial], ...]:
    return [p.integ() for p in rates], rates, [p.deriv() for p in rates]


def least(goal: Goal, duration: float, efforts: Array, swing: float) -> Law | None:
    """The law of a duration whose largest effort over its bound is least, if one is found that keeps all bounds.

    Parameters
    ----------
    goal : Goal
    duration : float
        [s]
    efforts : (j,) array
        Bounds.
    swing : float
        Bound [m].
    """
    law = polynomial(duration, 7, KNOTS)
    for _ in range(_PASSES):
        found = _program(goal, law, efforts, swing)
        if found is None:
            return None
        law = law_of(duration, _shapes()[0] @ found)
    return law if (np.abs(goal.needed(law)) <= efforts).all() else None


def _program(goal: Goal, law: Law, efforts: Array, swing: float) -> Array | None:
    """(c,) coefficients of the linear program next to a law; None where none keeps rates and vibration."""
    from scipy.optimize import linprog  # here: slow to import

    shapes = [part / law.duration**k for k, part in enumerate(_shapes())]
    blocks = [*_efforts(goal, law, shapes, efforts), *_rates(goal, shapes[1]), *_endings(goal, law, shapes[2], swing)]
    rows, right = np.vstack([rows for rows, _ in blocks]), np.concatenate([right for _, right in blocks])
    cost, whole = np.r_[np.zeros(_TERMS), 1.0], np.r_[shapes[0][-1], 0.0][None]
    free = [(None, None)] * _TERMS + [(0.0, None)]
    found = linprog(cost, rows, right, whole, [1.0], free, method="highs")
    return np.asarray(found.x[:_TERMS]) if found.success else None


_Block = tuple[Array, Array]  # rows over c and the largest effort, and what they stay below


def _efforts(goal: Goal, law: Law, shapes: list[Array], efforts: Array) -> Iterator[_Block]:
    parts = (law.place, law.rate, law.acceleration)
    here, more = goal.rigid(*parts), goal.beyond.at(KNOTS)
    moved = [goal.rigid(*(x + _STEP * (i == k) for i, x in enumerate(parts))) for k in range(3)]
    for j in np.flatnonzero(np.isfinite(efforts)).tolist():
        by = [(other[:, j] - here[:, j]) / _STEP for other in moved]
        slope = sum(b[:, None] * shape for b, shape in zip(by, shapes, strict=True))
        rest = here[:, j] + more[:, j] - sum(b * x for b, x in zip(by, parts, strict=True))
        for mode in goal.modes:
            slope = slope + mode.efforts[j] * mode.accelerations(law.step, shapes[2])
        for sign in (1.0, -1.0):
            yield np.hstack([sign * slope / efforts[j], -np.ones((KNOTS, 1))]), -sign * rest / efforts[j]


def _rates(goal: Goal, shape: Array) -> Iterator[_Block]:
    fastest = goal.fastest
    if np.isfinite(fastest):
        for sign in (1.0, -1.0):
            yield np.hstack([sign * shape, np.zeros((KNOTS, 1))]), np.full(KNOTS, fastest)


def _endings(goal: Goal, law: Law, shape: Array, swing: float) -> Iterator[_Block]:
    turned = np.exp(-2j * np.pi * np.arange(_SIDES) / _SIDES)
    kept, uncertainty = swing * np.cos(np.pi / _SIDES) / max(len(goal.modes), 1), goal.scene.record.plan.uncertainty
    for mode, extra in zip(goal.modes, goal.beyond.endings, strict=True):
        for share in {-uncertainty, 0.0, uncertainty}:
            ending = mode.shifted(share).ending(law.step, KNOTS) @ shape
            sides = np.multiply.outer(turned, ending).real
            yield np.hstack([sides, np.zeros((_SIDES, 1))]), kept - (turned * extra).real
