"""Accelerations, and (M + α C + β K) x = b, link by link; see `erls.equations.compiled_system`."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.erls.records import read_chain
from erls.equations.erls.residual import balance
from erls.equations.erls.segments import set_segments
from erls.equations.serial.elimination import eliminate, set_compliance, substitute
from erls.equations.serial.feed_forward import feed_forward
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel, part, spliced
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
    if serial.feeds and not accelerates:
        feed_forward(serial, reals, integers, scratch, t)
    status = set_compliance(serial, chain.condensed, reals, integers, scratch, t, y, v, alpha, beta, factors)
    if status != 0:
        return int(status)
    set_segments(serial, chain, reals, integers, scratch, t, y, True, accelerates, bends)
    return int(eliminate(serial, chain.segments, chain.condensed, reals, integers, scratch, factors, accelerates))


@part
def solve_links(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """Replace ``b`` by the solution, after `factor_links`."""
    serial = read_serial(reals, integers, integers[0])
    substitute(serial, read_chain(reals, integers, serial.own).condensed, reals, integers, factors, b)


@kernel(contract.FACTOR, counted=False)
def factor(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: float, beta: float,
    factors: Array,
) -> int:  # fmt: skip
    """With real numbers."""
    return int(factor_links(reals, integers, scratch, t, y, v, alpha, beta, factors, False, None))


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """With real numbers."""
    solve_links(reals, integers, factors, b)


@kernel(contract.FACTOR_COMPLEX, counted=False)
def factor_complex(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: complex, beta: complex,
    factors: Any,
) -> int:  # fmt: skip
    """With complex numbers."""
    return int(factor_links(reals, integers, scratch, t, y, v, alpha, beta, factors, False, None))


@kernel(contract.SOLVE_COMPLEX, counted=False)
def solve_complex(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """With complex numbers."""
    solve_links(reals, integers, factors, b)


@spliced
def accelerate(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array, bends: Any
) -> int:
    """M⁻¹ f, M a - f = 0 solved link by link."""
    balance(reals, integers, scratch, t, y, v, y[0:0], out, bends, integers[0])
    serial = read_serial(reals, integers, integers[0])
    factors = scratch[read_chain(reals, integers, serial.own).factors :]
    status = factor_links(reals, integers, scratch, t, y, v, 0.0, 0.0, factors, True, bends)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        solve_links(reals, integers, factors, out)
        if bends is not None:  # inertia as ill-conditioned as with bent links takes half of the digits: refined once
            left = scratch[read_chain(reals, integers, serial.own).left :][: len(out)]
            balance(reals, integers, scratch, t, y, v, out, left, bends, integers[0])
            solve_links(reals, integers, factors, left)
            for i in range(len(out)):
                out[i] -= left[i]
    return int(status)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f."""
    return int(accelerate(reals, integers, scratch, t, y, v, out, None))
