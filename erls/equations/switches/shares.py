"""Joints at rest because others are: which of them hold, and how they share a load.

With the accelerations a = b + W λ of joints at rest, W positive semidefinite, the forces λ that hold all of them are
not one where W is singular: rigid links do not say which of two joints in one loop bears a load. Taken are those whose
largest share |λ_k| / S_k of what a joint can hold is least, so that nothing breaks away as long as all together can
hold: the theorem of limit analysis, and a linear program. Its dual is the motion that begins where the share comes to 1
(D. C. Drucker, W. Prager, H. J. Greenberg, Q. Appl. Math. 9 (1952) 381-389).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.maths.so3 import Array
from fe_import.model import IntArray

DEPENDENT = 1e-12
"""Of a compliance by itself, what others at rest leave of it: below, a joint rests because they do."""

_IMMOBILE = 1e-10  # of the compliance without loops, what these leave of it
_OWN = 1e-7  # part of a force that has no choice
_MOVES = 1e-7  # of the largest rate of the motion that begins


class Shares(NamedTuple):
    """Forces (m,) that hold joints at rest, and by the sign (m,) where joints begin to move if all is a little more."""

    forces: Array
    motion: Array


def _correlations(compliance: Array, alone: Array) -> tuple[Array, Array]:
    """W with a diagonal of ones, but for joints that loops hold, and the sizes (m,) that were divided by."""
    sizes = np.sqrt(np.maximum(compliance.diagonal(), _IMMOBILE * alone))
    return compliance / sizes / sizes[:, None], sizes


def independent(compliance: Array, alone: Array) -> IntArray:
    """Numbers, in rising order, of joints whose rest is no consequence of that of the others in the list: as many as
    W has ranks, the most movable ones first.

    Parameters
    ----------
    compliance : (m, m) array
        W.
    alone : (m,) array
        Its diagonal, were there no loops.
    """
    if not len(alone):
        return np.zeros(0, dtype=np.int64)
    left, chosen = _correlations(compliance, alone)[0].copy(), list[int]()
    while len(chosen) < len(alone):
        k = int(np.argmax(left.diagonal()))
        if left[k, k] <= DEPENDENT:
            break
        chosen.append(k)
        left -= np.outer(left[k], left[k]) / left[k, k]
        left[k, :] = left[:, k] = 0.0
    return np.array(sorted(chosen), dtype=np.int64)


def following(compliance: Array, alone: Array, held: IntArray, others: IntArray) -> Array:
    """Which of ``others`` (k,) cannot move while joints ``held`` rest, which are independent; W and its diagonal
    without loops as of `independent`.
    """
    scaled = _correlations(compliance, alone)[0]
    across = scaled[np.ix_(held, others)]
    left = scaled[others, others] - np.sum(across * np.linalg.solve(scaled[np.ix_(held, held)], across), axis=0)
    return np.asarray(left <= DEPENDENT)


def shared(compliance: Array, free: Array, static: Array, alone: Array) -> Shares:
    """Forces λ with b + W λ = 0, of the least largest share of ``static``, which may be more than 1.

    Parameters
    ----------
    compliance : (m, m) array
        W.
    free : (m,) array
        b, which some forces balance.
    static : (m,) array
        S > 0.
    alone : (m,) array
        See `independent`.
    """
    scaled, sizes = _correlations(compliance, alone)
    values, vectors = np.linalg.eigh(scaled)
    kept = values > DEPENDENT
    forces = -vectors[:, kept] @ ((vectors[:, kept].T @ (free / sizes)) / values[kept]) / sizes
    ways = vectors[:, ~kept] / sizes[:, None] / static[:, None]  # of shares, along which nothing accelerates
    ways /= np.maximum(np.linalg.norm(ways, axis=0), 1e-300)
    shares = forces / static
    choice = np.abs(ways).max(axis=1, initial=0.0) > _OWN
    motion = -np.sign(np.where(np.abs(shares) >= np.abs(shares).max(initial=0.0), shares, 0.0))
    if choice.any() and shares.any():
        found, rates = _least_largest(shares[choice], ways[choice])
        largest = float(np.abs(found).max())
        shares[choice] = found
        if largest >= np.abs(shares[~choice]).max(initial=0.0):
            motion = np.zeros(len(free))
            motion[choice] = rates
    return Shares(shares * static, motion)


def _least_largest(shares: Array, ways: Array) -> tuple[Array, Array]:
    """Shares s + N z (m,) whose largest is least, and the sign (m,) of the motion that is dual to them.

    Where only one motion is left, u · s is all that matters, and all shares are alike: u · s / Σ |u_k|.
    """
    if ways.shape[1] == len(shares) - 1:
        across = np.linalg.svd(ways)[0][:, -1]
        sides, pushed = np.sign(np.where(np.abs(across) > _OWN, across, 0.0)), float(across @ shares)
        return sides * pushed / np.abs(across).sum(), -sides * np.sign(pushed)
    from scipy.optimize import linprog  # here: only loops at rest need it

    count, choices = ways.shape
    size = float(np.abs(shares).max())
    most = -np.ones((2 * count, 1))
    bounds = np.hstack([np.vstack([ways, -ways]), most])
    right = np.concatenate([-shares, shares]) / size
    goal = np.append(np.zeros(choices), 1.0)
    found = linprog(goal, A_ub=bounds, b_ub=right, bounds=(None, None), method="highs")
    assert found.status == 0, found.message
    duals = -np.asarray(found.ineqlin.marginals)
    rates = duals[count:] - duals[:count]
    moves = np.abs(rates) > _MOVES * np.abs(rates).max()
    return shares + size * (ways @ found.x[:choices]), np.sign(np.where(moves, rates, 0.0))
