"""Curves over time (`erls.mechanism.curves`) in flat memory: a count of parts, then their records."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from erls.maths.jit import part
from erls.maths.records import Matrix, Memory, Vector, reader, table_size
from erls.maths.so3 import Array
from erls.mechanism.curves import Curve, Harmonic, Piecewise, Sum
from fe_import.model import IntArray

PIECEWISE, HARMONIC = 0, 1


class CurvePart(NamedTuple):
    """A term of a curve.

    Attributes
    ----------
    kind : int
    knots : (k,) array
        Times at which the next piece begins.
    pieces : array
        Of a polynomial (k + 1, order), coefficients from the constant one on, of the time since the last knot (the
        first two pieces: since the first knot); of a sine one row of amplitude, ω, phase, offset, value before, after.
    """

    kind: int
    knots: Vector
    pieces: Matrix


read_part = reader(CurvePart)
PART = table_size(CurvePart)


def put_curve(memory: Memory, curve: Curve | None) -> int:
    """Store a curve; its place, -1 for None."""
    if curve is None:
        return -1
    parts = _parts(curve)
    at = len(memory.integers)
    memory.integers.append(len(parts))
    memory.put_all([_record(term) for term in parts])
    return at


def _record(term: Piecewise | Harmonic) -> CurvePart:
    if isinstance(term, Piecewise):
        return CurvePart(PIECEWISE, np.array(term.knots, dtype=float), term.coefficients)
    form = np.array([[term.amplitude, term.omega, term.phase, term.offset, term.before, term.after]])
    return CurvePart(HARMONIC, np.array(term.breakpoints, dtype=float), form)


def _parts(curve: Curve) -> list[Piecewise | Harmonic]:
    """The curves of a sum, of sums of sums too."""
    if isinstance(curve, Sum):
        return [part for some in curve.parts for part in _parts(some)]
    if isinstance(curve, Piecewise | Harmonic):
        return [curve]
    raise TypeError(f"no compiled form of the curve {type(curve).__name__}")


@part
def passed(knots: Array, t: float) -> int:
    """Number of knots at or before ``t``, within the tolerance for events."""
    limit = t + (1e-13 + 1e-14 * abs(t))
    low, high = 0, len(knots)
    while low < high:
        middle = (low + high) // 2
        if limit < knots[middle].real:
            high = middle
        else:
            low = middle + 1
    return low


@part
def curve(reals: Array, integers: IntArray, at: int, t: float) -> tuple[Any, Any, Any]:
    """Value, first and second derivative at ``t``; at a breakpoint the limit from the right."""
    value = rate = acceleration = 0.0 * reals[0]
    for number in range(integers[at]):
        term = read_part(reals, integers, at + 1 + PART * number)
        knots, piece = term.knots, passed(term.knots, t)
        if term.kind == PIECEWISE:
            x = t - knots[max(piece - 1, 0)] if len(knots) else t + 0.0 * reals[0]
            coefficients = term.pieces[piece]
            v = d = half = 0.0 * reals[0]
            for i in range(len(coefficients) - 1, -1, -1):
                half = half * x + d
                d = d * x + v
                v = v * x + coefficients[i]
            value += v
            rate += d
            acceleration += 2 * half
        else:
            form = term.pieces[0]
            amplitude, omega, phase, offset, before, after = form[0], form[1], form[2], form[3], form[4], form[5]
            if piece == 0:
                value += before
            elif piece == 1:
                angle = omega * (t - knots[0]) + phase
                s, c = amplitude * np.sin(angle), amplitude * np.cos(angle)
                value += offset + s
                rate += omega * c
                acceleration -= omega * omega * s
            else:
                value += after
    return value, rate, acceleration
