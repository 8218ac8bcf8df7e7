"""The functions of a chain whose links have second-order displacements; see `erls.equations.compiled_system`."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls import segments
from erls.equations.erls.residual import balance
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f."""
    balance(reals, integers, scratch, t, y, v, a, out, True, integers[0])


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M."""
    segments.fill(reals, integers, scratch, t, y, out, True)
