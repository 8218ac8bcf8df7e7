"""Closed loops within an inversion: further conditions, whose multipliers are further unknown efforts.

Loops hold Φ(t, q) = 0 as servo conditions hold h(q) = y_d, and their forces stand beside those of the drives:

    R(t, q, q̇, q̈) + Φ_qᵀ λ = A u

so that (h, Φ) and (u, λ) take the places of h and u. Which coordinates follow is chosen where the motion starts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as la

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.series import mass_series
from erls.equations.tangents import Knots, Tangents, difference
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

_FOLLOWS = 1e-6  # of the largest: a coordinate that moves conditions by less, beside those before it, does not follow
_SINGULAR = 1e-7  # of the largest singular value of Φ over what is not driven: loops do not hold it


def following(rows: Array, groups: Sequence[IntArray]) -> IntArray:
    """Coordinates that follow from conditions: as many as have independent ``rows`` (p, n), of the first group as far
    as these do, then of the next.

    Parameters
    ----------
    rows : (p, n) array
        Conditions over coordinates, in comparable units.
    groups : sequence of int arrays
        Coordinates, the ones to take first in front.
    """
    rest, found, largest = rows.copy(), [np.zeros(0, dtype=np.int64)], float(np.abs(rows).max(initial=0.0))
    for group in groups:
        if not len(group) or not len(rows):
            continue
        q, r, order = la.qr(rest[:, group], mode="economic", pivoting=True)
        count = int(np.count_nonzero(np.abs(np.diag(r)) > _FOLLOWS * largest))
        found.append(group[order[:count]])
        rest = rest - q[:, :count] @ (q[:, :count].T @ rest)
    return np.sort(np.concatenate(found))


class Closing:
    """Conditions and forces of the loops of a mechanism, at many states.

    Parameters
    ----------
    chain : ClosedChain
    """

    def __init__(self, chain: ClosedChain) -> None:
        self.chain, self.system = chain, chain.exact

    @property
    def count(self) -> int:
        """Conditions in use r."""
        return len(self.chain.kept)

    @property
    def names(self) -> str:
        """Of the loops, for messages."""
        return ", ".join(repr(loop.name) for loop in self.chain.mechanism.loops)

    def held(self, t: Array, y: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        """Φ, Φ̇, Φ̈ at zero accelerations, (k, r) each [m, rad], and Φ_q (k, r, n)."""
        found = self.system.motions(t, y, v)
        return found[..., 0], found[..., 1], found[..., 2], found[..., 3:]

    def forces(self, t: Array, y: Array, v: Array, a: Array, multipliers: Array) -> Array:
        """(k, n) R + Φ_qᵀ λ."""
        return self.system.held(t, y, v, a, multipliers)

    def tangents(self, knots: Knots, multipliers: Array, steps: Array) -> Tangents:
        """Derivatives of `forces` by accelerations, rates and places, multipliers as they are; by differences."""
        t, y, v, a = knots
        n = y.shape[1]
        damping, stiffness = np.empty((2, len(t), n, n))
        for j, step in enumerate(steps.tolist()):
            damping[:, :, j] = difference(lambda x: self.forces(t, y, x, a, multipliers), v, j, step)
            stiffness[:, :, j] = difference(lambda x: self.forces(t, x, v, a, multipliers), y, j, step)
        return Tangents(mass_series(self.system, t, y), damping, stiffness)

    def ways(self, t: Array, y: Array, metres: Array) -> Array:
        """(n, n - r) directions in which loops leave a place (1, n) free."""
        rows = self.held(t, y, np.zeros_like(y))[3][0]
        return np.asarray(la.null_space(rows / metres) / metres[:, None])

    def refuse_uncontrolled(self, t: Array, y: Array, driven: IntArray, metres: Array) -> None:
        """Raise where rigid links can move with the drives held, or have passed such a place from one knot to the next.

        Raises
        ------
        SimulationError
            SINGULAR_SERVO: says when.
        """
        rest = np.setdiff1d(np.arange(y.shape[1]), driven)
        rows = (self.held(t, y, np.zeros_like(y))[3] * self.chain.row_metres[self.chain.kept, None] / metres)[..., rest]
        values = np.linalg.svd(rows, compute_uv=False)
        flat = values[:, -1] <= _SINGULAR * values[:, 0]
        if rows.shape[1] == rows.shape[2]:
            signs = np.linalg.slogdet(rows)[0]
            flat[1:] |= signs[1:] != signs[:-1]
        if flat.any():
            k = int(np.flatnonzero(flat)[0])
            raise SimulationError(
                Cause.SINGULAR_SERVO,
                f"with the unknown drives held, the loops {self.names} leave links free to move: a singular position",
                where=f"t = {float(t[k]):.6g} s",
                remedy="keep away from places where links next to the loops are in line, or name other drives "
                "(inverse.drives)",
            )
