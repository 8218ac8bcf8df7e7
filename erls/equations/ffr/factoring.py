"""Compiled functions that solve with M + α C + β K, and with M alone; see `erls.equations.compiled_system`.

Of the damping, C, what couples coordinates that diagonalize mass and stiffness of a link is left out.
"""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.balance import residual
from erls.equations.ffr.bent import bent_inertia
from erls.equations.ffr.composite import move_coordinates, own_inertia
from erls.equations.ffr.feed_forward import feed_forward
from erls.equations.ffr.joints import gains
from erls.equations.ffr.link_by_link import eliminate, substitute
from erls.equations.ffr.motion import place_frames
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
    definite: bool,
) -> int:
    if integers[at.FEED_FORWARD]:
        feed_forward(reals, integers, scratch, t)
    place_frames(reals, integers, scratch, t, y, y, y[0:0])
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        e, first, joint = integers[record + at.MODES], integers[record + at.FIRST_MODE], integers[record + at.JOINT]
        start = integers[record + at.SHIFTED]
        stiffness, damping = integers[record + at.BASIS_STIFFNESS], integers[record + at.BASIS_DAMPING]
        for i in range(e):
            whole = 1.0 + alpha * reals[damping + i] + beta * reals[stiffness + i]
            if not whole.real > 0.0:
                return int(first + i + 1)
            factors[start + at.DIAGONAL + i] = 1.0 / whole
        if joint >= 0 and integers[record + at.EFFORT]:
            feed = scratch[integers[record + at.MEMORY] + at.EFFECTIVE]
            more, damped = gains(reals, integers, record, t, y[joint], v[joint], feed)
            factors[start + at.RESISTANCE] = alpha * damped + beta * more
        move_coordinates(integers, scratch, record)
        own_inertia(reals, integers, scratch, record, y[first : first + e])
        if integers[record + at.BEND] >= 0:
            bent_inertia(reals, integers, scratch, record)
    return int(eliminate(reals, integers, scratch, factors, definite))


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
    """With real numbers; see `erls.equations.compiled_system`."""
    return int(_factor(reals, integers, scratch, t, y, v, alpha, beta, factors, False))


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """With real numbers."""
    substitute(reals, integers, factors, b)


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
    return int(_factor(reals, integers, scratch, t, y, v, alpha, beta, factors, False))


@kernel(contract.SOLVE_COMPLEX, counted=False)
def solve_complex(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """With complex numbers."""
    substitute(reals, integers, factors, b)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    residual(reals, integers, scratch, t, y, v, y[0:0], out)
    factors = scratch[integers[at.MATRIX] :]
    status = _factor(reals, integers, scratch, t, y, v, 0.0, 0.0, factors, True)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        substitute(reals, integers, factors, out)
    return int(status)
