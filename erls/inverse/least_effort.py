"""More drives than conditions: the spare joints move so that rigid links take the least effort,

    ∫ Σ u² dt    over    ṡ = x⁴ (1 - x)⁴ Σ c P(2x - 1),

with x the share of the demanded motion that has passed and P Legendre polynomials: from rest to rest as smoothly as the
polynomials of degree 9 that points follow, which are members. It is the motion as a whole that is chosen: the least
effort of each moment by itself would let joints run away (J. M. Hollerbach, K. C. Suh, IEEE J. Robot. Autom. 3 (1987)
308-316). Forces count times the size of a link, as torques. Gauss's and Newton's method starts from spare joints that
stand still; what it ends in is a minimum beside that. The motion that is found becomes that of further conditions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from erls.errors import SimulationError
from erls.inverse.conditions import Condition, Conditions, Demand, Together
from erls.inverse.internal import without_internal
from erls.inverse.servoed import Servoed, followed
from erls.maths.so3 import Array
from erls.mechanism.curves import Piecewise, piecewise

_TERMS = 6  # of a law
_KNOTS = 81  # at which efforts count
_ITERATIONS, _HALVINGS = 30, 8
_STEP = 1e-6  # rad, and of a link: of differences
_WIDE = 1.0  # the same: what a joint moves in an iteration at most
_SETTLED = 1e-8  # of the sum of squares: what an iteration gains at least
_STILL = 1e-3  # of the size of a joint: what the last step moves where no part of it gains
_REST = Polynomial([0.25, 0.0, -1.0]) ** 4
LAWS = [
    (_REST * Legendre.basis(k, domain=[-0.5, 0.5]).convert(kind=Polynomial)).integ(lbnd=-0.5) for k in range(_TERMS)
]
"""Of x - 1/2: in powers of x they would end in rounding."""


def of_least_effort(conditions: Conditions, rigid: Callable[[Conditions], Servoed]) -> tuple[Conditions, bool]:
    """With the motion of spare joints as further conditions, and whether the search for it came to its end.

    Parameters
    ----------
    conditions : Conditions
    rigid : callable
        Rigid links that are driven, with other conditions.

    Raises
    ------
    SimulationError
        OUT_OF_REACH, SINGULAR_SERVO: with spare joints where they start.
    """
    begins = conditions.breakpoints
    whole = begins[0], begins[-1] if begins[-1] > begins[0] else begins[0] + 1.0
    t = np.linspace(*whole, _KNOTS)
    demand, bare = conditions.demand(t), rigid(conditions)
    best, problems = None, list[SimulationError]()
    for spare in _choices(bare, len(conditions.every)):
        still = _with(conditions, spare, [0.0 * LAWS[0]] * len(spare), whole)
        try:
            servoed = rigid(still)
            found = _Search(servoed, demand, followed(servoed, still, t), spare, whole).least()
        except SimulationError as problem:
            problems.append(problem)
            continue
        if best is None or found.square < best.square:
            best = found
    if best is None:
        raise problems[0]
    return _with(conditions, best.spare, [_law(row) for row in best.coefficients], whole), best.settled


class _Spare(NamedTuple):
    """A driven joint that moves for the least effort: name, unit, size of a motion, factors (j,) over all joints,
    start.
    """

    name: str
    unit: str
    size: float
    factors: Array
    start: float


class _Least(NamedTuple):
    """Coefficients (j, terms) of the laws of spare joints, the sum of squares of the efforts, and whether the search
    came to its end.
    """

    spare: tuple[_Spare, ...]
    coefficients: Array
    square: float
    settled: bool


def _law(coefficients: Array) -> Polynomial:
    """Of one joint, by x."""
    found: Polynomial = sum((c * law for c, law in zip(coefficients.tolist(), LAWS, strict=True)), 0.0 * LAWS[0])
    return found


def _choices(servoed: Servoed, conditions: int) -> Iterator[tuple[_Spare, ...]]:
    """Of as many driven joints as there are more than conditions; whether others can follow, the search says."""
    tree, y = servoed.tree, servoed.beginning
    for some in combinations(servoed.driven.tolist(), len(servoed.driven) - conditions):
        found = []
        for k in some:
            joint = int(tree.free_joints[k])
            own = tree.mechanism.joints[joint]
            size = 1.0 if own.freedom.turns else servoed.size
            found.append(_Spare(own.name, own.freedom.units[0], size, np.eye(tree.joints)[joint], float(y[k])))
        yield tuple(found)


def _with(
    conditions: Conditions, spare: tuple[_Spare, ...], laws: list[Polynomial], whole: tuple[float, float]
) -> Conditions:
    more = [
        Condition(one.name, one.unit, Together(one.factors), _curve(one.start, law, whole))
        for one, law in zip(spare, laws, strict=True)
    ]
    return replace(conditions, every=(*conditions.every, *more))


def _curve(start: float, law: Polynomial, whole: tuple[float, float]) -> Piecewise:
    """A law over the time of the motion; before and after it rests."""
    span, middle = whole[1] - whole[0], sum(whole) / 2

    def inside(shifted: Polynomial) -> Array:
        found = np.asarray(shifted.coef, dtype=float) / span ** np.arange(len(shifted.coef), dtype=float)
        found[0] += start
        return found

    halves = inside(law(Polynomial([-0.5, 1.0]))), inside(law)
    return piecewise([whole[0], middle, whole[1]], [[start], *halves, [start + law(0.5)]], smooth=True)


class _Search:
    """Efforts over coefficients (j, terms), near places (k, n) where the last ones were found."""

    def __init__(
        self, servoed: Servoed, demand: Demand, y: Array, spare: tuple[_Spare, ...], whole: tuple[float, float]
    ) -> None:
        self._servoed, self._demand, self._y, self._spare = servoed, demand, y, spare
        self._start, self._sizes = np.array([one.start for one in spare]), np.array([one.size for one in spare])
        span = whole[1] - whole[0]
        x = (demand.t - whole[0]) / span - 0.5
        self._laws = [np.array([(law.deriv(k) if k else law)(x) for law in LAWS]) / span**k for k in range(3)]
        joints = [servoed.tree.mechanism.joints[k] for k in servoed.tree.free_joints[servoed.driven].tolist()]
        self._units = np.array([1.0 if joint.freedom.turns else servoed.size for joint in joints])

    def _efforts(self, coefficients: Array, kept: bool = False) -> Array:
        """All at the knots, those of forces times the size of a link."""
        parts = [coefficients @ law for law in self._laws]
        parts[0] = parts[0] + self._start[:, None]
        own = self._demand
        rows = (np.hstack([x, part.T]) for x, part in zip(own[1:], parts, strict=True))
        states = without_internal(self._servoed, Demand(own.t, *rows), self._y)
        if kept:
            self._y = states.y
        return np.asarray((states.efforts[:, : len(self._units)] * self._units).ravel())

    def least(self) -> _Least:
        """As far as Gauss's and Newton's method comes."""
        shape = len(self._start), _TERMS
        found = np.zeros(shape)
        efforts = self._efforts(found, True)
        steps = np.repeat(_STEP * self._sizes, _TERMS) / np.tile(np.abs(self._laws[0]).max(axis=1), len(self._start))
        settled = False
        for _ in range(_ITERATIONS):
            before = float(efforts @ efforts)
            try:
                moved = (found.ravel() + np.diag(steps)).reshape(-1, *shape)
                slopes = np.array([self._efforts(each) - efforts for each in moved]).T / steps
            except SimulationError:  # at the edge of what can be
                break
            change = np.asarray(-np.linalg.lstsq(slopes, efforts, rcond=None)[0]).reshape(shape)
            far = float((np.abs(change @ self._laws[0]).max(axis=1) / self._sizes).max())
            better = self._along(found, change * min(1.0, _WIDE / max(far, _WIDE)), before)
            if better is None:
                settled = far < _STILL
                break
            found, efforts = better
            settled = before - float(efforts @ efforts) < _SETTLED * before
            if settled:
                break
        return _Least(self._spare, found, float(efforts @ efforts), settled)

    def _along(self, found: Array, change: Array, before: float) -> tuple[Array, Array] | None:
        """Coefficients with less effort on the way of a change, and their efforts."""
        for k in range(_HALVINGS):
            other = found + change / 2**k
            try:
                efforts = self._efforts(other)
            except SimulationError:  # out of reach
                continue
            if float(efforts @ efforts) < before:
                return other, self._efforts(other, True)
        return None
