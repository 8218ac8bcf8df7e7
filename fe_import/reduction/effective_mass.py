"""Effective mass of fixed-interface modes (Kammer & Triller, J. Vibration and Acoustics 118, 1996, for selection)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import FixedInterfaceModes
from fe_import.model import Array
from fe_import.reduction.fixed_interface import Partition

_MASSLESS = 1e-12  # of the largest; rounding leaves 1e-15


def fixed_interface_table(parts: Partition, omega: Array, modes: Array) -> FixedInterfaceModes:
    """Frequencies, and the share of the link's mass and of its inertia about the centre of mass in each mode."""
    participation = modes.T @ parts.inertia
    total = np.diag(parts.rigid_mass)
    share = np.divide(participation**2, total, out=np.zeros_like(participation), where=total > _MASSLESS * total.max())
    return FixedInterfaceModes(omega / (2 * np.pi), share)


def carried_shares(parts: Partition) -> Callable[[Array], Array]:
    """Share that modes carry of what all fixed-interface modes together do, per rigid-body direction.

    All together carry bᵀ M_ii⁻¹ b with b the inertia forces on the inner dofs; the rest of the link's mass sits on
    the interfaces and moves with the constraint modes. Directions without such mass are NaN.

    Returns
    -------
    callable
        From inner shapes (i, m) to shares (m, 6).
    """
    inertia = parts.inertia
    carried = np.array([b @ _mass_solve(parts.inner_mass, b) for b in inertia.T])
    total = np.diag(parts.rigid_mass)
    carried[carried <= 1e-9 * total] = np.nan

    def shares(modes: Array) -> Array:
        return np.asarray((modes.T @ inertia) ** 2 / carried)

    return shares


def _mass_solve(mass: sp.csc_array, right: Array) -> Array:
    """M⁻¹ b by conjugate gradients, which also serve a semidefinite mass matrix with b in its range."""
    diagonal = mass.diagonal()
    scale = np.where(diagonal > 0, diagonal, 1.0)
    if not right.any():
        return np.zeros_like(right)
    found, failed = spla.cg(mass, right, rtol=1e-10, maxiter=2000, M=sp.diags_array(1 / scale))
    if failed:
        raise FEImportError(
            Cause.EIGENSOLVER,
            "the mass that fixed-interface modes can carry did not converge",
            limit="2000 iterations",
            remedy="choose modes by count or frequency",
        )
    return np.asarray(found)
