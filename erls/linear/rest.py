"""Equilibria with all joints free, stable or not: where forces balance at rest, next to a state.

Newton's method in coordinates of unit mass, of which what nothing holds is left where it is. Where a step would go far
and against the forces, or nothing holds what is pushed, the mechanism falls instead, -|K|⁻¹ R with the symmetric part
of K: so an unstable equilibrium is found from next to it, a stable one from farther away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from erls.equations.neighbours import Neighbours, along, split
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array

_ITERATIONS = 200
_LARGEST = 0.2  # of the size of the mechanism: a step
_SETTLED = 1e-11  # the same: a step that ends the search
_FREE = 1e-12  # of the largest ω²: held by nothing
_BALANCED, _ROUNDING = 1e-6, 1e-13  # m/s², and of the largest ω² times the size: accelerations of what is at rest


def at_rest(near: Neighbours) -> Neighbours:
    """The states beside the equilibrium next to a state, motions that are prescribed as they are.

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM: nothing balances the forces, or the search does not come to an end. SINGULAR_MASS: something
        that can move has no mass, or loops lock.
    """
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # of a step too far, which ends the search
            return _found(near)
    except np.linalg.LinAlgError:
        raise SimulationError(
            Cause.SINGULAR_MASS,
            "the search for an equilibrium needs mass in every motion, and loops that do not lock",
            where="at = 'equilibrium'",
            remedy="give every moving part a mass and a moment of inertia, or start elsewhere",
        ) from None


def _found(near: Neighbours) -> Neighbours:
    near, left = near.at_rest(np.zeros(len(near.metres)), np.zeros_like(near.multipliers)), np.inf
    for _ in range(_ITERATIONS):
        step = _step(near)
        far, left = float(np.abs(near.metres * step.moved).max(initial=0.0)) / near.reach, step.left
        if not np.isfinite(far):
            break
        share = min(1.0, _LARGEST / far) if far else 1.0
        near = near.at_rest(share * step.moved, near.multipliers + share * step.pulled)
        if far <= _SETTLED and left <= 0:
            return near
    free = "nothing balances its forces" if np.isfinite(left) and left > 0 else "the search comes to no end"
    raise SimulationError(
        Cause.NO_EQUILIBRIUM,
        f"no equilibrium with the joints free next to the start: {free}",
        where="at = 'equilibrium'",
        remedy="start nearer to it, hold joints by drives or springs, or linearize at a time (--at)",
    )


class _Step(NamedTuple):
    """Displacement (n,), change of the multipliers (m,), and by how much [m/s²] too much stays out of balance."""

    moved: Array
    pulled: Array
    left: float


def _step(near: Neighbours) -> _Step:
    basis, still = split(near), np.zeros((1, len(near.metres)))
    rows, across = near.rows(), basis.across
    closing = across @ np.linalg.solve(rows @ across, -near.violation()) if len(rows) else np.zeros(len(near.metres))
    stiff = along(near, np.hstack([basis.ways, closing[:, None]]), 0)
    force = near.forces(still, still, still)[0] + stiff[:, -1]
    if not (np.isfinite(stiff).all() and np.isfinite(force).all()):
        return _Step(np.full(len(near.metres), np.nan), np.zeros(len(rows)), np.nan)
    lower = la.cholesky(basis.ways.T @ near.mass() @ basis.ways, lower=True)
    ways = la.solve_triangular(lower, basis.ways.T, lower=True).T  # of unit mass
    own = la.solve_triangular(lower, (ways.T @ stiff[:, :-1]).T, lower=True).T
    push, metres = ways.T @ force, near.metres[:, None] * ways
    found = np.linalg.lstsq(own, -push, rcond=_FREE)[0]
    left = float(np.abs(metres @ (own @ found + push)).max(initial=0.0)) - _BALANCED
    left -= _ROUNDING * float(np.abs(own).max(initial=0.0)) * near.reach
    far = float(np.abs(metres @ found).max(initial=0.0)) > _LARGEST * near.reach
    if left > 0 or (far and float(push @ found) > 0):
        found = _falling(own, push)
    in_ways = la.solve_triangular(lower, found, lower=True, trans="T")
    pulled = np.zeros(len(rows))
    if len(rows):
        pulled = np.linalg.solve((rows @ across).T, -across.T @ (force + stiff[:, :-1] @ in_ways))
    return _Step(basis.ways @ in_ways + closing, pulled, left)


def _falling(own: Array, push: Array) -> Array:
    """-|K|⁻¹ R, what nothing holds as though hardly anything did."""
    squares, shapes = la.eigh((own + own.T) / 2)
    held = np.maximum(np.abs(squares), _FREE * np.abs(squares).max(initial=0.0))
    return np.asarray(-shapes @ ((shapes.T @ push) / np.where(held > 0, held, 1.0)))
