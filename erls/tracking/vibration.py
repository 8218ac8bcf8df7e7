"""Vibrations of a mechanism whose joints go by a law s(t), next to the pose where they come to rest.

With the planned joints held at the end, links vibrate in modes φ with φᵀ M φ = 1; that joints move excites them,

    η̈ + 2 ζ ω η̇ + ω² η = -Γ s̈,    Γ = φᵀ M_ej Δq,

moves points by u = U η, and asks of the motors M_jᵀ φ η̈ beside what rigid links do. With λ = -ζ ω + i ω_d and
z(t) = ∫ exp(λ (t - τ)) s̈(τ) dτ that is η = -Γ Im z / ω_d, and what swings on after the end has the amplitude
|Γ| |z(T)| / ω_d. For a law of degree 2 n + 1 without damping it is |Γ| (2 n + 1)!! |j_n(x)| / xⁿ, x = ω T / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from erls.maths.so3 import Array
from erls.tracking.laws import Law


class Mode(NamedTuple):
    """A vibration with the joints held.

    Attributes
    ----------
    omega, damping : float
        Without damping [rad/s]; ratio.
    excitation : float
        Γ.
    sway : (p, 3) array
        U of each point, in the world.
    efforts : (j,) array
        M_jᵀ φ of each planned joint.
    """

    omega: float
    damping: float
    excitation: float
    sway: Array
    efforts: Array

    @property
    def reach(self) -> float:
        """Of the point that sways most, |U|."""
        return float(np.linalg.norm(self.sway, axis=1).max(initial=0.0))

    @property
    def most(self) -> float:
        """Largest amplitude of a point that any monotonic law leaves [m], |Γ| |U|."""
        return abs(self.excitation) * self.reach

    def shifted(self, share: float) -> Mode:
        """With another frequency."""
        return self._replace(omega=self.omega * (1 + share))

    @property
    def root(self) -> complex:
        """λ."""
        return complex(-self.damping, np.sqrt(1 - self.damping**2)) * self.omega

    def ending(self, step: float, knots: int) -> Array:
        """(k,) complex amplitude [m of the point that sways most] at the end, by accelerations at even knots."""
        root = self.root
        x = root * step
        fall, first, second = _weights(x)
        later = fall ** np.arange(knots - 2, -1, -1)
        found = np.zeros(knots, dtype=complex)
        found[:-1] += first * later
        found[1:] += second * later
        return np.asarray(found * step * self.excitation / root.imag * self.reach)

    def accelerations(self, step: float, given: Array) -> Array:
        """(k, ...) η̈ from rest, by accelerations s̈ (k, ...) at even knots."""
        from scipy.signal import lfilter  # here: slow to import

        root = self.root
        fall, first, second = _weights(root * step)
        before = np.concatenate([np.zeros_like(given[:1]), given[:-1]])
        z = lfilter([1.0], [1.0, -fall], step * (first * before + second * given), axis=0)
        z = z - fall ** np.arange(len(given)).reshape(-1, *(1,) * (given.ndim - 1)) * step * second * given[0]
        return np.asarray(-self.excitation * (given + (root**2 * z).imag / root.imag))


def _weights(x: complex) -> tuple[complex, complex, complex]:
    """exp(x), and weights of what is linear over a step, at its start and at its end."""
    fall = complex(np.exp(x))
    if abs(x) < 1e-3:  # series: the formulas below would cancel
        return fall, 0.5 + x / 3 + x**2 / 8, 0.5 + x / 6 + x**2 / 24
    whole, late = (fall - 1) / x, (fall - 1 - x) / x**2
    return fall, whole - late, late


def swing(modes: Sequence[Mode], law: Law, uncertainty: float = 0.0) -> float:
    """Largest amplitude of a point after a law [m], all modes in step, their frequencies off by an uncertainty."""
    shares = (-uncertainty, 0.0, uncertainty) if uncertainty else (0.0,)
    found = 0.0
    for mode in modes:
        ends = [m.ending(law.step, len(law.t)) @ law.acceleration for m in map(mode.shifted, shares)]
        found += float(np.abs(ends).max())
    return found


def seen(modes: Sequence[Mode], t: Array, places: Array) -> Array:
    """(m,) complex amplitudes of modes [m], as `Mode.ending` has them, by least squares from what points do.

    Parameters
    ----------
    modes : sequence of Mode
    t : (k,) array
        Even times from the end of a law on [s]; what swings faster than half their number is not seen.
    places : (k, p, 3) array
        Of points [m].
    """
    slow = [k for k, mode in enumerate(modes) if mode.omega * (t[1] - t[0]) < np.pi / 2]
    found = np.zeros(len(modes), dtype=complex)
    if not slow:
        return found
    waves = [np.exp(modes[k].root * (t - t[0])) for k in slow]
    parts = [(modes[k].sway, part) for k, w in zip(slow, waves, strict=True) for part in (w.real, w.imag)]
    columns = [np.multiply.outer(part, sway).ravel() for sway, part in parts]
    rest = [np.broadcast_to(one, places.shape).ravel() for one in np.eye(places[0].size).reshape(-1, *places[0].shape)]
    fitted = np.linalg.lstsq(np.stack([*columns, *rest], 1), places.ravel(), rcond=None)[0]
    cosine, sine = fitted[: 2 * len(slow)].reshape(-1, 2).T
    found[slow] = [-modes[k].reach * complex(b, a) for k, a, b in zip(slow, cosine, sine, strict=True)]
    return found
