"""Mass matrix of a chain; see `erls.equations.compiled_system`."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.segments import fill
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M."""
    fill(reals, integers, scratch, t, y, out)
