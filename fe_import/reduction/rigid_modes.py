"""Mass-orthonormal rigid-body modes from the six unit motions."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as la

from fe_import.errors import Cause, FEImportError
from fe_import.modal.inertia import mass_properties
from fe_import.model import Array

MASSLESS = 1e-12  # of the largest; the thinnest wire has 1e-8, rounding 1e-15


def rigid_modes(mass: Any, motions: Array, where: str) -> tuple[Array, Array]:
    """Mass-orthonormal rigid-body modes.

    Parameters
    ----------
    mass : (k, k) array or sparse
    motions : (k, 6) array
        Unit translations, and unit rotations about the origin.
    where : str
        File, for messages.

    Returns
    -------
    modes : (k, 6) array
    coordinates : (6, 6) array
        Of the unit motions in the modes.

    Raises
    ------
    FEImportError
        NOT_DEFINITE: no mass, or no inertia about some axis.
    """
    centre = mass_properties(motions.T @ mass @ motions).centre_of_mass
    shift = np.eye(6)  # to rotations about the centre of mass, so that a distant origin costs no digits
    shift[:3, 3:] = -np.stack([np.cross(axis, centre) for axis in np.eye(3)], axis=1)
    central = motions @ shift
    rigid_mass = central.T @ mass @ central
    size = np.sqrt(np.diag(rigid_mass))
    inertia = np.linalg.eigvalsh(rigid_mass[3:, 3:])
    if not size[:3].all() or inertia[0] <= MASSLESS * inertia[-1]:
        raise FEImportError(
            Cause.NOT_DEFINITE,
            "the link has no mass or no inertia about some axis",
            where=where,
            remedy="give it density, rotary inertia or point masses off one line",
        )
    factor = la.cholesky(rigid_mass, lower=True)
    back = 2 * np.eye(6) - shift  # its inverse
    return la.solve_triangular(factor, central.T, lower=True).T, factor.T @ back
