"""A chain whose fast modes follow statically, as records behind those of the chain with all modes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.maths.records import Matrix, Vector, reader, table_size
from erls.maths.so3 import Array


class Reduced(NamedTuple):
    """Constants of the reduction y = W z + H η, from n to s coordinates with h static ones.

    Attributes
    ----------
    state : int
        Place of the `ReducedState`.
    light : int
        Place of the `erls.equations.serial.records.Serial` of the chain without what deformation adds to inertia.
    slow, static : (s, n), (h, n) arrays
        Wᵀ and Hᵀ.
    kappa : (h,) array
        Stiffness of the static modes.
    stiffness, damping : (s, s) arrays
        Wᵀ K W and Wᵀ C W of the links.
    squares : (s,) array
        Of the frequencies of the slow coordinates [1/s²].
    lapse : float
        Step of differences in time [s].
    ends : array
        Times at which forces jump.
    """

    state: int
    light: int
    slow: Matrix
    static: Matrix
    kappa: Vector
    stiffness: Matrix
    damping: Matrix
    squares: Vector
    lapse: float
    ends: Vector


class ReducedState(NamedTuple):
    """Working memory.

    Attributes
    ----------
    place, rate, acceleration, force : (n,) arrays
        Motion of all modes, and what it leaves out of balance.
    eta, found, found_rate, change : (h,) arrays
        η guessed, found, its rate, and its correction.
    near_place, near_rate, near_acceleration, left : (s,) arrays
        Motion at times nearby; forces out of balance.
    matrix, other : (n, n) arrays
    half, masses, factor : (s, n), (s, s), (s, s) arrays
    """

    place: Vector
    rate: Vector
    acceleration: Vector
    force: Vector
    eta: Vector
    found: Vector
    found_rate: Vector
    change: Vector
    near_place: Vector
    near_rate: Vector
    near_acceleration: Vector
    left: Vector
    matrix: Matrix
    other: Matrix
    half: Matrix
    masses: Matrix
    factor: Matrix


def reduced_state(n: int, s: int, h: int) -> ReducedState:
    """Memory for a reduction."""

    def room(*shape: int) -> Array:
        return np.zeros(shape)

    return ReducedState(
        place=room(n),
        rate=room(n),
        acceleration=room(n),
        force=room(n),
        eta=room(h),
        found=room(h),
        found_rate=room(h),
        change=room(h),
        near_place=room(s),
        near_rate=room(s),
        near_acceleration=room(s),
        left=room(s),
        matrix=room(n, n),
        other=room(n, n),
        half=room(s, n),
        masses=room(s, s),
        factor=room(s, s),
    )


read_reduced, read_reduced_state = reader(Reduced), reader(ReducedState)
REDUCED = table_size(Reduced)
