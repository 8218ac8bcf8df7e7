"""Derivatives of the forces of a run by a parameter, at its knots.

∂R/∂p is a sum of forces R of equations at other values of p, or with constants c + Δp dc/dp, of which R is a simpler
function: linear in inertia, in loads, in gains. Fewer terms than fourth order takes are enough then, as a look at some
knots shows: two on either side, or one beside the run itself.

Forces of loops are what is left of much larger ones, and bend within steps that rounding asks for. In long runs of them
derivatives along constants are complex steps, which have no size (W. Squire, G. Trapp, SIAM Rev. 40 (1998) 110-112).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.tangents import Evaluation, Knots
from erls.maths.jit import any_scalar
from erls.maths.so3 import Array
from erls.sensitivity.variants import Difference, Variant
from fe_import.derivatives import STENCILS, STEP

_LINEAR = 1e-10  # of a derivative: what the third order of steps makes of it; a square root makes 1e-7
_ROUNDING = 4e-15  # of forces out of balance, and of constants
_COMPLEX = 1e-30  # step
_SEEN = 1e3  # times rounding: less is nothing


class Term(NamedTuple):
    """Forces at another value.

    Attributes
    ----------
    weight : float
        In the derivative [1/unit of the parameter].
    apart : float
        Of the parameter from its value in the run; 0 of the run itself.
    system : CompiledSystem
    turn : (n, n) array or None
        As of `erls.sensitivity.variants.Variant`.
    """

    weight: float
    apart: float
    system: CompiledSystem
    turn: Array | None = None

    def forces(self, knots: Knots, evaluation: Evaluation) -> Array:
        """(k, n) forces out of balance, in the coordinates of the run."""
        t, y, v, a = knots
        if self.turn is None:
            return evaluation.forces(self.system, knots)
        turned = Knots(t, *(x @ self.turn.T for x in (y, v, a)))
        return np.asarray(evaluation.forces(self.system, turned) @ self.turn)


class ComplexForces:
    """Forces out of balance of complex numbers, compiled when they are first asked for.

    Parameters
    ----------
    system : CompiledSystem
    slope : (r,) array, optional
        Derivative of its constants.
    """

    def __init__(self, system: CompiledSystem, slope: Array | float = 0.0) -> None:
        self._residual: Any = any_scalar(system.residual, getattr(system, "called", None))
        self._reals, self._scratch = system.reals + 1j * _COMPLEX * slope, system.scratch.astype(complex)
        self._integers = system.integers

    def slope(self, t: float, y: Array, v: Array, a: Array, moved: Array | float = 0.0) -> Array:
        """(n,) derivative of forces along that of constants, and along changes (2, n) of coordinates and rates."""
        moved = np.broadcast_to(moved, (2, len(y)))
        y, v = (x + 1j * _COMPLEX * change for x, change in zip((y, v), moved, strict=True))
        out = np.empty(len(y), dtype=complex)
        self._residual(self._reals, self._integers, self._scratch, t, y, v, a.astype(complex), out)
        return np.asarray(out.imag / _COMPLEX)


@dataclass(frozen=True)
class ExactDerivative:
    """∂R/∂p by complex steps along constants."""

    forces: ComplexForces
    terms: tuple[Term, ...] = ()

    def at(self, knots: Knots, evaluation: Evaluation, known: dict[int, Array]) -> Array:
        """As of `ForceDerivative`."""
        return np.array([self.forces.slope(*knot) for knot in zip(*knots, strict=True)]).reshape(knots.y.shape)


@dataclass(frozen=True)
class ForceDerivative:
    """∂R/∂p as a sum of terms."""

    terms: tuple[Term, ...]

    def at(self, knots: Knots, evaluation: Evaluation, known: dict[int, Array]) -> Array:
        """(k, n) at knots; ``known`` keeps forces of the run itself, for all who ask at the same knots."""
        found: dict[int, Array] = {}
        order = [0, len(self.terms) - 1, *range(1, len(self.terms) - 1)]
        for k in order:
            if len(found) == 2 and np.array_equal(found[order[0]], found[order[1]]):
                return np.zeros_like(knots.y)  # it does not act here
            found[k] = self._forces(self.terms[k], knots, evaluation, known)
        return np.asarray(sum(term.weight * found[k] for k, term in enumerate(self.terms)))

    @staticmethod
    def _forces(term: Term, knots: Knots, evaluation: Evaluation, known: dict[int, Array]) -> Array:
        if term.apart:
            return term.forces(knots, evaluation)
        if 0 not in known:
            known[0] = term.forces(knots, evaluation)
        return known[0]


def force_derivative(
    base: CompiledSystem, difference: Difference, sample: Knots, evaluation: Evaluation
) -> ForceDerivative | ExactDerivative | None:
    """By a parameter, with as few terms as some knots let it have; None where forces do not depend on it.

    Parameters
    ----------
    base : CompiledSystem
        Of the run.
    difference : Difference
    sample : Knots
    evaluation : Evaluation
    """
    if not difference.acts:
        return None
    line = _line(base, difference)
    if line is None:
        terms = [Term(one.weight, one.apart, one.formulation.compiled, one.turn) for one in difference.variants]
    else:
        terms = _along(line, base, STEP * difference.parameter.size)
    here = Term(0.0, 0.0, base)
    own, found = here.forces(sample, evaluation), [term.forces(sample, evaluation) for term in terms]
    if all(np.array_equal(one, own) for one in found):  # a spring at a joint that follows a motion, say
        return ForceDerivative((here, *terms))
    rounding = _ROUNDING * max(map(_largest, found)) / min(abs(term.apart) for term in terms if term.apart)
    inner, whole, curved = _inner(terms, found, rounding)
    if line is not None and whole and (inner is None or rounding > _LINEAR * whole):
        if evaluation.complex_steps:
            return ExactDerivative(ComplexForces(replace(line.system, reals=base.reals), line.slope))
        off = max(curved, rounding)
        share = (rounding * whole / off**2 / 4) ** 0.2  # the least of (off/whole)² s⁴ + (rounding/whole) / s
        return ForceDerivative(tuple(_along(line, base, share * STEP * difference.parameter.size)))
    linear = _linear([here, *terms], [own, *found], rounding)
    return ForceDerivative(linear or inner or tuple(terms))


class _Line(NamedTuple):
    """Equations of some kind, whose constants are c + Δp dc/dp."""

    system: CompiledSystem
    slope: Array


def _line(base: CompiledSystem, difference: Difference) -> _Line | None:
    """Forces are simpler functions of constants than of parameters.

    None where equations of another kind, or in other coordinates, stand at other values. One that comes into play with
    the parameter, a damper say, may be of a kind of its own, whose constants are those of the run without it.
    """
    first, second = difference.few
    found = first.formulation.compiled, second.formulation.compiled
    if first.turn is not None or not _of_one_kind(*found) or len(found[0].reals) != len(base.reals):
        return None
    slope = _linear_slope(base.reals, first, second)
    if slope is None:
        every = [variant.formulation.compiled for variant in difference.variants]
        if not _of_one_kind(base, *every):
            return None
        same = np.all([x.reals == base.reals for x in every], axis=0)  # infinite ones, too
        weights = [variant.weight for variant in difference.variants]
        slope = np.sum([w * np.where(same, 0.0, x.reals) for w, x in zip(weights, every, strict=True)], axis=0)
    return _Line(found[0], slope)


def _along(line: _Line, base: CompiledSystem, step: float) -> list[Term]:
    """Terms of fourth order."""
    moved = [(weight / step, at * step) for at, weight in STENCILS[0]]
    return [Term(weight, apart, replace(line.system, reals=base.reals + apart * line.slope)) for weight, apart in moved]


def _linear_slope(here: Array, first: Variant, second: Variant) -> Array | None:
    """dc/dp where constants are linear in the parameter, as two variants show."""
    one, other = first.formulation.compiled.reals, second.formulation.compiled.reals
    same = (one == here) & (other == here)  # infinite ones, too
    with np.errstate(invalid="ignore"):
        slope = np.where(same, 0.0, (other - one) / (second.apart - first.apart))
        off = np.where(same, 0.0, one - first.apart * slope - here)
    return slope if (np.abs(off) <= _ROUNDING * np.abs(here)).all() else None


def _of_one_kind(first: CompiledSystem, *others: CompiledSystem) -> bool:
    return all(np.array_equal(first.integers, other.integers) for other in others)


def _linear(terms: list[Term], found: list[Array], rounding: float) -> tuple[Term, ...] | None:
    """Two terms where they are enough, of which one is the run itself, the first one here.

    Where nothing of the parameter shows at these knots, nothing is known of the others.
    """
    first, second = [k for k in range(1, len(terms), 2) if terms[k].apart][:2]
    one, other = ((found[k] - found[0]) / terms[k].apart for k in (first, second))
    if _largest(one) <= _SEEN * rounding or _largest(one - other) > _LINEAR * _largest(one) + rounding:
        return None
    far = max(terms[first], terms[second], key=lambda term: abs(term.apart))
    return far._replace(weight=1 / far.apart), terms[0]._replace(weight=-1 / far.apart)


def _inner(
    terms: list[Term], found: list[Array], rounding: float
) -> tuple[tuple[Term, ...] | None, float, float]:
    """The two terms on either side of the run, if they are enough and something shows; how large the derivative is, and
    by how much that of two terms is off, which the third derivative makes.
    """
    if terms[0].apart >= 0 or terms[-1].apart <= 0:
        return None, 0.0, 0.0
    inner = tuple(term._replace(weight=0.75 * term.weight) for term in terms[1:3])
    weights = np.array([term.weight for term in terms])
    whole = np.tensordot(weights, np.array(found), 1)
    less = 0.75 * np.tensordot(weights[1:3], np.array(found[1:3]), 1)
    size, off = _largest(whole), _largest(whole - less)
    if size <= _SEEN * rounding:
        return None, 0.0, off
    return (inner if off <= _LINEAR * size + rounding else None), size, off


def _largest(x: Array) -> float:
    return float(np.abs(x).max(initial=0.0))
