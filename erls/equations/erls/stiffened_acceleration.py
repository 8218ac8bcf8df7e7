"""Accelerations of a chain whose links have second-order displacements."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.link_by_link import accelerate, solve_links
from erls.equations.erls.records import read_chain
from erls.equations.erls.stiffened_residual import residual
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f, refined once: bent links make the inertia so ill-conditioned that solving takes half of the digits."""
    residual(reals, integers, scratch, t, y, v, y[0:0], out)
    status = accelerate(reals, integers, scratch, t, y, v, out, True)
    if status == 0:
        chain = read_chain(reals, integers, read_serial(reals, integers, integers[0]).own)
        left = scratch[chain.left :][: len(out)]
        residual(reals, integers, scratch, t, y, v, out, left)
        solve_links(reals, integers, scratch[chain.factors :], left)
        for i in range(len(out)):
            out[i] -= left[i]
    return int(status)
