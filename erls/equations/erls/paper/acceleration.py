"""Accelerations in the paper's dense form."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.paper.records import read_balance, read_paper
from erls.equations.serial.records import read_serial
from erls.maths.calls import caller
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray

call_residual = caller(contract.RESIDUAL, "erls.equations.erls.paper.functions:residual")
call_mass_matrix = caller(contract.MASS_MATRIX, "erls.equations.erls.paper.functions:mass_matrix")
_SINGULAR = 1e-14  # inertia of a coordinate against what it was before the elimination of those before it


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    paper = read_paper(reals, integers, read_serial(reals, integers, integers[0]).own)
    factor = read_balance(scratch, integers, paper.balance).factor
    call_mass_matrix(paper.mass_matrix, reals, integers, scratch, t, y, factor)
    call_residual(paper.residual, reals, integers, scratch, t, y, v, y[:0], out)
    status = cholesky(factor, _SINGULAR)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        forward(factor, out)
        backward(factor, out)
    return status

