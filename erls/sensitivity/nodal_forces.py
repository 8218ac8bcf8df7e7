"""What forces and conditions of nodal systems change with parameters, at the knots of a run.

Constants of a system lie in one array; a parameter moves it along a line, as far as derivatives go. Forces are linear
in stiffness and inertia of sections, in bodies and in loads, whatever dimensions do to these: one evaluation at the far
end of the line and that of the run itself tell the derivative to rounding. Else forces at other values of the parameter
do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.maths.so3 import Array
from erls.sensitivity.variants import Difference

_TIMELESS = ("links", "gravity", "base", "payloads", "contacts", "points")
"""Tables on which what depends on time alone does not depend, unless a drive is fed forward."""
_LINEAR, _WEIGHT = {"beam_stiffness", "beam_inertia", "bodies", "loads"}, "gravity"
"""Constants in all of which together forces are linear, and one in which they are alone: it multiplies inertia."""


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


def slope_of(known: Residuals, difference: Difference) -> Slope:
    """By a parameter, with as few evaluations as what it changes allows."""
    variants, size = difference.variants, difference.parameter.size
    systems: list[NodalSystem] = [variant.formulation.system for variant in variants]
    timeless, changed = _timeless(difference), _changed(systems)
    if timeless and not changed:
        return Slope(())
    if timeless and (changed <= _LINEAR or changed == {_WEIGHT}):
        constants = [np.where(np.isfinite(system.flat.reals), system.flat.reals, 0.0) for system in systems]
        along = size * sum(variant.weight * part for variant, part in zip(variants, constants, strict=True))
        return Slope(((1 / size, known.reals + along, None),), -1 / size)
    given = [None if timeless else system for system in systems]
    whole = zip(variants, systems, given, strict=True)
    return Slope(tuple((variant.weight, system.flat.reals, samples) for variant, system, samples in whole))


def _changed(systems: Sequence[NodalSystem]) -> set[str]:
    """Names of constants that differ."""
    first, *others = (system.model._asdict() for system in systems)
    return {
        name
        for name, values in first.items()
        if not all(np.array_equal(values, other[name], equal_nan=True) for other in others)
    }


def _timeless(difference: Difference) -> bool:
    """Whether motions, load factors and torques besides are those of the run."""
    mechanism = difference.variants[0].formulation.mechanism
    led = any(joint.drive.feed_forward for joint in mechanism.joints)
    return difference.parameter.key.split(".")[0] in _TIMELESS and not led
