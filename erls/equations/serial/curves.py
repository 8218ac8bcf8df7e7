"""Curves over time (`erls.mechanism.curves`) from flat arrays.

A curve starts in ``integers`` with its number of parts; each part follows with (kind, start in reals, knots, order). A
polynomial one holds its knots, then one row of ``order`` coefficients for each piece; a harmonic one its one or two
breakpoints, then amplitude, ω, phase, offset, value before and after.
"""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array, IntArray
from erls.maths.jit import part

PIECEWISE, HARMONIC = 0, 1
PART = 4


@part
def _passed(reals: Array, start: int, count: int, t: float) -> int:
    """Number of knots at or before ``t``, within the tolerance for events."""
    limit = t + (1e-13 + 1e-14 * abs(t))
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if limit < reals[start + middle]:
            high = middle
        else:
            low = middle + 1
    return low


@part
def curve(integers: IntArray, reals: Array, at: int, t: float) -> tuple[float, float, float]:
    """Value, first and second derivative at ``t``; at a breakpoint the limit from the right."""
    value = rate = acceleration = 0.0
    for number in range(integers[at]):
        record = at + 1 + PART * number
        start, knots, order = integers[record + 1], integers[record + 2], integers[record + 3]
        piece = _passed(reals, start, knots, t)
        if integers[record] == PIECEWISE:
            origin = reals[start + max(piece - 1, 0)] if knots else 0.0
            x = t - origin
            v = d = half = 0.0
            row = start + knots + piece * order
            for i in range(order - 1, -1, -1):
                half = half * x + d
                d = d * x + v
                v = v * x + reals[row + i]
            value += v
            rate += d
            acceleration += 2 * half
        else:
            form = start + knots
            if piece == 0:
                value += reals[form + 4]
            elif piece == 1:
                omega = reals[form + 1]
                angle = omega * (t - reals[start]) + reals[form + 2]
                s, c = reals[form] * math.sin(angle), reals[form] * math.cos(angle)
                value += reals[form + 3] + s
                rate += omega * c
                acceleration -= omega * omega * s
            else:
                value += reals[form + 5]
    return value, rate, acceleration
