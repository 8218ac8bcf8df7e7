"""Thermal expansion in a reduction: the static shape of the expanding link is one more vector of any basis.

Constraint modes and vibration modes span it only by chance: what expands between the interfaces, or beyond them,
loads inner nodes. With the shape of the free link, u = K⁺ f, every static answer to f and to loads that the basis holds
is exact, however the interfaces are held.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg as la

from fe_import.model import Array, FEModel
from fe_import.reduction import Basis
from fe_import.reduction.free_body import inertia_relief
from fe_import.reduction.modes import column_scale, reduced_matrices

_NEW = 1e-7  # share of the shape, in the energy norm, that the basis lacks; rounding leaves 1e-9 and less


def with_thermal_shape(model: FEModel, basis: Basis) -> Basis:
    """The basis, completed by what it lacks of the expanded shape; as it is where there is no temperature change.

    Raises
    ------
    FEImportError
        NOT_DEFINITE: some part can move without strain.
    """
    if model.thermal is None:
        return basis
    force = model.thermal.force
    shape = inertia_relief(model, force[:, None])[:, 0]
    rest = shape - basis.vectors @ _projected(model, basis, force)
    energy, lacking = float(force @ shape), float(rest @ (model.stiffness @ rest))
    if lacking > _NEW**2 * energy:
        basis = replace(
            basis,
            vectors=np.column_stack([basis.vectors, rest * np.sqrt(energy / lacking)]),
            rigid=np.vstack([basis.rigid, np.zeros(6)]),
        )
    return replace(basis, thermal=basis.vectors.T @ force)


def _projected(model: FEModel, basis: Basis, force: Array) -> Array:
    """(k,) coordinates of the static answer within the basis, free of rigid-body motion."""
    mass, stiffness = reduced_matrices(model, basis)
    scale = column_scale(mass, stiffness)
    both = np.outer(scale, scale)
    complement = la.qr(mass * both @ (basis.rigid / scale[:, None]))[0][:, 6:]
    factor = la.cho_factor(complement.T @ (stiffness * both) @ complement)
    right = complement.T @ (scale * (basis.vectors.T @ force))
    return np.asarray(scale * (complement @ la.cho_solve(factor, right)))
