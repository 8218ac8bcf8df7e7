"""Singular positions that a run of a chain with loops met, and what to tell of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.loops.branching import AT, Kind, Singular, singular_at
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.failures import branches_warning, ends_singular
from erls.errors import SimulationError
from erls.integrate.base import Solution, hermite
from erls.maths.so3 import Array

_LOOK = 0.5  # of the smallest singular value at the start: least ones between steps are looked for below
_MET = 1e-3  # of the same: a change point is met, not only passed at a distance
_AT_ONCE = 4096  # knots
_SEARCH = 60  # golden sections: to rounding

_Knots = tuple[Array, Array, Array, Array]  # times (k,), y, v, a (k, n)


class _Passed(NamedTuple):
    """A singular position that a run met: time [s], coordinates (n,), smallest singular value, what a loop does."""

    t: float
    y: Array
    value: float
    found: Singular


class Met(NamedTuple):
    """What to tell: warnings, and why and when [s] a run ends there whose way on is decided by rounding."""

    warnings: list[str]
    failure: SimulationError | None = None
    end: float | None = None


def singular_positions_met(chain: Formulation, solution: Solution) -> Met:
    """Loops that branch; CHANGE_POINT where no mode of a flexible link gives way, and rounding decides."""
    if not isinstance(chain, ClosedChain) or not chain.size or not len(chain.kept):
        return Met([])
    passed = dict[str, list[_Passed]]()
    for at in _singular_positions(chain, solution):
        if at.found.kind == Kind.STIFF:
            start = chain.stiffest_at_start
            problem = ends_singular(at.t, at.found, at.value, start, _where(chain, at))
            return Met(_told(chain, passed), problem, at.t)
        if at.found.kind == Kind.BRANCHES:
            passed.setdefault(at.found.loop, []).append(at)
    return Met(_told(chain, passed))


def _told(chain: ClosedChain, passed: dict[str, list[_Passed]]) -> list[str]:
    return [branches_warning(loop, _where(chain, many[0]), [at.t for at in many]) for loop, many in passed.items()]


def _where(chain: ClosedChain, at: _Passed) -> str:
    """Joint coordinates there."""
    state = chain.bare.state(at.t, at.y, np.zeros(chain.size))
    joints = zip(chain.mechanism.joints, state.angles.tolist(), strict=True)
    found = (f"{j.name} {_tidy(np.degrees(x))} deg" if j.freedom.turns else f"{j.name} {_tidy(x)} m" for j, x in joints)
    return f" ({', '.join(found)})"


def _tidy(value: float) -> str:
    return f"{round(value, 6) + 0.0:.6g}"


def _singular_positions(chain: ClosedChain, solution: Solution) -> list[_Passed]:
    """In the order of time."""
    once = np.append(np.diff(solution.t) > 0, True)  # a jump has two knots
    t, y, v, a = (x[once] for x in (solution.t, solution.y, solution.v, solution.a))
    if len(t) < 3 or not np.isfinite(y).all():
        return []
    parts = range(0, len(t), _AT_ONCE)
    share = np.concatenate([chain.loops.watched(t[k : k + _AT_ONCE], y[k : k + _AT_ONCE])[1] for k in parts])
    share /= chain.stiffest_at_start
    inner = share[1:-1]
    least = np.flatnonzero((inner <= share[:-2]) & (inner <= share[2:]) & (inner < _LOOK)) + 1
    result: list[_Passed] = []
    for k in least.tolist():
        beside = slice(max(k - 2, 0), k + 3)
        knots = t[beside], y[beside], v[beside], a[beside]

        def place(at: float, knots: _Knots = knots) -> Array:
            return hermite(*knots, np.array([at]))[0]

        def value(at: float, place: Callable[[float], Array] = place) -> float:
            return float(chain.loops.watched(np.array([at]), place(at))[1][0])

        at = _lowest(value, float(t[k - 1]), float(t[k + 1]))
        lowest = value(at)
        if lowest < AT * chain.stiffest_at_start:
            found = singular_at(chain, at, place(at)[0])
            if found.kind == Kind.STIFF or lowest < _MET * chain.stiffest_at_start:
                result.append(_Passed(at, place(at)[0], lowest, found))
    return result


def _lowest(value: Callable[[float], float], low: float, high: float) -> float:
    """Where a function of one valley is lowest, by golden sections."""
    ratio = (np.sqrt(5.0) - 1) / 2
    at = [high - ratio * (high - low), low + ratio * (high - low)]
    found = [value(x) for x in at]
    for _ in range(_SEARCH):
        if found[0] < found[1]:
            high = at[1]
            at = [high - ratio * (high - low), at[0]]
            found = [value(at[0]), found[0]]
        else:
            low = at[0]
            at = [at[1], low + ratio * (high - low)]
            found = [found[1], value(at[1])]
    return (low + high) / 2
