"""The functions of `erls.equations.compiled_system` for a chain whose fast modes follow statically."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.quasi_static.following import put_acceleration, put_masses, put_residual
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """Wᵀ (M a - f) where the static modes are in balance; an empty ``a`` stands for zeros."""
    put_residual(reals, integers, scratch, t, y, v, a, out, None)


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """Wᵀ M W."""
    put_masses(reals, integers, scratch, t, y, out, None)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """Where the residual is zero; see `erls.equations.compiled_system`."""
    return int(put_acceleration(reals, integers, scratch, t, y, v, out, None))
