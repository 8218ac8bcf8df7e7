"""Accelerations, link by link; see `erls.equations.compiled_system`.

Apart from `erls.equations.erls.factors`, which a chain with dense iteration matrices never compiles.
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.link_by_link import accelerate
from erls.equations.erls.residual import residual
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f."""
    residual(reals, integers, scratch, t, y, v, y[0:0], out)
    return int(accelerate(reals, integers, scratch, t, y, v, out, None))
