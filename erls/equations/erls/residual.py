"""Forces out of balance of a chain; see `erls.equations.compiled_system`.

Kernels stand apart from what they are made of: a module is compiled as a whole when it is imported.
"""

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
    """M a - f, see `erls.equations.compiled_system`; an empty ``a`` stands for zeros, with which nothing is multiplied
    then.
    """
    balance(reals, integers, scratch, t, y, v, a, out, None, integers[0])
