"""Solving link by link with (M + α C + β K) x = b, for real and complex shifts, and accelerations by it."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.ffr.records import Frames, read_frames, read_room
from erls.equations.ffr.residual import residual
from erls.equations.ffr.segments import decouple_segments, fill_segments
from erls.equations.serial.elimination import eliminate, set_compliance, substitute
from erls.equations.serial.records import Serial, call_feed_forward, read_serial
from erls.maths.jit import kernel, part
from erls.maths.so3 import Array
from fe_import.model import IntArray


@part
def _factor(
    serial: Serial, frames: Frames, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    alpha: Any, beta: Any, factors: Any, definite: bool,
) -> int:  # fmt: skip
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    status = set_compliance(
        serial, frames.condensed, reals, integers, scratch, t, y, v, alpha, beta, factors
    )
    if status != 0:
        return int(status)
    fill_segments(serial, frames, reals, integers, scratch, t, y)
    decouple_segments(serial, frames, reals, integers, scratch)
    return int(eliminate(serial, frames.decoupled, frames.condensed, reals, integers, scratch, factors, definite))


@kernel(contract.FACTOR, counted=False)
def factor(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: float, beta: float,
    factors: Array,
) -> int:  # fmt: skip
    """With real numbers; see `erls.equations.compiled_system`."""
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    return int(_factor(serial, frames, reals, integers, scratch, t, y, v, alpha, beta, factors, False))


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """With real numbers."""
    serial = read_serial(reals, integers, integers[0])
    substitute(serial, read_frames(reals, integers, serial.own).condensed, reals, integers, factors, b)


@kernel(contract.FACTOR_COMPLEX, counted=False)
def factor_complex(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: complex, beta: complex,
    factors: Any,
) -> int:  # fmt: skip
    """With complex numbers."""
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    return int(_factor(serial, frames, reals, integers, scratch, t, y, v, alpha, beta, factors, False))


@kernel(contract.SOLVE_COMPLEX, counted=False)
def solve_complex(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """With complex numbers."""
    serial = read_serial(reals, integers, integers[0])
    substitute(serial, read_frames(reals, integers, serial.own).condensed, reals, integers, factors, b)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    residual(reals, integers, scratch, t, y, v, y[0:0], out)
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    factors = read_room(scratch, integers, frames.room).factors
    status = _factor(serial, frames, reals, integers, scratch, t, y, v, 0.0, 0.0, factors, True)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        substitute(serial, frames.condensed, reals, integers, factors, out)
    return int(status)
