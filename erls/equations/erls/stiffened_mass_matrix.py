"""Mass matrix of a chain whose links have second-order displacements."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.anchored_segments import fill_anchored
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M."""
    fill_anchored(reals, integers, scratch, t, y, out)
