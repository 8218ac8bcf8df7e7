"""Error of steps of generalized-α over a whole run, from the distance to a run of the same with larger steps.

With steps in one proportion r everywhere, errors over the whole run, phase and drift included, are in the proportion r²
as long as they are small, so that the error of the finer run is their distance over r² − 1 (L. F. Richardson). Three
things break that, and all would make the distance say too little:

- vibrations whose phase the coarser run has lost, or that it has damped away, are as far apart as they are large. What
  a step makes of a vibration is known (`erls.integrate.alpha_spectrum`), so the distance is taken apart by frequency,
  and each band counts by what the two runs have made of it: min(|z_f|, 1.5) / min(|z_c − z_f|, 1), with z the logarithm
  of the error so far as a factor. For well resolved bands that is 1/(r² − 1). Beyond that an error is not more than
  what the finer run itself does there times min(|z_f|, 1.5): the coarser one may vibrate where nothing does.
- rounding, which smaller steps make larger: each position that a condition is off by is an acceleration over h². What
  two runs are more apart than distances before have foretold adds to the error.
- points that are apart by a good part of their own motion (disturbances that grow, phases of turning bodies) have no
  proportion any more: there the distance itself is the error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from erls.integrate.alpha_spectrum import ComplexArray, step_errors
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from fe_import.model import IntArray

STATED = 2.5
"""Errors are stated this much larger than found."""

_SAMPLES = 1025  # of a run: what is faster than these appears slower, and counts for less
_LEAST_RATIO = 1.2  # of steps: runs with more equal ones say nothing of each other
_SMOOTHINGS = 3  # of a band: what it takes in of slower motion falls with the sixth power of the frequency
_FEWEST = 8  # times that make a band
_PHASE_LOST = 1.5  # error of a vibration without phase, of its amplitude: 2 where both are opposite
_PROPORTION_HOLDS = 0.02  # distance, of the size of a point's motion
_PROPORTION_LOST = 0.2
_STANDS = 0.2  # of the largest motion: what moves less is measured by that


class Bands(NamedTuple):
    """The distance of two runs, taken apart.

    Attributes
    ----------
    t : (k,) array
        Times [s].
    steps : (k,) array
        Of the finer run so far.
    errors, coarser : (b, k) complex arrays
        Logarithms z_f and z_c of what the finer and the coarser run have made of a vibration in each band.
    phases : (b,) array
        θ per step of the finer run, the mean of each band.
    fast, vibrations, slow : (b, k, p), (b, k, p), (k, p) arrays
        Distance of points in each band, amplitude of the finer run there, and distance in what is slower [m].
    sizes : (p,) array
        Of the motion of each point [m].
    ratio, spectral_radius : float
        Of steps of the coarser run to those of the finer one; ρ∞.
    """

    t: Array
    steps: Array
    errors: ComplexArray
    coarser: ComplexArray
    phases: Array
    fast: Array
    vibrations: Array
    slow: Array
    sizes: Array
    ratio: float
    spectral_radius: float


class Track(NamedTuple):
    """Points of a run: times (k,) of its steps, places and their derivatives (k, p, 3)."""

    t: Array
    x: Array
    v: Array
    a: Array

    def at(self, t: Array) -> Array:
        """(m, p, 3) places between steps."""
        x, v, a = (part.reshape(len(self.t), -1) for part in (self.x, self.v, self.a))
        found = hermite(self.t, x, v, a, np.clip(t, self.t[0], self.t[-1]))[0]
        return found.reshape(len(t), *self.x.shape[1:])


def samples(t: Array) -> IntArray:
    """Numbers of some knots, evenly over all."""
    return np.unique(np.linspace(0, len(t) - 1, min(len(t), _SAMPLES)).astype(np.int64))


def step_ratio(t: Array, coarser: Array) -> float:
    """How many times as large the steps of one run are than those of another, as errors feel it: both may have been
    halved where Newton's method failed.

    Parameters
    ----------
    t, coarser : (k,), (m,) arrays
        Knots of both, all of them.
    """
    cubes = [float(np.sum(np.diff(x) ** 3)) for x in (t, coarser[coarser <= t[-1]])]
    return max(float(np.sqrt(cubes[1] / cubes[0])), _LEAST_RATIO) if cubes[0] else _LEAST_RATIO


def distance_bands(t: Array, places: Array, coarser: Array, steps: int, ratio: float, spectral_radius: float) -> Bands:
    """Take the distance of two runs apart, down to the first octave in which proportions hold to the end.

    Parameters
    ----------
    t : (k,) array
        Knots of the finer run, or a selection; where a time stands twice, the first counts.
    places, coarser : (k, p, 3) arrays
        Points in both runs [m].
    steps : int
        Of the finer run.
    ratio : float
        Steps of the coarser run over those of the finer one.
    spectral_radius : float
        ρ∞ of both.
    """
    kept = np.append(True, np.diff(t) > 0)
    t, places, rest = t[kept], places[kept], (places - coarser)[kept]
    sampled = steps / max(len(t) - 1, 1)  # steps from time to time
    own = places - places.mean(axis=0)
    bands, phases, sizes = [], [], []
    for j in range(int(np.log2(max(len(t) / _FEWEST, 1)))):
        if steps * np.abs(np.subtract(*_made(np.array([np.pi / sampled / 2**j]), ratio, spectral_radius)))[0] < 1:
            break
        fast, vibration = _fast(rest, 1 << j), _fast(own, 1 << j)
        bands.append(np.linalg.norm(fast, axis=2))
        phases.append(_phase(fast) / sampled)
        sizes.append(np.sqrt(np.maximum(2 * _smoothed(np.sum(vibration**2, axis=2), 1 << j), 0.0)))
        rest, own = rest - fast, own - vibration
    found, so_far = np.array(phases), np.linspace(0.0, steps, len(t))
    errors, lost = (x[:, None] * so_far for x in _made(found, ratio, spectral_radius))
    apart, vibrations = (np.array(x).reshape(-1, *rest.shape[:2]) for x in (bands, sizes))
    slow, reach = np.linalg.norm(rest, axis=2), np.linalg.norm(np.ptp(places, axis=0), axis=1)
    return Bands(t, so_far, errors, lost, found, apart, vibrations, slow, reach, ratio, spectral_radius)


def _fast(x: Array, apart: int) -> Array:
    """What of (k, ...) values changes within ``apart`` places."""
    for _ in range(_SMOOTHINGS):
        x = x - _smoothed(x, apart)
    return x


def _made(phases: Array, ratio: float, spectral_radius: float) -> list[ComplexArray]:
    """(b,) what the finer run and the coarser one make of vibrations, per step of the finer one."""
    return [step_errors(spectral_radius, x * phases) / x for x in (1.0, ratio)]


def _phase(band: Array) -> float:
    """Mean phase from one time to the next in a band (k, p, 3) [rad]: 2 - 2 cos θ is the share of differences."""
    size = float(np.sum(band[1:] ** 2))
    share = float(np.sum(np.diff(band, axis=0) ** 2)) / size if size else 4.0
    return float(np.arccos(1 - min(share, 4.0) / 2))


def errors_over_time(bands: Bands, finer: float = 1.0, beyond: float = 0.0) -> Array:
    """(k, p) errors up to each time [m], of the finer run or, as foretold, of one with steps as many times finer.

    ``beyond``: see `erls.integrate.base.Companion`.
    """
    resolved = 1 / (bands.ratio**2 - 1) / finer**2
    own = bands.errors
    if finer != 1:
        own = finer * step_errors(bands.spectral_radius, bands.phases / finer)[:, None] * bands.steps
    known, lost = np.clip(np.abs(bands.coarser - bands.errors), 1e-300, 1.0), np.minimum(np.abs(own), _PHASE_LOST)
    by_distance = np.clip(lost / known, resolved, _PHASE_LOST)[:, :, None] * bands.fast
    by_motion = lost[:, :, None] * bands.vibrations + resolved * bands.fast
    fast = np.sqrt(np.sum(np.minimum(by_distance, by_motion) ** 2, axis=0))
    slow, share = bands.slow, _parted(bands)
    rounding = beyond * slow / max(float(slow.max(initial=0.0)), 1e-300)
    return np.asarray(np.maximum.accumulate(slow * (resolved * (1 - share) + share) + fast + rounding, axis=0))


def parted_at(bands: Bands) -> float:
    """Time from which on points have parted, so that errors are in no proportion; infinite where they have not [s]."""
    parted = np.flatnonzero(_parted(bands).max(axis=1, initial=0.0) > 0)
    return float(bands.t[parted[0]]) if len(parted) else np.inf


def factor_needed(bands: Bands, tolerance: float, most: float, until: float = np.inf) -> float:
    """How many times finer steps must be for errors within ``tolerance`` [m] up to some time [s], at least 1 and at
    most ``most``.
    """
    last = int(np.searchsorted(bands.t, until))

    def enough(factor: float) -> bool:
        return bool(errors_over_time(bands, factor)[:last].max(initial=0.0) <= tolerance)

    return _smallest(enough, most)


def _parted(bands: Bands) -> Array:
    """(k, p) how much of a proportion between the errors of two runs is lost, from 0 to 1."""
    sizes = np.maximum(bands.sizes, max(_STANDS * bands.sizes.max(initial=0.0), 1e-300))
    apart = bands.slow / sizes
    return np.asarray(np.clip((apart - _PROPORTION_HOLDS) / (_PROPORTION_LOST - _PROPORTION_HOLDS), 0.0, 1.0))


def _smallest(enough: Callable[[float], bool], most: float) -> float:
    factor = 1.0
    while factor < most and not enough(factor):
        factor *= 1.2
    return min(factor, most)


def _smoothed(x: Array, apart: int) -> Array:
    """Means of (k, ...) values with weights 1, 4, 6, 4, 1 at distances ``apart``; ends are continued as if by a point
    reflection, which keeps slopes.
    """
    width = 2 * apart
    before, after = 2 * x[:1] - x[width:0:-1], 2 * x[-1:] - x[-2 : -width - 2 : -1]
    long = np.concatenate([before, x, after])
    k = len(x)
    parts = (long[m * apart : m * apart + k] for m in range(5))
    return np.asarray(sum(w * part for w, part in zip((1, 4, 6, 4, 1), parts, strict=True)) / 16)
