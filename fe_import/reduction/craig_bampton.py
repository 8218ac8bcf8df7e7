"""Craig-Bampton reduction: constraint modes and fixed-interface modes (Craig & Bampton, AIAA J. 6, 1968)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.link import Reduction
from fe_import.modal_file import FixedInterfaceModes
from fe_import.model import Array, FEModel
from fe_import.reduction.base import Basis
from fe_import.sparse import factorize, lowest_modes

DEFAULT_MODES = 12


def craig_bampton(model: FEModel, options: Reduction, where: str) -> Basis:
    """Basis of constraint modes (unit displacement of one interface dof, inner dofs free of force) and modes with
    all interfaces clamped.

    Raises
    ------
    FEImportError
        The inner stiffness is singular, or more fixed-interface modes are asked for than there are.
    """
    mass, stiffness = model.reduced_matrices()
    place = np.full(model.mass.shape[0], -1)
    place[model.independent] = np.arange(len(model.independent))
    boundary = place[model.interface_dofs]
    inner = np.setdiff1d(np.arange(len(model.independent)), boundary)
    count = len(boundary)
    k_ii, m_ii = stiffness[inner][:, inner].tocsc(), mass[inner][:, inner].tocsc()

    constraint = np.zeros((len(model.independent), count))
    constraint[boundary, np.arange(count)] = 1.0
    rigid_fields = model.rigid_body_modes()
    rigid = rigid_fields[model.interface_dofs]
    if len(inner):
        constraint[inner] = _constraint_modes(
            k_ii, stiffness[inner][:, boundary].toarray(), rigid, rigid_fields[model.independent[inner]]
        )

    asked = options.fixed_interface_modes
    wanted = min(DEFAULT_MODES, len(inner)) if asked is None else asked
    omega, modes = (
        lowest_modes(k_ii, m_ii, min(wanted, len(inner)), "link with clamped interfaces")
        if len(inner)
        else (np.zeros(0), np.zeros((0, 0)))
    )
    if asked is not None and len(omega) < asked:
        raise FEImportError(
            Cause.MODE_COUNT,
            "the model has fewer fixed-interface modes",
            where=f"{where}: reduction.fixed_interface_modes",
            value=asked,
            limit=len(omega),
            remedy="ask for fewer, refine the mesh, or give the mass matrix rotary inertia",
        )
    fixed = np.zeros((len(model.independent), len(omega)))
    fixed[inner] = modes
    vectors = np.hstack([constraint, fixed])
    full = vectors if model.coupling is None else np.asarray(model.coupling @ vectors)
    coordinates = np.zeros((vectors.shape[1], 6))
    coordinates[:count] = rigid
    return Basis(full, count, coordinates, _effective_mass(model, full[:, count:], omega, rigid_fields))


def _constraint_modes(k_ii: sp.csc_array, k_ib: Array, rigid: Array, rigid_inner: Array) -> Array:
    """Ψ = -K_ii⁻¹ K_ib, with one step of iterative refinement.

    Exact constraint modes reproduce rigid-body motions, Ψ R_b = R_i. Rounding breaks that by its product with the
    condition of K_ii (1e-9 on a slender solid); the smallest change of Ψ that restores it is added.
    """
    solve = factorize(k_ii, "stiffness of the inner nodes")
    psi = -solve(k_ib)
    psi -= solve(k_ii @ psi + k_ib)
    return np.asarray(psi + (rigid_inner - psi @ rigid) @ np.linalg.pinv(rigid))


def _effective_mass(model: FEModel, modes: Array, omega: Array, rigid_fields: Array) -> FixedInterfaceModes:
    """Share of mass, and of inertia about the centre of mass, that each fixed-interface mode carries."""
    weighted = model.mass @ rigid_fields
    rigid_mass = rigid_fields.T @ weighted
    mass = rigid_mass[0, 0]
    centre = np.array([rigid_mass[5, 1], rigid_mass[3, 2], rigid_mass[4, 0]]) / mass
    shift = np.eye(6)  # rotations about the centre of mass: ω × (x - c)
    for axis in range(3):
        shift[:3, 3 + axis] = -np.cross(np.eye(3)[axis], centre)
    participation = modes.T @ (weighted @ shift)
    total = np.diag(shift.T @ rigid_mass @ shift)
    share = np.divide(participation**2, total, out=np.zeros_like(participation), where=total > 1e-12 * total.max())
    return FixedInterfaceModes(omega / (2 * np.pi), share)
