"""How well a reduced link knows the forces of its rotation: its invariants against those of a rigid body.

X_a holds the centrifugal and Coriolis terms. Where every node has its rows they are exact; a superelement knows them
at its kept nodes only (see `fe_import.exports.superelement`). For rotations ρ_b, ρ_c the exact value follows from the
inertia, which a superelement does know, with S = ∫ x xᵀ dm = ½ tr(J) 1 - J:

    ρ_cᵀ X_a ρ_b = ∫ (e_c × x) · (e_a × (e_b × x)) dm = (e_b × e_c) · S e_a.
"""

from __future__ import annotations

import numpy as np

from fe_import.modal.inertia import InertiaInvariants, mass_properties


def rotation_departure(invariants: InertiaInvariants) -> float:
    """Departure of ρ_cᵀ X_a ρ_b, rotations about the centre of mass, from the exact values.

    Returns
    -------
    float
        Frobenius norm of the difference per that of the exact values.
    """
    properties = mass_properties(invariants.rigid_mass_matrix)
    shift = -np.cross(np.eye(3), properties.centre_of_mass).T  # a rotation about the origin moves the centre
    rotations = invariants.rigid[:, 3:] + invariants.rigid[:, :3] @ shift
    found = np.einsum("ic,aij,jb->cab", rotations, invariants.X, rotations)
    inertia = properties.inertia
    second = np.trace(inertia) / 2 * np.eye(3) - inertia
    axes = np.eye(3)
    exact = np.einsum("bcd,da->cab", np.cross(axes[:, None], axes[None]), second)
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))
