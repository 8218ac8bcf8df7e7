"""What forces and conditions of nodal systems change with parameters, at the knots of a run.

Constants of a system lie in one array; a parameter moves it along a line, as far as derivatives go. Where forces are
linear along it (dimensions of sections, densities, moduli), one evaluation at its far end and that of the run itself
tell the derivative to rounding; where they are quadratic, two evaluations do. Some knots tell whether they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.maths.so3 import Array
from erls.sensitivity.variants import LINEAR, ROUNDING, Difference

_TIMELESS = ("links", "gravity", "base", "payloads", "contacts", "points")
"""Tables on which what depends on time alone does not depend, unless a drive is fed forward."""


@dataclass(frozen=True)
class Knots:
    """Of a leg, as kernels take them: times (k,) at which forces are asked for, samples, configurations, twists (k, n),
    accelerations and multipliers (k, n + m).
    """

    t: Array
    samples: Array
    q: Array
    v: Array
    a: Array

    def part(self, rows: slice | Array) -> Knots:
        """Some of them."""
        return Knots(self.t[rows], self.samples[rows], self.q[rows], self.v[rows], self.a[rows])


class Residuals:
    """Forces and conditions out of balance of a system, at other constants."""

    def __init__(self, system: NodalSystem) -> None:
        flat = system.flat
        self.system, self.reals, self.integers = system, flat.reals, flat.integers
        self.scratch = flat.scratch.copy()
        self._length = system.size + system.constraints

    def at(self, reals: Array, knots: Knots, samples: Array | None = None) -> Array:
        """(k, n + m)"""
        from erls.sensitivity.nodal_kernels import residuals  # here: it is compiled

        out = np.empty((len(knots.q), self._length + 2))
        given = knots.samples if samples is None else samples
        residuals(reals, self.integers, self.scratch, given, knots.q, knots.v, knots.a, out)
        return out[:, : self._length]


@dataclass(frozen=True)
class Slope:
    """∂R/∂p and ∂Φ/∂p as a sum: weights of constants, of systems in whose samples they are evaluated (None: those of
    the run), and of the run itself.
    """

    terms: tuple[tuple[float, Array, NodalSystem | None], ...]
    own: float = 0.0

    def at(self, known: Residuals, knots: Knots, own: Array) -> Array:
        """(k, n + m), ``own`` being the same of the run itself."""
        total = self.own * own
        for weight, reals, system in self.terms:
            samples = None if system is None else system.samples(knots.t)
            total = total + weight * known.at(reals, knots, samples)
        return np.asarray(total)


def slopes_of(known: Residuals, differences: Sequence[Difference], sample: Knots) -> list[Slope]:
    """By each parameter, with as few evaluations as some knots allow."""
    own = known.at(known.reals, sample)
    return [_slope(known, difference, sample, own) for difference in differences]


def _slope(known: Residuals, difference: Difference, sample: Knots, own: Array) -> Slope:
    variants, size = difference.variants, difference.parameter.size
    systems = [variant.formulation.system for variant in variants]
    timeless = _timeless(difference)
    whole = Slope(
        tuple(
            (variant.weight, system.flat.reals, None if timeless else system)
            for variant, system in zip(variants, systems, strict=True)
        )
    )
    if not timeless:
        return whole
    constants = [np.where(np.isfinite(system.flat.reals), system.flat.reals, 0.0) for system in systems]
    along = size * sum(variant.weight * part for variant, part in zip(variants, constants, strict=True))
    if not along.any():
        return Slope(())
    ahead, back = known.reals + along, known.reals - along
    with np.errstate(all="ignore"):  # a line leads anywhere
        expected = whole.at(known, sample, own)
        rounding = ROUNDING * np.abs(own).max(initial=0.0) / size
        for few in (Slope(((1 / size, ahead, None),), -1 / size), _central(ahead, back, size)):
            apart = np.abs(few.at(known, sample, own) - expected).max(initial=0.0)
            if apart <= LINEAR * np.abs(expected).max(initial=0.0) + rounding:
                return few
    return whole


def _central(ahead: Array, back: Array, size: float) -> Slope:
    return Slope(((0.5 / size, ahead, None), (-0.5 / size, back, None)))


def _timeless(difference: Difference) -> bool:
    """Whether motions, load factors and torques besides are those of the run."""
    mechanism = difference.variants[0].formulation.mechanism
    led = any(joint.drive.feed_forward for joint in mechanism.joints)
    return difference.parameter.key.split(".")[0] in _TIMELESS and not led
