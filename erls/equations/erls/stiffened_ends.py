"""Motion of the frames that loops hold on links with second-order displacements."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.ends import put_frames
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.FRAMES, counted=False)
def frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """As `erls.equations.erls.ends.frames`."""
    put_frames(reals, integers, scratch, t, y, v, out, True)
