"""Polynomials through samples in a box, chosen axis by axis as far as each is needed.

In one variable the polynomial through the points x_0, x_1 ... of a sequence of Leja is Σ s_l H_l with
H_l(x) = Π_{i<l} (x - x_i) / (x_l - x_i); in several, terms are products of these, each with one sample of its own. A
term vanishes at the samples of those below it, so that its factor s, the surplus, is what they leave of the sample.
Terms are added where the surplus is largest (A. Chkifa, A. Cohen, C. Schwab, Found. Comput. Math. 14 (2014) 601-633):
what depends linearly on a number takes two samples along it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.linalg as la

from fe_import.model import Array, IntArray

Arrays = dict[str, Array]
Term = tuple[int, ...]
MOST_DEGREE = 20
_LEFT_OUT = 1e-11  # of the largest singular value


@cache
def leja_points(count: int) -> tuple[float, ...]:
    """0, 1, -1, then wherever the product of the distances from those before is largest in [-1, 1]."""
    points, fine = [0.0, 1.0, -1.0], np.linspace(-1.0, 1.0, 20001)
    while len(points) < count:
        points.append(float(fine[np.abs(np.prod(fine[:, None] - points, axis=1)).argmax()]))
    return tuple(points[:count])


def _along(x: float, degree: int) -> tuple[Array, Array]:
    """(degree + 1,) values and slopes of H_0, H_1 ... at x."""
    points = leja_points(degree + 1)
    values, slopes = np.ones(degree + 1), np.zeros(degree + 1)
    for level in range(1, degree + 1):
        product, slope = 1.0, 0.0
        for before in points[:level]:
            width = points[level] - before
            product, slope = product * (x - before) / width, (slope * (x - before) + product) / width
        values[level], slopes[level] = product, slope
    return values, slopes


@dataclass(frozen=True)
class Interpolant:
    """Arrays as polynomials of the place in a box.

    Attributes
    ----------
    lower, upper : (n,) arrays
        Corners of the box.
    degrees : (terms, n) int array
        Of each term along each axis.
    mixing : (terms, r) array
        What each term has of each part.
    parts : dict of (r, ...) arrays
        Far fewer than terms: matrices depend on parameters through a few functions of them. Each is a sum of samples,
        so that what is linear and holds for all samples holds for it.
    """

    lower: Array
    upper: Array
    degrees: IntArray
    mixing: Array
    parts: Arrays

    @property
    def count(self) -> int:
        """Number of terms, each of which took a sample."""
        return len(self.degrees)

    def values(self, place: Array, names: Collection[str] | None = None) -> Arrays:
        """Arrays at a place (n,), all of them unless named."""
        return self._summed(products(self.degrees, self._inside(place)), names)

    def slopes(self, place: Array, axis: int) -> Arrays:
        """Their derivatives by one coordinate of the place."""
        scale = 2 / (self.upper[axis] - self.lower[axis])
        return self._summed(scale * products(self.degrees, self._inside(place), axis), None)

    def _inside(self, place: Array) -> Array:
        return np.asarray((2 * place - self.lower - self.upper) / (self.upper - self.lower))

    def _summed(self, weights: Array, names: Collection[str] | None) -> Arrays:
        mixed = weights @ self.mixing
        return {
            name: np.tensordot(mixed, parts, 1) for name, parts in self.parts.items() if names is None or name in names
        }


def products(degrees: IntArray, x: Array, slope: int = -1) -> Array:
    """(terms,) values of terms at x in [-1, 1]^n; of one axis slopes."""
    result = np.ones(len(degrees))
    for axis, along in enumerate(degrees.T):
        result *= _along(float(x[axis]), int(along.max(initial=0)))[int(axis == slope)][along]
    return result


def place_of_term(lower: Array, upper: Array, degrees: Sequence[int]) -> Array:
    """(n,) where the sample of a term is taken."""
    x = np.array([leja_points(d + 1)[d] for d in degrees])
    return np.asarray((lower + upper) / 2 + x * (upper - lower) / 2)


class NotSmooth(Exception):
    """More terms were wanted than allowed; ``left``: the largest surplus that was found last."""

    def __init__(self, left: float) -> None:
        super().__init__(left)
        self.left = left


def interpolated(
    sample: Callable[[Array], Arrays],
    size: Callable[[Arrays, Arrays], float],
    lower: Array,
    upper: Array,
    tolerance: float,
    most: int,
) -> Interpolant:
    """Polynomials through as many samples as the tolerance takes.

    Parameters
    ----------
    sample : callable
        Arrays at a place (n,), of the same shapes everywhere and of like size.
    size : callable
        Of surpluses beside the arrays at their place, which the tolerance limits.
    lower, upper : (n,) arrays
    tolerance : float
        Of the surpluses of all terms that others could follow.
    most : int
        Terms.

    Raises
    ------
    NotSmooth
        They do not suffice.
    """
    first = (0,) * len(lower)
    begin = sample(place_of_term(lower, upper, first))
    names, ends = list(begin), np.cumsum([part.size for part in begin.values()])
    surplus = np.empty((1, int(ends[-1])))
    surplus[0] = np.concatenate([part.ravel() for part in begin.values()])
    known, taken = {first: 0}, set[Term]()
    sizes = {first: np.inf}

    def opened(row: Array) -> Arrays:
        return {n: part.reshape(begin[n].shape) for n, part in zip(names, np.split(row, ends[:-1]), strict=True)}

    while sizes and (largest := max(sizes.values())) > tolerance:
        if len(known) >= most:
            raise NotSmooth(largest)
        chosen = max(sizes, key=lambda term: sizes[term])
        taken.add(chosen)
        del sizes[chosen]
        for term in (_raised(chosen, axis, 1) for axis in range(len(lower))):
            below = [_raised(term, axis, -1) for axis, degree in enumerate(term) if degree]
            if max(term) > MOST_DEGREE or not all(b in taken for b in below):
                continue
            count, place = len(known), place_of_term(lower, upper, term)
            if count == len(surplus):
                surplus = np.concatenate([surplus, np.empty_like(surplus)])
            x = np.array([leja_points(d + 1)[d] for d in term])
            found = sample(place)
            surplus[count] = np.concatenate([part.ravel() for part in found.values()])
            surplus[count] -= products(np.array(list(known)), x) @ surplus[:count]
            known[term], sizes[term] = count, size(opened(surplus[count]), found)
    mixing, factors = _factored(surplus[: len(known)])
    by_name = zip(names, np.split(factors, ends[:-1], axis=1), strict=True)
    parts = {name: part.reshape(len(part), *begin[name].shape) for name, part in by_name}
    return Interpolant(lower, upper, np.array(list(known), dtype=np.int64), mixing, parts)


def _factored(rows: Array) -> tuple[Array, Array]:
    """(terms, r), (r, size) whose product the rows are, but for what is far below the tolerance."""
    ways, parts, left = [], [], rows
    largest = 0.0
    for _ in range(2):  # eigenvalues of squares tell seven digits: what the first ones leave is looked at again
        squared, directions = la.eigh(left @ left.T)
        largest = max(largest, float(squared[-1]))
        found = directions[:, squared > max(1e-14 * squared[-1], _LEFT_OUT**2 * largest)]
        ways.append(found)
        parts.append(found.T @ left)
        left = left - found @ parts[-1]
    return np.hstack(ways), np.vstack(parts)


def _raised(term: Term, axis: int, by: int) -> Term:
    return (*term[:axis], term[axis] + by, *term[axis + 1 :])
