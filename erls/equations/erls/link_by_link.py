"""(M + α C + β K) x = b link by link: what solving and accelerations share."""

from __future__ import annotations

from typing import Any

from erls.equations.erls.anchored_segments import set_anchored_segments
from erls.equations.erls.records import read_chain
from erls.equations.erls.segments import set_segments
from erls.equations.serial.elimination import eliminate, set_compliance, substitute
from erls.equations.serial.records import call_feed_forward, read_serial
from erls.maths.jit import part
from erls.maths.so3 import Array
from fe_import.model import IntArray


@part
def factor_links(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: Any, beta: Any,
    factors: Any, accelerates: bool, bends: Any,
) -> int:  # fmt: skip
    """Factors of M + α C + β K; 0, or 1 + the number of a coordinate that nothing resists.

    ``accelerates`` after the forces out of balance at this state, for accelerations: the matrix should be positive
    definite. ``bends`` is None where links have no second-order displacements.
    """
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    if serial.feeds >= 0 and not accelerates:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    status = set_compliance(serial, chain.condensed, reals, integers, scratch, t, y, v, alpha, beta, factors)
    if status != 0:
        return int(status)
    if bends is None:
        set_segments(serial, chain, reals, integers, scratch, t, y, True, accelerates)
    else:
        set_anchored_segments(serial, chain, reals, integers, scratch, t, y, True, accelerates)
    return int(eliminate(serial, chain.segments, chain.condensed, reals, integers, scratch, factors, accelerates))


@part
def solve_links(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """Replace ``b`` by the solution, after `factor_links`."""
    serial = read_serial(reals, integers, integers[0])
    substitute(serial, read_chain(reals, integers, serial.own).condensed, reals, integers, factors, b)


@part
def accelerate(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array, bends: Any
) -> int:
    """Replace the forces out of balance at zero accelerations, asked for just before, by the accelerations M⁻¹ f.

    The factors stay in ``scratch``. The status is that of `factor_links`.
    """
    factors = scratch[read_chain(reals, integers, read_serial(reals, integers, integers[0]).own).factors :]
    status = factor_links(reals, integers, scratch, t, y, v, 0.0, 0.0, factors, True, bends)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        solve_links(reals, integers, factors, out)
    return int(status)
