"""The mass matrix, by composite inertias."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.records import read_frames
from erls.equations.ffr.segments import fill_segments
from erls.equations.serial.records import read_serial
from erls.equations.serial.segments import fill_mass_matrix
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M; see `erls.equations.compiled_system`. Segments are left in the records."""
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    fill_segments(serial, frames, reals, integers, scratch, t, y)
    fill_mass_matrix(serial, frames.segments, reals, integers, scratch, out)
