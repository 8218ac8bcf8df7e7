"""Two-point boundary value problems ẋ = f(t, x) over all steps at once: direct collocation by the trapezoidal rule.

    x₁ - x₀ = h/2 (f₀ + f₁),    L₀ f(t₀, x₀) = 0,    L_N f(t_N, x_N) = 0

The rule is generalized-α with ρ∞ = 1, started from its own accelerations. It is symmetric in time, so that whatever
grows or decays in the equations does so in the steps, however large they are; numerical damping (ρ∞ < 1) would turn
stiff motions that grow into ones that decay. L are those rows of the left invariant subspaces of ∂f/∂x at the ends that
hold what does not grow at the start, and what grows at the end: with demands that rest outside the interval, exactly
the motion that stays bounded for all times is left, with tails of linear equations cut off without an error (M. Lentini
and H. B. Keller, SIAM J. Numer. Anal. 17 (1980) 577-604).

Newton's method solves one system that is banded in blocks, by orthogonal elimination from step to step (U. Ascher,
R. Mattheij, R. Russell, Numerical Solution of Boundary Value Problems, 1995, ch. 7), at a cost that is linear in the
steps. Tangents come from some of the knots and are interpolated between them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ITERATIONS = 40
_SLOW = 0.2  # ratio of changes beyond which tangents are made anew
_ROUNDING = 100.0  # times the tolerance: changes that fall no more are rounding of stiff forces
_AXIS, _FINE = 1e-6, 1e-9  # of a root, and of the largest: real parts that are none
COARSE = 101
"""Knots at which tangents are made at first."""


class Field(Protocol):
    """f at the knots t (k,) of a problem with d states, as it is at the states that it last looked at."""

    def look(self, x: Array) -> None:
        """Take in states (k, d)."""

    def learn(self, knots: IntArray) -> None:
        """Make tangents anew, from those at some of the knots."""

    def slopes(self, x: Array) -> Array:
        """(k, d) f."""

    def tangents(self) -> Array:
        """(k, d, d) ∂f/∂x."""

    def move(self, step: Array) -> float:
        """Follow a step (k, d) of the states with what belongs to the knots alone; how far that goes, in scales."""


class Ends(NamedTuple):
    """What holds at the ends.

    Attributes
    ----------
    start, end : (q, d), (d - q, d) arrays
        L₀, L_N.
    """

    start: Array
    end: Array


class Solved(NamedTuple):
    """States (k, d) at the knots, and iterations."""

    x: Array
    iterations: int


def grows(roots: Array) -> NDArray[np.bool_]:
    """(d,) bool: which roots lie to the right of the imaginary axis."""
    return np.asarray(roots.real > _margin(roots))


def rests(roots: Array) -> NDArray[np.bool_]:
    """(d,) bool: which roots lie on the imaginary axis."""
    return np.asarray(np.abs(roots.real) <= _margin(roots))


def _margin(roots: Array) -> Array:
    return np.asarray(_AXIS * np.abs(roots) + _FINE * np.abs(roots).max(initial=0.0))


def ends_of(first: Array, last: Array, scales: Array) -> Ends:
    """From ∂f/∂x (d, d) at the start and at the end.

    Parameters
    ----------
    first, last : (d, d) arrays
    scales : (d,) array
        Units of the states.

    Raises
    ------
    SimulationError
        UNSTABLE_INVERSE: not as much grows at the end as at the start.
    """
    decaying, growing = _left_rows(first, scales, False), _left_rows(last, scales, True)
    refuse_change(len(growing), len(first) - len(decaying))
    return Ends(decaying, growing)


def refuse_change(at_end: int, at_start: int) -> None:
    """Raise where not as much grows at the end as at the start.

    Raises
    ------
    SimulationError
        UNSTABLE_INVERSE.
    """
    if at_end != at_start:
        raise SimulationError(
            Cause.UNSTABLE_INVERSE,
            "internal motions change on the way between growing and decaying",
            where="from the start to the end",
            value=f"{at_end} that grow at the end",
            limit=f"{at_start} at the start",
            remedy="split the motion where they change, or demand other points",
        )


def _left_rows(tangent: Array, scales: Array, growing: bool) -> Array:
    """(q, d) rows that span the left invariant subspace of what grows, or of the rest."""
    if not len(tangent):
        return np.zeros((0, 0))
    scaled = tangent * scales / scales[:, None]
    fine = _FINE * float(np.abs(np.linalg.eigvals(scaled)).max())

    def wanted(real: float, imaginary: float) -> bool:
        return (real > _AXIS * abs(complex(real, imaginary)) + fine) == growing

    _, vectors, number = la.schur(scaled.T, output="real", sort=wanted)
    return np.asarray(vectors[:, :number].T / scales)


def collocate(
    field: Field,
    t: Array,
    x: Array,
    ends: Callable[[Array, Array], Ends],
    scales: Array,
    tolerance: float,
    told: Callable[[int, float], None] = lambda iteration, change: None,
) -> tuple[Solved, Ends]:
    """Solve from a first guess x (k, d).

    Parameters
    ----------
    field : Field
    t : (k,) array
        Knots [s].
    ends : callable
        Conditions of the ends from ∂f/∂x there, made once.
    scales : (d,) array
        Changes of each state that count as one.
    tolerance : float
        Change, in scales, at which iteration ends.
    told : callable
        Told the number and the change of each iteration.

    Raises
    ------
    SimulationError
        NEWTON_FAILED: says where; what ``field`` raises.
    """
    coarse = np.unique(np.linspace(0, len(t) - 1, COARSE).round().astype(np.int64))
    conditions: Ends | None = None
    fresh, before = False, np.inf
    for iteration in range(1, _ITERATIONS + 1):
        field.look(x)
        if not fresh:
            field.learn(coarse)
            fresh = True
        made = field.tangents()
        conditions = conditions or ends(made[0], made[-1])
        step = _newton_step(t, x, field.slopes(x), made, conditions, scales)
        change = np.abs(step / scales).max(axis=1, initial=0.0)
        worst = max(float(change.max(initial=0.0)), field.move(step))
        told(iteration, worst)
        x = x + step
        if worst <= tolerance or before / 2 < worst <= _ROUNDING * tolerance:
            field.look(x)
            return Solved(x, iteration), conditions
        if not np.isfinite(worst):
            break
        if worst > _SLOW * before:
            finer = np.linspace(0, len(t) - 1, min(len(t), 2 * len(coarse) - 1))
            fresh, coarse = False, np.unique(finer.round().astype(np.int64))
        before = worst
    raise SimulationError(
        Cause.NEWTON_FAILED,
        "Newton's method over all steps does not converge",
        where=f"t = {float(t[int(np.nanargmax(np.nan_to_num(change, nan=np.inf)))]):.6g} s",
        value=f"change {worst:.3g} of its scale",
        limit=f"{tolerance:.3g}",
        remedy="demand a slower or shorter motion, or a smaller step (simulation.step)",
    )


def interpolated(t: Array, knots: IntArray, values: Array) -> Callable[[Any], Array]:
    """Values (c, ...) at some knots, linear between them, as a function of numbers of knots."""
    if len(knots) == 1:
        return lambda k: np.broadcast_to(values[0], (*np.shape(k), *values.shape[1:]))

    def at(k: Any) -> Array:
        right = np.clip(np.searchsorted(knots, k, side="right"), 1, len(knots) - 1)
        first, last = knots[right - 1], knots[right]
        share = ((t[k] - t[first]) / (t[last] - t[first]))[(..., *(None,) * (values.ndim - 1))]
        return np.asarray((1 - share) * values[right - 1] + share * values[right])

    return at


def _newton_step(
    t: Array, x: Array, slopes: Array, tangents: Array, ends: Ends, scales: Array
) -> Array:
    """(k, d) change of the states."""
    unit, half = np.eye(x.shape[1]), np.diff(t) / 2
    open_ = x[1:] - x[:-1] - half[:, None] * (slopes[:-1] + slopes[1:])
    scaled = tangents * scales / scales[:, None]
    sweep = Sweep(ends.start @ tangents[0] * scales, -ends.start @ slopes[0])
    for k, h in enumerate(half.tolist()):
        sweep.step(-unit - h * scaled[k], unit - h * scaled[k + 1], -open_[k] / scales)
    return sweep.back(ends.end @ tangents[-1] * scales, -ends.end @ slopes[-1]) * scales


class Sweep:
    """Linear conditions A₀ ξ₀ = b₀, G_k ξ_k + H_k ξ_k+1 = r_k, A_N ξ_N = b_N, solved by orthogonal elimination: what is
    known of ξ_k, and the step, become d rows that give ξ_k from ξ_k+1, and what is known of ξ_k+1. That factors the
    whole matrix into orthogonal and triangular ones, stable whatever grows or decays; rows must not be scaled between.

    Parameters
    ----------
    rows, right : (q, d), (q,) arrays
        A₀, b₀.
    """

    def __init__(self, rows: Array, right: Array) -> None:
        self._known, self._right = _unit_rows(rows, right)
        self._kept: list[Array] = []

    def step(self, before: Array, after: Array, right: Array) -> None:
        """Take in G (d, d), H (d, d), r (d,)."""
        q, d = self._known.shape
        whole = np.zeros((q + d, 2 * d + 1))
        whole[:q, :d], whole[:q, -1] = self._known, self._right
        whole[q:, :d], whole[q:, d : 2 * d], whole[q:, -1] = before, after, right
        found: Array = np.asarray(np.linalg.qr(whole, mode="r"))
        self._kept.append(found[:d])
        self._known, self._right = found[d : d + q, d : 2 * d], found[d : d + q, -1]

    def back(self, rows: Array, right: Array) -> Array:
        """(k, d) ξ, from A_N and b_N."""
        d = self._known.shape[1]
        rows, right = _unit_rows(rows, right)
        found = [np.linalg.solve(np.vstack([self._known, rows]), np.concatenate([self._right, right]))]
        for kept in reversed(self._kept):
            known = kept[:, -1] - kept[:, d : 2 * d] @ found[-1]
            found.append(la.solve_triangular(kept[:, :d], known, check_finite=False))
        return np.array(found[::-1])


def _unit_rows(rows: Array, right: Array) -> tuple[Array, Array]:
    size = np.linalg.norm(rows, axis=1)
    size = np.where(size > 0, size, 1.0)
    return rows / size[:, None], right / size
