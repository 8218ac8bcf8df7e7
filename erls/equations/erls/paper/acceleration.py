"""Accelerations in the paper's dense form."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.paper.functions import mass_matrix, residual
from erls.equations.erls.paper.records import read_balance, read_paper
from erls.equations.serial.records import read_serial
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray

_SINGULAR = 1e-14  # inertia of a coordinate against what it was before the elimination of those before it


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    paper = read_paper(reals, integers, read_serial(reals, integers, integers[0]).own)
    factor = read_balance(scratch, integers, paper.balance).factor
    mass_matrix(reals, integers, scratch, t, y, factor)
    residual(reals, integers, scratch, t, y, v, y[:0], out)
    status = cholesky(factor, _SINGULAR)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        forward(factor, out)
        backward(factor, out)
    return status

