"""Accelerations, by Cholesky factors of the mass matrix."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.mass import mass_matrix
from erls.equations.ffr.records import read_frames, read_room
from erls.equations.ffr.residual import residual
from erls.equations.serial.records import read_serial
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray

_SINGULAR = 1e-14  # inertia of a coordinate against what it was before the elimination of those before it


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    frames = read_frames(reals, integers, read_serial(reals, integers, integers[0]).own)
    matrix = read_room(scratch, integers, frames.room).matrix
    mass_matrix(reals, integers, scratch, t, y, matrix)
    residual(reals, integers, scratch, t, y, v, y[0:0], out)
    status = cholesky(matrix, _SINGULAR)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        forward(matrix, out)
        backward(matrix, out)
    return status
