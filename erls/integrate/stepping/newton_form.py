"""Newton's form of Hermite interpolation through ends of steps, in compiled loops."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.maths.jit import helper


@helper
def differences(t: Array, knots: Array, first: int, ends: int, given: int, table: Array) -> None:
    """Newton's coefficients of Hermite interpolation, ``given`` values and derivatives at each end, into ``table``.

    (J. Stoer, R. Bulirsch, Introduction to Numerical Analysis, sec. 2.1.5.)
    """
    rows, n = ends * given, table.shape[1]
    for i in range(rows):
        for q in range(n):
            table[i, q] = knots[first + i // given, 0, q]
    for order in range(1, rows):
        for i in range(rows - 1, order - 1, -1):
            right, left = first + i // given, first + (i - order) // given
            if right == left:
                factor = 1.0 if order == 1 else 0.5
                for q in range(n):
                    table[i, q] = factor * knots[right, order, q]
            else:
                per = 1.0 / (t[right] - t[left])
                for q in range(n):
                    table[i, q] = (table[i, q] - table[i - 1, q]) * per


@helper
def interpolate(t: Array, first: int, ends: int, given: int, table: Array, time: float, out: Array) -> None:
    """Value and two derivatives (3, n) of Newton's polynomial."""
    n = table.shape[1]
    for q in range(n):
        p, p1, p2 = 0.0, 0.0, 0.0
        for i in range(ends * given - 1, -1, -1):
            x = time - t[first + i // given]
            p2 = p2 * x + 2.0 * p1
            p1 = p1 * x + p
            p = p * x + table[i, q]
        out[0, q], out[1, q], out[2, q] = p, p1, p2
