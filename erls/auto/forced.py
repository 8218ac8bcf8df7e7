"""Vibrations that prescribed motions set off, mode by mode, without steps that would have to follow them.

Where all joints follow prescribed motions, the loads f(t) = -R(t, 0, 0, 0) on undeformed links are known beforehand. A
mode φ of K φ = ω² M φ with the coordinate ξ deflects by s = φᵀ f / ω² statically; what it vibrates, d = ξ - s, is free
between knots of s(t), taken as linear there:

    D(t) = (d - i ḋ/ω) e^(-iωt) changes at a knot by (-Δs + i Δṡ/ω) e^(-iωt),

from (ξ₀ - s₀) - i (ξ̇₀ - ṡ₀)/ω at the start. |D| is the amplitude: exact for linear links without damping in one
configuration, and resonance is in it. Modes are those of a few configurations along the run, each taken for all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la

from erls.integrate.base import Leg, legs
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism

KNOTS = 512  # of s(t), all legs together
_FEWEST, _MOST = 8, 4096  # in a leg; all together
_STRAIGHT = 3e-4  # of the largest deflection: how far s(t) may be from a straight line between knots
CONFIGURATIONS = 5


@dataclass(frozen=True)
class Forced:
    """Amplitudes in c configurations, of n modes each.

    Attributes
    ----------
    t : (k,) array
        Knots of the loads.
    at : (c,) array
        Times of the configurations.
    omega : (c, n) array
        [rad/s]
    shapes : (c, n, n) array
        φ in columns, mass-orthonormal.
    amplitude : (c, n) array
        Of ξ.
    """

    t: Array
    at: Array
    omega: Array
    shapes: Array
    amplitude: Array

    def metres(self, scales: Array) -> Array:
        """(n,) how far they move points at most, given the scales of coordinates (n,) [m]."""
        found = self.amplitude * np.abs(scales[:, None] * self.shapes).sum(axis=1)
        return np.asarray(np.where(np.isnan(found), np.inf, found).max(axis=0))


def all_prescribed(mechanism: Mechanism) -> bool:
    """Whether nothing but links can move on its own."""
    return not mechanism.loops and all(joint.drive.prescribed for joint in mechanism.joints)


def forced_vibrations(system: Any, duration: float, y: Array, v: Array) -> Forced | None:
    """What prescribed motions set off over a run; None where loads change too fast for a few thousand knots.

    Parameters
    ----------
    system : SecondOrderSystem
        With ``residual``; its coordinates are those of links.
    duration : float
        [s]
    y, v : (n,) arrays
        Where the run starts.
    """
    loads = _loads(system, legs(system, (0.0, duration)))
    if loads is None:
        return None
    knots = np.concatenate([t for t, _ in loads])
    at = knots[np.linspace(0, len(knots) - 1, CONFIGURATIONS).astype(int)]
    rest = np.zeros(system.size)
    stiffness = system.stiffness_and_damping(0.0, rest, rest)[0]
    values, shapes, amplitudes = [], [], []
    for t in at.tolist():
        mass = system.mass_matrix(t, rest)
        squares, modes = la.eigh((stiffness + stiffness.T) / 2, mass)
        weighted = modes.T @ mass
        values.append(np.sqrt(np.maximum(squares, 0.0)))
        shapes.append(modes)
        amplitudes.append(_amplitudes(loads, squares, modes, weighted @ y, weighted @ v))
    return Forced(knots, at, np.array(values), np.array(shapes), np.array(amplitudes))


def _loads(system: Any, walk: Sequence[Leg]) -> list[tuple[Array, Array]] | None:
    """Knots (k,) and f (k, n) of each leg; None where too many would be needed."""
    rest = np.zeros(system.size)
    flexibility = la.inv(system.stiffness_and_damping(0.0, rest, rest)[0])
    count, left = max(_FEWEST, KNOTS // len(walk)), _MOST
    result: list[tuple[Array, Array]] = []
    for leg in walk:
        points = count
        while points <= left:
            t = np.linspace(leg.first, leg.last, points + 1 - points % 2)
            f = -np.array([system.residual(x, rest, rest, rest) for x in t.tolist()])
            off = np.abs((f[1:-1:2] - (f[:-2:2] + f[2::2]) / 2) @ flexibility) / 4  # with twice as many knots
            if off.max() <= _STRAIGHT * np.abs(f @ flexibility).max():
                break
            points *= 2
        else:
            return None
        result.append((t, f))
        left -= points
    return result


def _amplitudes(loads: list[tuple[Array, Array]], squares: Array, modes: Array, place: Array, rate: Array) -> Array:
    """(n,) largest |D| of each mode from its coordinate and rate at the start."""
    omega = np.sqrt(squares)
    kicks, times = [], []
    for t, f in loads:
        s = f @ modes / squares
        slopes = np.diff(s, axis=0) / np.diff(t)[:, None]
        kick = 1j * np.diff(slopes, axis=0, prepend=rate[None]) / omega
        kick[0] -= s[0] - place
        kicks.append(kick)
        times.append(t[:-1])
        place, rate = s[-1], slopes[-1]
    turned = np.vstack(kicks) * np.exp(-1j * omega * np.concatenate(times)[:, None])
    return np.asarray(np.abs(np.cumsum(turned, axis=0)).max(axis=0))
