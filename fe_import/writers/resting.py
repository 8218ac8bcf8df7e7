"""A reduced link in the modes in which its first interface rests: the body in a floating frame that others take.

With these modes B and the invariants m, X_a, Z_ab and ρ of the modal file (`fe_import.modal.inertia`) the constants
of any floating frame are BᵀmB, ρᵀmB, ρᵀX_aB, BᵀX_aB and BᵀZ_abB, for any mass matrix. The frame is the mesh frame,
carried by the first interface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.model import Array


@dataclass(frozen=True)
class RestingBody:
    """Constants of a link with k modes of n modal coordinates, SI.

    Attributes
    ----------
    basis : (n, k) array
        B: modal coordinates of each mode, orthonormal in mass and stiffness, in rising frequency.
    frequencies : (k,) array
        Of the link held there [Hz].
    mass, stiffness : (k, k) arrays
    rigid : (6, 6) array
        ρᵀmρ.
    coupling : (6, k) array
        ρᵀmB.
    mixed : (3, 6, k) array
        ρᵀX_aB.
    first : (3, k, k) array
        BᵀX_aB.
    second : (3, 3, k, k) array
        BᵀZ_abB.
    """

    basis: Array
    frequencies: Array
    mass: Array
    stiffness: Array
    rigid: Array
    coupling: Array
    mixed: Array
    first: Array
    second: Array


def resting_body(model: ModalModel, kind: str) -> RestingBody:
    """The constants; ``kind`` says what needs them.

    Raises
    ------
    FEImportError
        ``MODE_COUNT``: no elastic mode.
    """
    inertia, rho = model.invariants, model.invariants.rigid
    moved, turned = model.node_shape(model.interface_nodes[0].node)
    held = la.null_space(np.concatenate([moved, np.zeros((0, model.modes)) if turned is None else turned]))
    if not held.shape[1]:
        message, remedy = f"{kind} needs an elastic mode", "keep some, or use a rigid body there"
        raise FEImportError(Cause.MODE_COUNT, message, where=model.name, value=0, limit=1, remedy=remedy)
    omega2, modes = la.eigh(held.T @ model.stiffness @ held, held.T @ inertia.m @ held)
    basis = np.asarray(held @ modes)
    return RestingBody(
        basis=basis,
        frequencies=np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi),
        mass=basis.T @ inertia.m @ basis,
        stiffness=basis.T @ model.stiffness @ basis,
        rigid=inertia.rigid_mass_matrix,
        coupling=rho.T @ inertia.m @ basis,
        mixed=rho.T @ inertia.X @ basis,
        first=basis.T @ inertia.X @ basis,
        second=basis.T @ inertia.Z @ basis,
    )
