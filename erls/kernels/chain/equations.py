"""The functions of a compiled chain, with the signatures of `erls.kernels.contract`."""

from __future__ import annotations

from erls.kernels import contract
from erls.kernels.chain import layout as at
from erls.kernels.chain.balance import balance
from erls.kernels.chain.composite import mass
from erls.kernels.chain.drives import gains
from erls.kernels.chain.elimination import solve
from erls.kernels.chain.motion import place_frames
from erls.kernels.contract import Array, IntArray
from erls.kernels.jit import kernel


@kernel(contract.RESIDUAL)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f; see `erls.kernels.contract`."""
    balance(reals, integers, scratch, t, y, v, a, out)


@kernel(contract.STIFFNESS_AND_DAMPING)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Modal stiffness and damping, joint springs, dampers, friction and controller gains: all on the diagonals."""
    k[:, :] = 0.0
    c[:, :] = 0.0
    for link in range(integers[at.LINKS]):
        record = at.HEADER + link * at.RECORD
        first = integers[record + at.FIRST_MODE]
        for i in range(integers[record + at.MODES]):
            k[first + i, first + i] = reals[integers[record + at.STIFFNESS] + i]
            c[first + i, first + i] = reals[integers[record + at.DAMPING] + i]
        joint = integers[record + at.JOINT]
        if joint >= 0 and integers[record + at.EFFORT]:
            k[joint, joint], c[joint, joint] = gains(reals, integers, record, v[joint])


@kernel(contract.MASS_MATRIX)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M; see `erls.kernels.contract`."""
    place_frames(reals, integers, scratch, t, y, y, scratch[0:0])
    mass(reals, integers, scratch, out)


@kernel(contract.ACCELERATION)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.kernels.contract`."""
    balance(reals, integers, scratch, t, y, v, scratch[0:0], out)
    for i in range(len(out)):
        out[i] = -out[i]
    return solve(reals, integers, scratch, out)
