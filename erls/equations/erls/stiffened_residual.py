"""Forces out of balance of a chain whose links have second-order displacements."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.balance import balance
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f."""
    balance(reals, integers, scratch, t, y, v, a, out, True, integers[0])
