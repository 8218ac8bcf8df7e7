"""Integrals over time from the knots of a run alone: panels of four adjacent knots, none over a jump.

A step of ``lobatto`` adds three knots, so that a panel is one of its steps, and the rule through its knots Lobatto's,
of order 6; knots of steps of one length make it Newton's 3/8 rule, of order 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from erls.maths.so3 import Array
from fe_import.model import IntArray

_SPAN = 3  # intervals
_QUARTIC = 1 / 270  # ∫ s (s - 1/3) (s - 2/3) (s - 1) over 0..1: what a rule through even knots makes of s⁴
_HAIR = 1e-12  # of a time, or of 1 s: which side of a jump a knot stands on (`erls.integrate.base`)


@dataclass(frozen=True)
class Panels:
    """Stretches between knots that follow one another, and the rules for integrals over them.

    Attributes
    ----------
    times : (k,) array
        Of all knots [s].
    nodes : (p, 4) int array
        Knots of each panel; one that a short leg lacks repeats the last one, with weight 0.
    first : (p,) int array
        Knot at which each panel begins; it ends at the last one of its nodes.
    weights : (p, 4) array
        [s]
    """

    times: Array
    nodes: IntArray
    first: IntArray
    weights: Array

    @property
    def last(self) -> IntArray:
        """(p,) knot at which each panel ends."""
        return self.nodes[:, -1]

    @cached_property
    def lengths(self) -> Array:
        """(p,) [s]"""
        return np.asarray(self.times[self.last] - self.times[self.first])

    def picked(self, which: IntArray) -> Panels:
        """Some of them."""
        return Panels(self.times, self.nodes[which], self.first[which], self.weights[which])

    @cached_property
    def cubic(self) -> Array:
        """(p, 4) by which values at the nodes add up to c₃ of the polynomial Σ cᵢ sⁱ through them, s = 0..1 from the
        first to the last; 0 for panels of a leg of fewer knots.
        """
        result = np.zeros(self.weights.shape)
        whole = self.nodes[:, -1] != self.nodes[:, -2]
        t = self.times[self.nodes[whole]]
        s = (t - t[:, :1]) / (t[:, -1:] - t[:, :1])
        result[whole] = 1 / (s[:, :, None] - s[:, None, :] + np.eye(_SPAN + 1)).prod(axis=2)
        return result

    def integrals(self, values: Array) -> Array:
        """(p, n) integrals of what is (k, n) at the knots."""
        return self._summed(self.weights, values)

    def unresolved(self, values: Array) -> Array:
        """(p, n) c₃ of what is (k, n) at the knots: what a parabola through each panel leaves out."""
        return self._summed(self.cubic, values)

    def _summed(self, weights: Array, values: Array) -> Array:
        result = weights[:, :1] * values[self.nodes[:, 0]]
        for i in range(1, _SPAN + 1):  # node by node: no array of all of them is made
            result += weights[:, i, None] * values[self.nodes[:, i]]
        return np.asarray(result)

    def rule_errors(self, values: Array) -> Array:
        """(p,) what the rules may be off by, of values (p, 4) at the nodes.

        c₃ against the spread of the values tells how fast polynomials converge; by that ratio c₄ is smaller, of which
        a rule through even knots makes c₄/270.
        """
        spread = np.ptp(values, axis=1)
        cubic = np.abs((self.cubic * values).sum(axis=1))
        found = _QUARTIC * cubic * np.minimum(cubic / np.maximum(spread, 1e-300), 1.0)
        short = self.nodes[:, -1] == self.nodes[:, -2]  # a leg of two or three knots: as if all of the change bent
        return np.asarray(self.lengths * np.where(short, spread / 12, found))


def panels_of(t: Array) -> Panels:
    """Panels over all legs of rising times (k,), of which one that stands twice parts two legs."""
    ends = np.flatnonzero(np.diff(t) == 0)
    starts, stops = np.concatenate([[0], ends + 1]), np.concatenate([ends, [len(t) - 1]])
    nodes: list[IntArray] = []
    first: list[IntArray] = []
    rest: list[tuple[IntArray, int]] = []
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        whole = (stop - start) // _SPAN
        begin = start + _SPAN * np.arange(whole)
        nodes.append(begin[:, None] + np.arange(_SPAN + 1))
        first.append(begin)
        done = start + _SPAN * whole
        if done < stop:
            own = np.arange(max(start, stop - _SPAN), stop + 1)
            rest.append((own, done))
    full = np.concatenate(nodes)
    length = t[full[:, 3]] - t[full[:, 0]]
    a, b = ((t[full[:, i]] - t[full[:, 0]]) / length for i in (1, 2))
    second = (2 * b - 1) / (12 * a * (a - b) * (a - 1))
    third = (2 * a - 1) / (12 * b * (b - a) * (b - 1))
    fourth = 0.5 - second * a - third * b
    weights = length[:, None] * np.stack([1 - second - third - fourth, second, third, fourth], axis=1)
    if rest:
        short = [_rule(t, own, done) for own, done in rest]
        full = np.concatenate([full, [pair[0] for pair in short]])
        weights = np.concatenate([weights, [pair[1] for pair in short]])
        first.append(np.array([done for _, done in rest]))
    begun = np.concatenate(first)
    order = np.argsort(begun, kind="stable")
    return Panels(t, full[order], begun[order], weights[order])


def _rule(t: Array, own: IntArray, done: int) -> tuple[IntArray, Array]:
    """Nodes (4,) and weights (4,) of what a leg has left beyond whole panels: the polynomial through its last knots."""
    origin, span = t[own[-1]], t[own[-1]] - t[own[0]]
    s, begin = (t[own] - origin) / span, (t[done] - origin) / span
    powers = np.arange(len(own))
    found = np.linalg.solve(s[None, :] ** powers[:, None], -(begin ** (powers + 1)) / (powers + 1)) * span
    missing = _SPAN + 1 - len(own)
    return np.concatenate([own, np.repeat(own[-1:], missing)]), np.concatenate([found, np.zeros(missing)])


def within_legs(t: Array) -> Array:
    """Times (k,) of knots, those at jumps and ends moved by a hair into their own legs: forces jump there."""
    result, hair = t.copy(), _HAIR * np.maximum(np.abs(t), 1.0)
    jumps = np.flatnonzero(np.diff(t) == 0)
    late, early = np.append(jumps, len(t) - 1), np.append(jumps + 1, 0)
    result[late] -= hair[late]
    result[early] += hair[early]
    return result
