"""What a coarse look has to resolve: vibrations that a scene sets off, and the pace of its rigid motion.

A force that jumps by Δf at the start of a run, or at a breakpoint of a drive, sets off a vibration in each mode φ_j of
K φ = ω² M φ, with the amplitude φ_jᵀ Δf / ω_j² = φ_jᵀ M Δa / ω_j². Fast ones of small amplitude need no resolution:
their amplitudes bound what they can do. The others have to be followed for as long as they last without losing more
than a radian of phase, since errors add up along a motion that keeps its own. Where all joints follow prescribed
motions, amplitudes come from the loads along the whole run (`erls.auto.forced`).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la

from erls.auto.forced import Forced, all_prescribed, forced_vibrations
from erls.equations.system import metre_scales
from erls.integrate.base import legs
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism

_RIGID = 1e-9  # of the largest ω²
_JUMPS = 40  # at most so many are looked at
_DECAYED = 3.0  # time constants after which a vibration is gone
_PHASE = 8.0  # ω̄ = ω (1 - (ωh)²/8) of generalized-α, about
_PER_RADIAN = 0.6  # step of a vibration, however short it lasts
_MOVED = 0.1  # rad per step of a prescribed motion


@dataclass(frozen=True)
class Vibrations:
    """What a scene sets off.

    Attributes
    ----------
    omega : (k,) array
        Rising [rad/s]; modes without stiffness left out.
    amplitude : (k,) array
        Of the coordinate that moves points most [m].
    lasting : (k,) array
        Until damping has taken it, or the run is over [s].
    pace : float
        Of free joints: angular velocity, or square root of an angular acceleration [rad/s].
    prescribed : float
        The same of prescribed motions.
    duration : float
    forced : Forced or None
        Where all joints follow prescribed motions: what amplitudes come from.
    """

    omega: Array
    amplitude: Array
    lasting: Array
    pace: float
    prescribed: float
    duration: float
    forced: Forced | None = None


@dataclass(frozen=True)
class Resolution:
    """How finely to look.

    Attributes
    ----------
    step : float
        [s]
    unresolved : float
        What vibrations that it does not follow may add to an error [m].
    calm : bool
        Whether none has to be followed, and no joint moves freely.
    """

    step: float
    unresolved: float
    calm: bool

    def count(self, duration: float, fewest: int) -> int:
        """Number of steps over a run."""
        return max(fewest, math.ceil(duration / self.step)) if self.step > 0 else fewest


def vibrations(system: Any, mechanism: Mechanism, duration: float, y: Array, v: Array) -> Vibrations:
    """Vibrations of a `SecondOrderSystem` that the start (y, v) of a run and its drives set off.

    Raises
    ------
    SimulationError
        SINGULAR_MASS.
    """
    prescribed = reference_pace(mechanism, duration)
    if not system.size:
        none = np.zeros(0)
        return Vibrations(none, none, none, 0.0, prescribed, duration)
    walk = legs(system, (0.0, duration))
    begins = [walk[k] for k in np.unique(np.linspace(0, len(walk) - 1, _JUMPS).astype(int))]
    before = {after.start: leg for leg, after in itertools.pairwise(walk)}
    jumps = []
    for leg in begins:
        jump = np.asarray(system.acceleration(leg.first, y, v), dtype=float)
        if leg.start in before:
            jump = jump - system.acceleration(before[leg.start].last, y, v)
        jumps.append(jump)
    mass = system.mass_matrix(0.0, y)
    stiffness, damping = system.stiffness_and_damping(0.0, y, v)
    values, modes = la.eigh((stiffness + stiffness.T) / 2, mass)
    elastic = values > _RIGID * values[-1]
    values, modes = values[elastic], modes[:, elastic]
    omega, metres = np.sqrt(values), metre_scales(system)
    amplitude = np.linalg.norm(np.array(jumps) @ mass @ modes, axis=0) / values
    amplitude = amplitude * np.abs(metres[:, None] * modes).max(axis=0, initial=0.0)
    forced = forced_vibrations(system, duration, y, v) if all_prescribed(mechanism) and elastic.all() else None
    if forced is not None:
        amplitude = forced.metres(metres)
    decay = np.einsum("ij,ik,kj->j", modes, damping, modes) / 2
    lasting = np.minimum(duration, _DECAYED / np.maximum(decay, _DECAYED / duration))
    free = np.diag(stiffness) == 0
    pace = max(np.sqrt(np.abs(jumps)).max(axis=0)[free].max(initial=0.0), np.abs(v[free]).max(initial=0.0))
    amplitude = np.where(np.isnan(amplitude), np.inf, amplitude)
    return Vibrations(omega, amplitude, lasting, float(pace), prescribed, duration, forced)


def resolution(found: Vibrations, room: float) -> Resolution:
    """Largest step that follows all but fast vibrations whose amplitudes do not matter.

    Parameters
    ----------
    found : Vibrations
    room : float
        What those may add to an error, twice their amplitudes [m].
    """
    unresolved, step = 0.0, math.inf
    for omega, amplitude, lasting in zip(found.omega[::-1], found.amplitude[::-1], found.lasting[::-1], strict=True):
        if unresolved + 2 * amplitude > room:
            step = _followed(omega, lasting)
            break
        unresolved += 2 * amplitude
    step = min(step, _followed(found.pace, found.duration))
    calm = math.isinf(step)
    if found.prescribed > 0:
        step = min(step, _MOVED / found.prescribed)
    return Resolution(float(min(step, found.duration)), float(unresolved), calm)


def _followed(omega: float, lasting: float) -> float:
    """Step that follows a vibration, within a radian of its phase."""
    return min(_PER_RADIAN / omega, math.sqrt(_PHASE / (omega**3 * lasting))) if omega > 0 else math.inf


def reference_pace(mechanism: Mechanism, duration: float) -> float:
    """Largest pace of the motions that drives prescribe or want."""
    largest = 0.0
    drives = [j.drive for j in mechanism.joints] + [k.freedom.drive for k in mechanism.loops if k.freedom is not None]
    for drive in drives:
        for t in np.linspace(0.0, duration, 65).tolist():
            reference = drive.reference(t)
            if reference is not None:
                largest = max(largest, abs(reference[1]), math.sqrt(abs(reference[2])))
    return largest
