"""Inertia as descriptions and scenes give it."""

from __future__ import annotations

import numpy as np

from fe_import.description.base import Inertia
from fe_import.errors import Cause, FEImportError, ReportedError
from fe_import.model import Array


def inertia_matrix(given: Inertia, where: str, error: type[ReportedError] = FEImportError) -> Array:
    """(3, 3) inertia from ``[Ixx, Iyy, Izz]`` or three rows.

    Raises
    ------
    ReportedError
        Of class ``error``: not finite, not symmetric, or not positive semidefinite.
    """
    inertia = np.zeros((3, 3))
    for k, row in enumerate(given):
        if isinstance(row, tuple):
            inertia[k] = row
        else:
            inertia[k, k] = row
    scale = np.abs(inertia).max(initial=0.0)
    ok = np.isfinite(inertia).all() and np.abs(inertia - inertia.T).max() <= 1e-9 * scale
    if not ok or np.linalg.eigvalsh(inertia).min() < -1e-9 * scale:
        raise error(
            Cause.BAD_FIELD,
            "an inertia must be finite, symmetric and not negative",
            where=where,
            value=inertia.tolist(),
            remedy="give [Ixx, Iyy, Izz] or a symmetric 3x3 matrix about the node",
        )
    return inertia
