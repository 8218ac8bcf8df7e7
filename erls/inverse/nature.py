"""What the internal dynamics of an inversion are, by their roots: the transmission zeros from drives to conditions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from erls.equations.linearization import Linearization, roots
from erls.errors import Cause, SimulationError
from erls.inverse.two_point import grows, rests
from erls.maths.so3 import Array

_ON_POLE = 1e-3  # of a pole: distance of a root of a motion that drives do not make, or conditions do not see
_STILL = 0.1  # rad over the whole run: a root that is zero


class Nature(NamedTuple):
    """Internal dynamics where a motion starts.

    Attributes
    ----------
    zeros : (2 m,) complex array
        Roots of all internal motions, slow ones first [1/s].
    limit : float
        Motions faster than this follow [rad/s].
    growing : (g,) complex array
        Those that grow, slow ones first.
    ringing : (s,) complex array
        Slow ones that neither grow nor decay, although drives make them and conditions see them.
    excited : float
        Motions up to this belong to what is demanded [rad/s].
    """

    zeros: Array
    limit: float
    growing: Array
    ringing: Array
    excited: float

    @property
    def minimum_phase(self) -> bool:
        """Whether nothing grows, so that integrating forward is right."""
        return not len(self.growing)

    @property
    def words(self) -> str:
        """For reports."""
        if self.minimum_phase:
            return "minimum phase: internal motions decay or rest, and are integrated forward"
        slowest = shown(self.growing[0])
        if abs(self.growing[0]) >= self.limit:
            return f"non-minimum phase: what grows is fast ({slowest} 1/s), and follows what is demanded"
        return f"non-minimum phase: internal motions grow ({slowest} 1/s), and the bounded one is taken"

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know."""
        if not len(self.ringing):
            return ()
        hz = ", ".join(dict.fromkeys(f"{abs(root) / (2 * math.pi):.3g}" for root in self.ringing.tolist()))
        text = f"internal motions of {hz} Hz neither grow nor decay"
        return (f"{text}: they start at rest, and what is excited rings on",)

    def refuse(self, forward: bool, force: bool) -> None:
        """Refuse what has no bounded solution, and integration forward of what grows.

        Raises
        ------
        SimulationError
            UNDAMPED_INVERSE, UNSTABLE_INVERSE: name the zero.
        """
        if len(self.ringing) and abs(self.ringing[0]) < self.excited:
            raise SimulationError(
                Cause.UNDAMPED_INVERSE,
                "internal motions neither grow nor decay, so that none of them is the bounded one",
                where="zeros of the linear model at the start",
                value=f"{shown(self.ringing[0])} 1/s",
                remedy="give joints or links some damping, or demand another point",
            )
        if forward and len(self.growing) and not force:
            raise SimulationError(
                Cause.UNSTABLE_INVERSE,
                "integrated forward, internal motions grow without bounds",
                where="zeros of the linear model at the start",
                value=f"{shown(self.growing[0])} 1/s",
                remedy="leave out --method forward, or see it diverge with --force",
            )


def nature_of(
    zeros: Array, motions: Linearization, limit: float, excited: float, duration: float
) -> Nature:
    """From all roots of the internal dynamics.

    Parameters
    ----------
    zeros : (2 m,) complex array
    motions : Linearization
        Small motions of the mechanism with its unknown drives at rest, whose roots are its poles.
    limit, excited : float
        See `Nature` [rad/s].
    duration : float
        Of the run [s].
    """
    ordered = zeros[np.lexsort((-zeros.imag, -zeros.real, np.round(np.abs(zeros), 6)))]
    slow = np.abs(ordered) < limit
    poles = roots(motions) if motions.size else np.zeros(0, dtype=complex)
    apart = np.abs(ordered[:, None] - poles).min(axis=1, initial=math.inf) > _ON_POLE * np.abs(ordered)
    still = np.abs(ordered) * duration < _STILL
    ringing = ordered[slow & rests(ordered) & (apart | still)]
    return Nature(ordered, limit, ordered[grows(ordered)], ringing, excited)


def shown(root: complex) -> str:
    """A root, and its conjugate where it has one."""
    return f"{root.real:+.4g}" + (f" ± {abs(root.imag):.4g} i" if root.imag else "")
