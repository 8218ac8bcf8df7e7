"""Constant inertia invariants of a reduced link: what is left of its mass matrix once the modes are chosen.

With w the nodal velocities (translation and rotation) in the link's frame, s = q̇ + ρ ν the modal velocities with
the rigid motion ν = [v₀; ω] of the frame included, A_a the field q ↦ e_a × (nodal displacement, nodal rotation):

    w = U s + Σ_a ω_a A_a U q,
    T = ½ wᵀ M w = ½ sᵀ m s + Σ_a ω_a sᵀ X_a q + ½ Σ_ab ω_a ω_b qᵀ Z_ab q.

m, X_a and Z_ab are the invariants (ERLS-CMS paper, appendix C, for any mass matrix M).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fe_import.model import Array, IntArray

if TYPE_CHECKING:
    import scipy.sparse as sp

_BLOCK = 8  # modes turned and weighted at a time: fields of a large model are long


@dataclass(frozen=True)
class InertiaInvariants:
    """Inertia of a reduced link in its own frame.

    Attributes
    ----------
    m : (n, n) array
        UᵀMU [modal].
    X : (3, n, n) array
        UᵀM A_a U.
    Z : (3, 3, n, n) array
        UᵀA_aᵀ M A_b U.
    rigid : (n, 6) array
        ρ: modal coordinates of unit translations and unit rotations about the frame's origin.
    """

    m: Array
    X: Array
    Z: Array
    rigid: Array

    def __add__(self, other: InertiaInvariants) -> InertiaInvariants:
        """Inertia of the link with a payload on it (same modes)."""
        return InertiaInvariants(self.m + other.m, self.X + other.X, self.Z + other.Z, self.rigid)

    def __sub__(self, other: InertiaInvariants) -> InertiaInvariants:
        """Those of a link without some of its masses."""
        return InertiaInvariants(self.m - other.m, self.X - other.X, self.Z - other.Z, self.rigid)

    def truncated(self, modes: NDArray[np.int64]) -> InertiaInvariants:
        """The invariants of some of the modes, in the given order."""
        ix = np.ix_(modes, modes)
        rows, columns = ix
        return InertiaInvariants(
            self.m[ix], self.X[:, rows, columns], self.Z[:, :, rows, columns], self.rigid[modes]
        )

    @property
    def rigid_mass_matrix(self) -> Array:
        """(6, 6) mass matrix of the undeformed link about its frame's origin."""
        return np.asarray(self.rigid.T @ self.m @ self.rigid)


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m²], in the mesh frame."""

    mass: float
    centre_of_mass: Array
    inertia: Array


def mass_properties(rigid_mass_matrix: Array) -> MassProperties:
    """Mass, centre of mass and central inertia from the 6x6 mass matrix about the origin.

    The matrix is [[μ 1, -μ c×], [μ c×, J₀]]; with a consistent frame mass it has this form exactly as well.
    """
    mass = float(np.trace(rigid_mass_matrix[:3, :3]) / 3)
    if mass <= 0:
        return MassProperties(0.0, np.zeros(3), rigid_mass_matrix[3:, 3:].copy())
    moment = rigid_mass_matrix[3:, :3]  # μ c×
    c = np.array([moment[2, 1] - moment[1, 2], moment[0, 2] - moment[2, 0], moment[1, 0] - moment[0, 1]]) / (
        2 * mass
    )
    inertia = rigid_mass_matrix[3:, 3:] - mass * (c @ c * np.eye(3) - np.outer(c, c))
    return MassProperties(mass, c, (inertia + inertia.T) / 2)


def turned(fields: Array, dof_map: IntArray, axis: int) -> Array:
    """A_a: the cross product of unit vector ``axis`` with every nodal displacement and nodal rotation.

    Parameters
    ----------
    fields : (d, n) array
        Displacement fields over all nodal components.
    dof_map : (nodes, 6) int array
    """
    result = np.zeros_like(fields)
    b, c = (axis + 1) % 3, (axis + 2) % 3  # e_a × e_b = e_c, e_a × e_c = -e_b
    for offset in (0, 3):
        rows = dof_map[:, offset : offset + 3]
        rows = rows[(rows >= 0).all(axis=1)]
        result[rows[:, c]] = fields[rows[:, b]]
        result[rows[:, b]] = -fields[rows[:, c]]
    return result


def inertia_invariants(
    mass: sp.csc_array, shapes: Array, dof_map: IntArray, rigid: Array
) -> InertiaInvariants:
    """Invariants of a mass matrix and mode shapes.

    Parameters
    ----------
    mass : (d, d) sparse
        Over all nodal components.
    shapes : (d, n) array
        U.
    dof_map : (nodes, 6) int array
    rigid : (n, 6) array
        Modal coordinates of the rigid-body motions.
    """
    count = shapes.shape[1]
    m, x, z = np.empty((count, count)), np.empty((3, count, count)), np.empty((3, 3, count, count))
    for start in range(0, count, _BLOCK):
        some = slice(start, start + _BLOCK)
        m[:, some] = shapes.T @ (mass @ shapes[:, some])
        for b in range(3):
            weighted = mass @ turned(shapes[:, some], dof_map, b)
            x[b, :, some] = shapes.T @ weighted
            for a in range(3):  # A_aᵀ = -A_a
                z[a, b, :, some] = -shapes.T @ turned(weighted, dof_map, a)
    return InertiaInvariants((m + m.T) / 2, x, z, rigid)
