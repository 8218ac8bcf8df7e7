"""Internal motion of a mechanism whose drives hold servo conditions: slow ways that move, fast ways that follow.

The internal coordinates are z = Φ_s ζ + Φ_f η, along the slow and the fast right invariant subspaces of ∂z̈/∂z where the
motion starts. ζ obeys its differential equation. η would have its own, whose stiff motions, growing, decaying and
swinging ones, no demand excites and no bounded motion contains: instead η follows,

    η̈(t, ζ, ζ̇, η, η̇) = η̈ₒ,

with η̇ = η̈ₒ = 0 at first (static), then with the rates and accelerations that η was found to have: each such pass
takes off two more orders of what is slow over what is fast. Where links bend far, axial and bending ways couple so that
the number of fast motions that grow changes on the way, and what they all do could not be said at the ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from erls.inverse.conditions import Demand
from erls.inverse.servoed import Servoed, States
from erls.inverse.two_point import interpolated
from erls.maths.so3 import Array
from fe_import.model import IntArray


class Basis(NamedTuple):
    """Φ_s (m, e) and Φ_f (m, m - e), and the rows Ψ of their inverse."""

    slow: Array
    fast: Array
    to_slow: Array
    to_fast: Array


def basis_of(tangent: Array, scales: Array, limit: float) -> Basis:
    """From ∂z̈/∂z (m, m); what is slower than ``limit`` [rad/s] is slow.

    Parameters
    ----------
    tangent : (m, m) array
    scales : (m,) array
        Units of z.
    limit : float
    """
    m = len(scales)
    scaled = tangent * scales / scales[:, None]

    def slow(real: float, imaginary: float) -> bool:
        return abs(complex(real, imaginary)) < limit**2

    if not m:
        return Basis(*(np.zeros((0, 0)),) * 4)
    _, first, count = la.schur(scaled, output="real", sort=slow)
    _, second, _ = la.schur(scaled, output="real", sort=lambda real, imaginary: not slow(real, imaginary))
    whole = np.hstack([first[:, :count], second[:, : m - count]])
    back = np.linalg.inv(whole) / scales
    whole = whole * scales[:, None]
    return Basis(whole[:, :count], whole[:, count:], back[:count], back[count:])


class _Local(NamedTuple):
    """Derivatives of what is missing: (k, n + p, n + p) by what belongs to a knot alone, (k, n + p, 2 e) by (ζ, ζ̇)."""

    own: Array
    states: Array


class Internal:
    """The differential equation of ζ at the knots of a motion; a `erls.inverse.two_point.Field`.

    What belongs to a knot alone (ζ̈, s̈, efforts, η) is iterated together with the states, and enters as its forces do:
    solved for explicitly, z̈ = f(t, z, ż) would bend far more sharply than the forces that it follows from.

    Parameters
    ----------
    servoed : Servoed
    demand : Demand
        At all knots.
    near : (k, n) array
        Places next to which joint coordinates are looked for.
    basis : Basis
    """

    def __init__(self, servoed: Servoed, demand: Demand, near: Array, basis: Basis) -> None:
        self.servoed, self.demand, self.basis = servoed, demand, basis
        count, p = len(near), len(servoed.dependent)
        self._near = near
        self._eta = near[:, servoed.internal] @ basis.to_fast.T
        fast = self._eta.shape
        self._rate, self._acceleration = np.zeros(fast), np.zeros(fast)
        self._accelerations, self._efforts = np.zeros((count, servoed.tree.size)), np.zeros((count, p))
        self._local: _Local | None = None
        self._left = np.zeros((count, servoed.tree.size + p))
        self.states = States(near, np.zeros_like(near), self._accelerations, self._efforts)

    @property
    def size(self) -> int:
        """Number of states (ζ, ζ̇)."""
        return 2 * int(self.basis.slow.shape[1])

    def begin(self, states: States) -> None:
        """Go on from states that are known."""
        self._near, self._accelerations, self._efforts = states.y, states.a, states.efforts
        fast, own = self.basis.to_fast.T, self.servoed.internal
        self._eta, self._rate, self._acceleration = (x[:, own] @ fast for x in states[:3])

    def look(self, x: Array) -> None:
        """Take in states (k, 2 e)."""
        e, own = self.size // 2, self.servoed.internal
        slow, fast = self.basis.slow, self.basis.fast
        y = self._near.copy()
        y[:, own] = x[:, :e] @ slow.T + self._eta @ fast.T
        w = x[:, e:] @ slow.T + self._rate @ fast.T
        self.states = self.servoed.at(self.demand, y, w, self._accelerations, self._efforts)
        self._near = self.states.y
        self._left = self.servoed.missing(self.demand, self.states)

    def slopes(self, x: Array) -> Array:
        """(ζ̇, ζ̈), corrected for what is missing."""
        e = self.size // 2
        assert self._local is not None
        more = -np.linalg.solve(self._local.own, self._left[..., None])[:, :e, 0]
        now = self._accelerations[:, self.servoed.internal] @ self.basis.to_slow.T
        return np.hstack([x[:, e:], now + more])

    def learn(self, knots: IntArray) -> None:
        """Derivatives at some knots, linear between them."""
        part = self.servoed.tangents(self.demand.part(knots), States(*(x[knots] for x in self.states)))
        z, s, (slow, fast, *_) = self.servoed.internal, self.servoed.dependent, self.basis
        by = part.accelerations
        own = np.concatenate([by[:, :, z] @ slow, by[:, :, s], part.efforts, part.places @ fast], axis=2)
        states = np.concatenate([part.places @ slow, part.rates @ slow], axis=2)
        every = np.arange(len(self.demand.t))
        self._local = _Local(*(interpolated(self.demand.t, knots, x)(every) for x in (own, states)))

    def tangents(self) -> Array:
        """(k, 2 e, 2 e) ∂(ζ̇, ζ̈)/∂(ζ, ζ̇), fast ways following."""
        assert self._local is not None
        e = self.size // 2
        found = -np.linalg.solve(self._local.own, self._local.states)[:, :e]
        return np.concatenate([np.broadcast_to(np.eye(e, 2 * e, e), found.shape), found], axis=1)

    def move(self, step: Array) -> float:
        """Let what belongs to the knots follow a step of the states; how far fast ways go [m]."""
        assert self._local is not None
        left = self._left + np.einsum("kij,kj->ki", self._local.states, step)
        found = -np.linalg.solve(self._local.own, left[..., None])[..., 0]
        e, p = self.size // 2, len(self.servoed.dependent)
        self._accelerations = self._accelerations.copy()
        self._accelerations[:, self.servoed.internal] += found[:, :e] @ self.basis.slow.T
        self._accelerations[:, self.servoed.dependent] += found[:, e : e + p]
        self._efforts = self._efforts + found[:, e + p : e + 2 * p]
        eta = found[:, e + 2 * p :]
        self._eta = self._eta + eta
        return self._far(eta)

    def _far(self, eta: Array) -> float:
        own = self.servoed.metres[self.servoed.internal]
        return float(np.abs(eta @ self.basis.fast.T * own).max(initial=0.0))

    def deflection(self) -> float:
        """Of elastic and passive coordinates, the largest [m]."""
        own = self.servoed.internal
        return float(np.abs(self.states.y[:, own] * self.servoed.metres[own]).max(initial=0.0))

    def refine(self) -> bool:
        """Let fast ways have the rates and accelerations that they were found to have; False where there are none."""
        t, fast = self.demand.t, self.basis.fast
        if not fast.shape[1] or len(t) < 3:
            return False
        self._rate = np.asarray(np.gradient(self._eta, t, axis=0, edge_order=2))
        before, self._acceleration = self._acceleration, second_difference(t, self._eta)
        self._accelerations = self._accelerations.copy()
        self._accelerations[:, self.servoed.internal] += (self._acceleration - before) @ fast.T
        return True

    def part(self, rows: IntArray, before: Internal | None = None) -> Internal:
        """At some knots; accelerations, efforts and fast ways to begin with are those of ``before``, if it is given."""
        found = Internal(self.servoed, self.demand.part(rows), self._near[rows], self.basis)
        found._rate, found._acceleration = self._rate[rows], self._acceleration[rows]
        source, at = (self, rows) if before is None else (before, np.arange(len(rows)))
        found._near = source._near[at]
        found._eta, found._efforts = source._eta[at], source._efforts[at]
        found._accelerations = source._accelerations[at]
        if before is not None:
            more = found._acceleration - before._acceleration[at]
            found._accelerations = found._accelerations.copy()
            found._accelerations[:, self.servoed.internal] += more @ self.basis.fast.T
        return found

    def put(self, rows: IntArray, part: Internal) -> None:
        """Take over what `part` found."""
        for name in ("_near", "_eta", "_efforts", "_accelerations"):
            whole = getattr(self, name).copy()
            whole[rows] = getattr(part, name)
            setattr(self, name, whole)
        self.states = States(*self._put(rows, part.states))

    def _put(self, rows: IntArray, states: States) -> list[Array]:
        whole = [x.copy() for x in self.states]
        for one, found in zip(whole, states, strict=True):
            one[rows] = found
        return whole


def second_difference(t: Array, values: Array) -> Array:
    """(k, ...) second derivatives at knots t (k,), those at the ends like their neighbours'."""
    before, after = np.diff(t)[:-1, None], np.diff(t)[1:, None]
    slopes = np.diff(values, axis=0) / np.diff(t)[:, None]
    found = 2 * np.diff(slopes, axis=0) / (before + after)
    return np.concatenate([found[:1], found, found[-1:]])


def without_internal(servoed: Servoed, demand: Demand, y: Array) -> States:
    """Accelerations and efforts at places (k, n) where nothing moves inside, conditions held."""
    internal, still = Internal(servoed, demand, y, Basis(*(np.zeros((0, 0)),) * 4)), np.zeros((len(y), 0))
    internal.look(still)
    internal.learn(np.arange(len(y)))
    internal.move(still)
    internal.look(still)
    return internal.states
