"""Damping of modes."""

from __future__ import annotations

import numpy as np

from fe_import.description.records import Damping
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array


def damping_ratios(damping: Damping, omega: Array, where: str) -> Array:
    """(m,) modal damping ratios; 0 for rigid-body modes. Rayleigh: ζ = α / 2ω + β ω / 2.

    Raises
    ------
    FEImportError
        More ratios than elastic modes.
    """
    result = np.zeros(len(omega))
    elastic = omega[6:]
    if damping.ratio is not None:
        result[6:] = damping.ratio
    elif damping.ratios is not None:
        if len(damping.ratios) > len(elastic):
            raise FEImportError(
                Cause.BAD_FIELD,
                "more damping ratios than elastic modes",
                where=f"{where}: damping.ratios",
                value=len(damping.ratios),
                limit=len(elastic),
                remedy="give one per elastic mode, from the lowest on",
            )
        result[6 : 6 + len(damping.ratios)] = damping.ratios
    elif damping.rayleigh is not None:
        result[6:] = damping.rayleigh.alpha / (2 * elastic) + damping.rayleigh.beta * elastic / 2
    return result
