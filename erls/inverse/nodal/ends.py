"""What holds at the ends of a nodal inversion: steps of small motions about rest that stay bounded outside of it.

Beside an equilibrium, the steps of `erls.inverse.nodal.two_point` are

    (M / h² + C / 2h) ξ₊ + (K - 2 M / h²) ξ + (M / h² - C / 2h) ξ₋ = 0

in the ways ξ that joints and conditions leave, of forces that neither joints nor drives give. Their roots z come in
pairs: one grows and one decays of whatever is faster than the steps, so that it follows; slow motions that swing
without damping have |z| = 1 and start at rest. At the start (ξ₋, ξ) holds what grows alone, at the end (ξ, ξ₊) what
does not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from erls.inverse.nodal.servoed import Rest
from erls.inverse.two_point import refuse_change
from erls.maths.so3 import Array

_MARGIN = 1e-6  # of |z| = 1, by which rounding leaves it


class Bounded(NamedTuple):
    """Rows over increments from rest at two knots, (r, n) each."""

    first: Array
    second: Array


def bounded(first: Rest, last: Rest, metres: Array, h: float) -> tuple[Bounded, Bounded]:
    """At the start, of the knot ahead of it and the first; at the end, of the last and the one after it.

    Raises
    ------
    SimulationError
        UNSTABLE_INVERSE: not as much grows at the end as at the start.
    """
    start, growing = _rows(first, metres, h, True)
    end, staying = _rows(last, metres, h, False)
    refuse_change(2 * len(metres) - 2 * len(first.held_by) - staying, growing)
    return start, end


def _rows(at: Rest, metres: Array, h: float, growing: bool) -> tuple[Bounded, int]:
    """That hold the others, and how many roots grow, or do not."""
    ways, across = (la.null_space(part / metres) for part in (at.balance.rows[0], at.balance.pushed[0].T))
    if not ways.shape[1]:
        return Bounded(*np.zeros((2, 0, len(metres)))), 0
    mass, damping, stiffness = (
        (across / metres[:, None]).T @ (part / unit) @ (ways / metres[:, None])
        for part, unit in zip(at.matrices, (h**2, 2 * h, 1.0), strict=True)
    )
    units = stiffness + 4 * mass  # of the fastest steps: what alternates
    mass, damping, stiffness = (np.linalg.solve(units, part) for part in (mass, damping, stiffness))
    unit, none = np.eye(len(units)), np.zeros_like(units)
    before = np.block([[none, unit], [damping - mass, 2 * mass - stiffness]])
    after = np.block([[unit, none], [none, mass + damping]])

    def chosen(alpha: Array, beta: Array) -> Array:
        return np.asarray((np.abs(alpha) > (1 + _MARGIN) * np.abs(beta)) == growing)

    *_, alpha, beta, _, vectors = la.ordqz(before, after, sort=chosen, output="real")
    count = int(chosen(alpha, beta).sum())
    rows, back = vectors[:, count:].T, ways.T * metres
    return Bounded(rows[:, : len(units)] @ back, rows[:, len(units) :] @ back), count
