"""Dry friction in the joints of a tree that loops close: what it leaves of the motion, and forces of the loops with it.

With M = LLᵀ and Q an orthonormal basis of L⁻¹Φ_yᵀ, a force g moves a closed chain by L⁻ᵀ (1 - QQᵀ) L⁻¹ g.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg as la

from erls.equations.loops.gripped import gripped
from erls.equations.switches.law import Freely, settled
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.loops.closed_chain import ClosedChain


def freely(chain: ClosedChain, t: float, y: Array, v: Array) -> Freely:
    """A closed state without this friction.

    Raises
    ------
    SimulationError
        SINGULAR_MASS, or LOOP_OPEN where the conditions lock.
    """
    places = np.zeros(0, dtype=np.int64) if chain.dry is None else chain.dry.places
    a = chain.accelerate(chain.exact, t, y, v)
    if not np.isfinite(a).all():
        raise chain.locked(t, chain.stiffest(chain.closure(t, y, v)))
    room, unit = chain.exact.room, np.zeros((chain.size, len(places)))
    unit[places, np.arange(len(places))] = 1.0
    upper = la.cholesky(room.mass)  # which reads the upper half
    both = la.solve_triangular(upper, np.hstack([room.gradient.T, unit]), trans="T")
    conditions, moved = both[:, : len(chain.kept)], both[:, len(chain.kept) :]
    basis = la.qr(conditions, mode="economic")[0]
    alone = np.sum(moved**2, axis=0)
    moved = moved - basis @ (basis.T @ moved)
    answers = la.solve_triangular(upper, moved)
    return Freely(a, answers, a[places], answers[places], alone)


def forced(chain: ClosedChain, t: float, y: Array, v: Array) -> tuple[Array, Array, Array]:
    """Accelerations (n,) with this friction, NaN where loops lock; multipliers (r,) and rows (r, n) of the conditions
    in use.
    """
    if chain.dry is None:
        a = chain.accelerate(chain.exact, t, y, v)
        return a, chain.exact.room.multipliers, chain.exact.room.gradient
    with gripped(chain, t, y, v):
        found = settled(chain, t, y, v)
        force = -chain.exact.forces(t, y, v, found.accelerations)
    force[chain.dry.places] += found.given
    gradient, metres = chain.exact.room.gradient.copy(), chain.metres
    multipliers = np.linalg.lstsq((gradient / metres).T, force / metres, rcond=None)[0]
    return found.accelerations, np.asarray(multipliers, dtype=float), gradient
