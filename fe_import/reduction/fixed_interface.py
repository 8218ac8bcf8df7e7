"""The two halves of a link, interfaces and inner dofs, and the fields that belong to them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe_import.modal.inertia import mass_properties
from fe_import.model import Array, FEModel, IntArray, eliminated
from fe_import.reduction.base import HeldSolution, expanded, interface_places
from fe_import.solver.products import times
from fe_import.solver.sparse import Factorization, factorize
from fe_import.solver.threads import one_thread_each


@dataclass(frozen=True)
class Partition:
    """Matrices over the independent dofs by interface dofs (b) and inner dofs (i).

    Those over all f = b + i dofs are made when they are asked for: of a large model they fill as much memory as the
    model itself.

    Attributes
    ----------
    model : FEModel
    boundary, inner : int arrays
        Positions of the interface dofs, in the order of the interfaces, and of all others.
    rigid : (f, 6) array
        Unit translations, and unit rotations about the centre of mass.
    rigid_forces : (f, 6) array
        Mass times these.
    inner_mass, inner_stiffness : (i, i) sparse CSC
        M_ii, K_ii.
    boundary_stiffness : (i, b) array
        K_ib.
    """

    model: FEModel
    boundary: IntArray
    inner: IntArray
    rigid: Array
    rigid_forces: Array
    inner_mass: sp.csc_array
    inner_stiffness: sp.csc_array
    boundary_stiffness: Array

    @property
    def mass(self) -> sp.csc_array:
        """(f, f) mass matrix."""
        return self.model.reduced_matrices()[0]

    @property
    def stiffness(self) -> sp.csc_array:
        """(f, f) stiffness matrix."""
        return self.model.reduced_matrices()[1]

    @property
    def rigid_mass(self) -> Array:
        """(6, 6) mass matrix of the rigid-body motions."""
        return np.asarray(self.rigid.T @ self.rigid_forces)

    @property
    def inertia(self) -> Array:
        """(i, 6) inertia forces on the inner dofs per unit rigid-body acceleration."""
        return self.rigid_forces[self.inner]

    def static(self, loads: Array) -> Array:
        """Response of the inner dofs to loads on them, interfaces clamped, with one step of iterative refinement."""
        with one_thread_each():
            found = self.solve(loads)
            return np.asarray(found + self.solve(loads - times(self.inner_stiffness, found)))

    @cached_property
    def solve(self) -> Factorization:
        """Of K_ii."""
        positions = self.model.dof_positions()[self.inner]
        return factorize(self.inner_stiffness, "stiffness of the inner nodes", positions)

    def held(self, constraint: Array) -> HeldSolution:
        """Static answers by the factors of K_ii and constraint modes Ψ.

        With f_c = Ψᵀ f at the interfaces that are free, u = Ψ (Ψᵀ K Ψ)⁻¹ f_c + K_ii⁻¹ f_i.
        """
        model, solve, inner = self.model, self.solve, self.inner  # and no matrix, which would stay in memory
        fields = expanded(model, constraint)
        stiffness = fields.T @ (model.stiffness @ fields)

        def solution(loads: Array, reference: int) -> Array:
            free = np.delete(np.arange(len(stiffness)), np.s_[6 * reference : 6 * reference + 6])
            found = constraint[:, free] @ np.linalg.solve(stiffness[np.ix_(free, free)], constraint[:, free].T @ loads)
            found[inner] += solve(np.ascontiguousarray(loads[inner]))
            return np.asarray(found)

        return solution

    def clamped_field(self, inner: Array) -> Array:
        """(f, k) fields with the interfaces at rest."""
        fields = np.zeros((len(self.rigid), inner.shape[1]))
        fields[self.inner] = inner
        return fields


def partition(model: FEModel) -> Partition:
    """Matrices of a model, coupling eliminated, by interface and inner dofs."""
    boundary = interface_places(model)
    inner = np.setdiff1d(np.arange(len(model.independent)), boundary)
    fields = model.rigid_body_modes()
    rigid = fields[model.independent]
    centre = mass_properties(fields.T @ (model.mass @ fields)).centre_of_mass
    for axis in range(3):
        rigid[:, 3 + axis] -= rigid[:, :3] @ np.cross(np.eye(3)[axis], centre)
    unit = np.zeros((len(rigid), len(boundary)))
    unit[boundary, np.arange(len(boundary))] = 1.0
    forces, held = (
        _reduced(model, times(matrix, expanded(model, moved)))
        for matrix, moved in ((model.mass, rigid), (model.stiffness, unit))
    )
    return Partition(
        model, boundary, inner, rigid, forces, _inner(model, model.mass, inner), _inner(model, model.stiffness, inner),
        np.ascontiguousarray(held[inner]),
    )  # fmt: skip


def _reduced(model: FEModel, loads: Array) -> Array:
    """(f, k) loads on the independent dofs."""
    return loads if model.coupling is None else np.asarray(model.coupling.T @ loads)


def _inner(model: FEModel, matrix: sp.csc_array, inner: IntArray) -> sp.csc_array:
    """(i, i) of a matrix over all components."""
    coupling = model.coupling
    if coupling is None:
        coupling = sp.eye_array(matrix.shape[0], format="csc")[:, model.independent]
    return eliminated(matrix, coupling[:, inner])


def constraint_modes(parts: Partition) -> Array:
    """(f, b) unit displacements of each interface dof, the inner dofs free of force: Ψ = -K_ii⁻¹ K_ib.

    Exact constraint modes reproduce rigid-body motions, Ψ R_b = R_i. Rounding breaks that by its product with the
    condition of K_ii (1e-9 on a slender solid); the smallest change of Ψ that restores it is added.

    Raises
    ------
    FEImportError
        The inner stiffness is singular.
    """
    count = len(parts.boundary)
    fields = np.zeros((len(parts.rigid), count))
    fields[parts.boundary, np.arange(count)] = 1.0
    if len(parts.inner):
        psi = -parts.static(parts.boundary_stiffness)
        rigid = parts.rigid[parts.boundary]
        fields[parts.inner] = psi + (parts.rigid[parts.inner] - psi @ rigid) @ np.linalg.pinv(rigid)
    return fields
