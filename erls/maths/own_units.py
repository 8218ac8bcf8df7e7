"""Matrices of stiffness or inertia in the units of their diagonals: forces and moments are far apart."""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array


def in_own_units(matrices: Array) -> Array:
    """(..., n, n) matrices with a diagonal of 1, where it is positive; what is symmetric and definite stays so."""
    own = np.diagonal(matrices, axis1=-2, axis2=-1)
    units = np.sqrt(np.where(own > 0, own, 1.0))
    return np.asarray(matrices / (units[..., :, None] * units[..., None, :]))
