"""Compiled functions that solve with M + α C + β K; see `erls.equations.compiled_system`.

``factors`` holds memory like scratch, the blocks of `erls.equations.erls.shifted_blocks`, whether these are there,
and their α
and β. Of the damping, C, what couples coordinates that diagonalize mass and stiffness of a link is left out.
"""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.elimination import eliminate
from erls.equations.erls.forces import deform_first_order, deform_second_order
from erls.equations.erls.motion import place_frames
from erls.equations.erls.shifted_blocks import shift
from erls.equations.erls.substitution import substitute
from erls.equations.serial.drives import feed_forward
from erls.equations.serial.gains import joint_gains
from erls.maths.jit import kernel, part


@part
def _factor(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    y: Array,
    v: Array,
    alpha: Any,
    beta: Any,
    factors: Array,
) -> int:
    known = factors[len(factors) - 3 :]
    if known[0] == 0.0 or known[1] != alpha or known[2] != beta:
        known[0] = 0.0
        status = shift(reals, integers, alpha, beta, factors)
        if status != 0:
            return int(status)
        known[0], known[1], known[2] = 1.0, alpha, beta
    if integers[at.FEED_FORWARD]:
        feed_forward(reals, integers, scratch, t)
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        joint, place = integers[record + at.JOINT], integers[record + at.MEMORY] + at.RESISTANCE
        if joint >= 0 and integers[record + at.EFFORT]:
            stiffness, damping = joint_gains(reals, integers, scratch, record, t, y[joint], v[joint])
            factors[place] = alpha * damping + beta * stiffness
    place_frames(reals, integers, scratch, t, y, y, scratch[0:0])
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        deform_first_order(reals, integers, scratch, record)
        deform_second_order(reals, integers, scratch, record)
    return int(eliminate(reals, integers, scratch, factors, factors, at.SHIFTED, False))


@kernel(contract.FACTOR, counted=False)
def factor(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    y: Array,
    v: Array,
    alpha: float,
    beta: float,
    factors: Array,
) -> int:
    """With real numbers."""
    return int(_factor(reals, integers, scratch, t, y, v, alpha, beta, factors))


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """With real numbers."""
    substitute(reals, integers, factors, factors, at.SHIFTED, b)


@kernel(contract.FACTOR_COMPLEX, counted=False)
def factor_complex(
    reals: Array,
    integers: IntArray,
    scratch: Array,
    t: float,
    y: Array,
    v: Array,
    alpha: complex,
    beta: complex,
    factors: Any,
) -> int:
    """With complex numbers."""
    return int(_factor(reals, integers, scratch, t, y, v, alpha, beta, factors))


@kernel(contract.SOLVE_COMPLEX, counted=False)
def solve_complex(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """With complex numbers."""
    substitute(reals, integers, factors, factors, at.SHIFTED, b)
