"""Coordinates that do not move, flagged by 1 in (n,) numbers: what this makes of the functions of a system.

Row k of M a - f becomes a_k = 0, and column k is left out, also of the rows by which coordinates move frames. What
else is asked of the system (conditions of loops, the nearest closed state) then leaves these coordinates alone.
"""

from __future__ import annotations

from erls.maths.jit import part
from erls.maths.so3 import Array


@part
def still_forces(held: Array, a: Array, out: Array) -> None:
    """Of forces out of balance (n,); an empty ``a`` stands for zeros."""
    for k in range(len(held)):
        if held[k] != 0.0:
            out[k] = a[k] if len(a) > 0 else 0.0 * out[k]


@part
def still_matrix(held: Array, diagonal: float, out: Array) -> None:
    """Of a matrix (n, n)."""
    for k in range(len(held)):
        if held[k] != 0.0:
            for i in range(len(held)):
                out[k, i] = out[i, k] = 0.0
            out[k, k] = diagonal


@part
def still_frames(held: Array, frames: Array) -> None:
    """Of the rows of frames, see `erls.equations.compiled_system`."""
    columns = (frames.shape[1] - 24) // 6
    for k in range(len(held)):
        if held[k] != 0.0:
            for number in range(len(frames)):
                for i in range(6):
                    frames[number, 24 + i * columns + k] = 0.0
