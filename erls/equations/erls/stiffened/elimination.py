"""Accelerations by Cholesky's method, without square roots, from the last coordinate to the first: joints last."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.stiffened import layout as more
from erls.equations.erls.stiffened.balance import residual
from erls.equations.erls.stiffened.inertia import set_mass
from erls.maths.jit import kernel, part

_SINGULAR = 1e-14  # inertia along a coordinate against what it was before the elimination of those after it


@part
def solve_from_last(matrix: Array, whole: Array, x: Array) -> int:
    """Replace x by M⁻¹ x, and the lower triangle of M by factors; 0, or 1 + the coordinate where M is not positive.

    ``whole`` (n,) is room for the diagonal.
    """
    size = len(x)
    for k in range(size):
        whole[k] = matrix[k * (k + 1) // 2 + k]
    for k in range(size - 1, -1, -1):
        row = matrix[k * (k + 1) // 2 : k * (k + 1) // 2 + k + 1]
        if not row[k] > _SINGULAR * whole[k]:
            return k + 1
        load = x[k] / row[k]
        for i in range(k):
            factor = row[i] / row[k]
            x[i] -= row[i] * load
            other = matrix[i * (i + 1) // 2 : i * (i + 1) // 2 + i + 1]
            for j in range(i + 1):
                other[j] -= factor * row[j]
    for k in range(size):
        row = matrix[k * (k + 1) // 2 : k * (k + 1) // 2 + k + 1]
        left = x[k]
        for i in range(k):
            left -= row[i] * x[i]
        x[k] = left / row[k]
    return 0


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    residual(reals, integers, scratch, t, y, v, scratch[0:0], out)
    for i in range(len(out)):
        out[i] = -out[i]
    set_mass(reals, integers, scratch, t, y)
    head = more.header(integers, integers[at.LINKS])
    matrix, spare = integers[head + more.MATRIX], integers[head + more.COLUMNS]
    return solve_from_last(scratch[matrix:spare], scratch[spare : spare + len(out)], out)
