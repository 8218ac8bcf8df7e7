"""States beside one state of a system, and what follows from them: tangents of its equations and its small motions.

A system of n coordinates is displaced from a motion y(t) by x(t): y ∘ x, with rates and accelerations that x, ẋ and ẍ
make, to first order. Where conditions Φ = 0 hold, B x = 0 with B(t) = Φ_y along the motion, so that x = N(t) z,

    ẋ = N ż + Ṅ z,    ẍ = N z̈ + 2 Ṅ ż + N̈ z,

and a coordinate s that moves the conditions themselves adds P(t) s with B P = -Φ_s. N and P are those that lie in fixed
planes across the conditions of the instant, which keeps them smooth in time; Ṅ and N̈ are differences of fourth order
along y + τ ẏ + τ² ÿ/2, right to 1e-7, and vanish at rest. Tangents are those of the instant: of a motion that is not
steady they change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
import scipy.linalg as la

from erls.equations.formulation import Formulation
from erls.equations.linearization import WIDE, Linearization, difference_steps, slopes
from erls.maths.so3 import Array

_FAR, _FASTER = 1e-3, 1e-4  # of the size of the mechanism: what rates and accelerations cover between states


class States(NamedTuple):
    """Times (k,), coordinates, rates and accelerations (k, n), as `erls.equations.serial.state_series` takes them."""

    t: Array
    y: Array
    v: Array
    a: Array


class Neighbours(Protocol):
    """States beside one state; rules for the next member:

    1. Displacements x, w, b (k, n) are x, ẋ, ẍ; results need be right to first order in them.
    2. Of the equations and of what runs report, everything is kept that depends on them.
    """

    @property
    def time(self) -> float:
        """Of the state [s]."""

    @property
    def names(self) -> tuple[str, ...]:
        """(n,) of the coordinates."""

    @property
    def metres(self) -> Array:
        """(n,) per unit of each coordinate."""

    @property
    def stiffness(self) -> Array:
        """(n,) of each coordinate by itself, 0 where nothing holds it."""

    @property
    def size(self) -> float:
        """Of what steps of differences are a share of [m]."""

    @property
    def reach(self) -> float:
        """Of the mechanism [m]."""

    @property
    def speed(self) -> Array:
        """(n,) rates of the motion."""

    @property
    def acceleration(self) -> Array:
        """(n,) its accelerations."""

    @property
    def driven(self) -> tuple[float, float]:
        """Speed [m/s] and acceleration [m/s²] of what moves as prescribed, where the coordinates leave it out."""

    def forces(self, x: Array, w: Array, b: Array) -> Array:
        """(k, n) forces out of balance, those of the conditions included, as they are in the state."""

    def mass(self) -> Array:
        """(n, n)"""

    def rows(self) -> Array:
        """(m, n) B, rows independent."""

    def violation(self) -> Array:
        """(m,) Φ."""

    def states(self, x: Array, w: Array, b: Array) -> States:
        """What is displaced."""

    def later(self, tau: float) -> Neighbours:
        """Those of the state that the motion reaches after a short time [s]."""

    def at_rest(self, x: Array, multipliers: Array) -> Neighbours:
        """Those of a displaced state (n,) whose coordinates rest, with multipliers (m,) of the conditions.

        Raises
        ------
        SceneError
            BAD_FIELD: they cannot, since something moves as prescribed.
        """

    @property
    def multipliers(self) -> Array:
        """(m,) of the conditions."""

    def of(self, formulation: Formulation) -> Neighbours:
        """Those of the same state in equations of a mechanism that differs in what drives and loads it."""


@runtime_checkable
class Linearizable(Protocol):
    """A formulation that knows the states beside one of its own."""

    def neighbours(self, t: float, y: Array, v: Array) -> Neighbours:
        """With the accelerations of the equations of motion."""


@runtime_checkable
class Spinnable(Protocol):
    """A formulation whose coordinates are never at rest where a joint turns, but that knows its steady motions."""

    def spinning(self, joint: str, speed: float) -> Neighbours:
        """Of a steady motion about or along a joint [rad/s or m/s], seen from axes that go along."""


@dataclass(frozen=True)
class Moving:
    """Directions W (n, c) that change along a motion, with first and second derivatives."""

    now: Array
    rate: Array
    second: Array

    @classmethod
    def fixed(cls, now: Array) -> Moving:
        """Directions that stay."""
        return cls(now, np.zeros_like(now), np.zeros_like(now))


class Tangents(NamedTuple):
    """δR = M ξ̈ + D ξ̇ + K ξ of coordinates ξ (c,) along moving directions: (n, c) each."""

    mass: Array
    damping: Array
    stiffness: Array


def along(near: Neighbours, directions: Array, order: int) -> Array:
    """(n, c) derivatives of the forces along directions of displacements (order 0) or of their rates (1)."""
    still = np.zeros((1, len(directions)))

    def forces(moved: Array) -> Array:
        rest = np.broadcast_to(still, moved.shape)
        return near.forces(moved, rest, rest) if order == 0 else near.forces(rest, moved, rest)

    return slopes(forces, directions, steps_along(near, directions))


def steps_along(near: Neighbours, directions: Array) -> Array:
    """(c,) steps of `slopes` along directions (n, c)."""
    metres = np.abs(near.metres[:, None] * directions).max(axis=0, initial=0.0)
    stiffness = near.stiffness @ directions**2
    return difference_steps(np.where(metres > 0, metres, 1.0), near.size, stiffness, WIDE)


def tangents(near: Neighbours, directions: Moving) -> Tangents:
    """Of the forces along moving directions."""
    mass, moving = near.mass(), bool(directions.rate.any() or directions.second.any())
    heavy, damped = mass @ directions.now, along(near, directions.now, 1)
    stiff = along(near, directions.now, 0)
    if moving:
        stiff = stiff + along(near, directions.rate, 1) + mass @ directions.second
        damped = damped + 2 * mass @ directions.rate
    return Tangents(heavy, damped, stiff)


class Split(NamedTuple):
    """What conditions leave (n, f), and what they forbid (n, m): together a basis."""

    ways: Array
    across: Array


def split(near: Neighbours) -> Split:
    """Orthonormal in metres; the coordinates themselves where no conditions hold."""
    rows, n = near.rows(), len(near.metres)
    if not len(rows):
        return Split(np.eye(n), np.zeros((n, 0)))
    scaled = rows / near.metres
    q, _ = la.qr((scaled / np.maximum(np.linalg.norm(scaled, axis=1), 1e-300)[:, None]).T)
    whole = q / near.metres[:, None]
    return Split(whole[:, len(rows) :], whole[:, : len(rows)])


def short_times(near: Neighbours) -> tuple[float, ...]:
    """Times for `over_time` beside that of a motion, which covers little within them [s]; none at rest."""
    own = (float(np.abs(near.metres * x).max(initial=0.0)) for x in (near.speed, near.acceleration))
    fast, faster = map(max, own, near.driven)
    if not fast and not faster:
        return ()
    tau = min(
        _FAR * near.size / fast if fast else np.inf, (2 * _FASTER * near.size / faster) ** 0.5 if faster else np.inf
    )
    return (-2 * tau, -tau, tau, 2 * tau)


def over_time(now: Array, beside: Sequence[Array], times: Sequence[float]) -> Moving:
    """Directions from those at `short_times`; they stay where there are none."""
    if not len(times):
        return Moving.fixed(now)
    first, second, third, fourth = beside
    tau = times[2]
    rate = (8 * (third - second) - (fourth - first)) / (12 * tau)
    return Moving(now, rate, (16 * (second + third) - (first + fourth) - 30 * now) / (12 * tau**2))


def ways_of(near: Neighbours) -> Moving:
    """N, (n, f)."""
    basis = split(near)
    times = short_times(near) if basis.across.shape[1] else ()
    none = np.zeros((basis.across.shape[1], 0))
    return over_time(basis.ways, [kept(near.later(tau).rows(), basis, none) for tau in times], times)


def kept(rows: Array, basis: Split, opened: Array) -> Array:
    """(n, f + s) N and P that keep to conditions with these rows (m, n), which motions open by Φ_s (m, s)."""
    found = np.hstack([basis.ways, np.zeros((len(basis.ways), opened.shape[1]))])
    if not len(rows):
        return found
    wrong = np.hstack([rows @ basis.ways, opened])
    return np.asarray(found - basis.across @ np.linalg.solve(rows @ basis.across, wrong))


def small_motions(near: Neighbours) -> Linearization:
    """Of the system by itself, on the ways that conditions leave."""
    ways = ways_of(near)
    found = tangents(near, ways)
    mass, damping, stiffness = (ways.now.T @ part for part in found)
    return Linearization(mass, damping, stiffness, ways.now)
