"""A free link: its static response by inertia relief, and its modes, though its stiffness is singular.

Inertia relief: loads f are balanced by the inertia of the rigid-body acceleration that they cause, f - M R Rᵀf with
mass-orthonormal rigid-body modes R. Balanced loads need no reaction, so any statically determinate support gives the
same deformation; the six dofs of the first interface are one. What is left of rigid-body motion is removed, Rᵀ M u = 0.
With P = 1 - R RᵀM the response is P K_c⁻¹ Pᵀ f (Craig & Chang, AIAA J. 14, 1976; Rubin, AIAA J. 13, 1975).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction.base import interface_places
from fe_import.reduction.rigid_modes import rigid_modes
from fe_import.sparse import Factorization, dense_modes, factorize, lowest_modes

_RIGID = 1e-6  # ω² of a rigid-body mode, per the shift; rounding leaves 1e-9 on a slender solid


@dataclass(frozen=True)
class FreeBody:
    """A link over its independent dofs.

    Attributes
    ----------
    mass, stiffness : (f, f) sparse CSC
    rigid : (f, 6) array
        Mass-orthonormal rigid-body modes.
    motions : (6, 6) array
        Coordinates of unit translations and unit rotations about the mesh origin in them.
    interfaces : (b,) int array
        Positions of the interface dofs; the first six are the support.
    places : (f, 3) array
        Where each dof sits.
    """

    mass: sp.csc_array
    stiffness: sp.csc_array
    rigid: Array
    motions: Array
    interfaces: IntArray
    places: Array

    @cached_property
    def _rest(self) -> IntArray:
        return np.setdiff1d(np.arange(self.mass.shape[0]), self.interfaces[:6])

    @cached_property
    def _supported(self) -> sp.csc_array:
        return self.stiffness[self._rest][:, self._rest].tocsc()

    @cached_property
    def _solve(self) -> Factorization:
        what = "stiffness of the link held at its first interface"
        return factorize(self._supported, what, self.places[self._rest])

    def elastic(self, fields: Array) -> Array:
        """The fields without their rigid-body motion."""
        for _ in range(2):
            fields = fields - self.rigid @ (self.rigid.T @ (self.mass @ fields))
        return fields

    def balanced(self, loads: Array) -> Array:
        """The loads, balanced by inertia."""
        return np.asarray(loads - self.mass @ (self.rigid @ (self.rigid.T @ loads)))

    def static(self, loads: Array) -> Array:
        """(f, n) elastic response to loads (f, n), with one step of iterative refinement.

        Raises
        ------
        FEImportError
            NOT_DEFINITE: some part can move without strain.
        """
        right = self.balanced(loads)[self._rest]
        found = np.zeros_like(loads)
        if len(self._rest):
            found[self._rest] = self._solve(right)
            found[self._rest] += self._solve(right - self._supported @ found[self._rest])
        return self.elastic(found)

    def interface_loads(self) -> Array:
        """(f, b) unit loads at the interface dofs."""
        loads = np.zeros((self.mass.shape[0], len(self.interfaces)))
        loads[self.interfaces, np.arange(len(self.interfaces))] = 1.0
        return loads


def free_body(model: FEModel, where: str) -> FreeBody:
    """The free link of a model, coupling eliminated.

    Raises
    ------
    FEImportError
        NOT_DEFINITE: no mass, or no inertia about some axis.
    """
    mass, stiffness = model.reduced_matrices()
    rigid, motions = rigid_modes(mass, model.rigid_body_modes()[model.independent], where)
    return FreeBody(mass, stiffness, rigid, motions, interface_places(model), model.dof_positions())


def lowest_free_modes(body: FreeBody, static: Array, count: int) -> tuple[Array, Array]:
    """Lowest elastic modes of a free link.

    K + αM is positive definite and has the same modes; α is of the size of the lowest ω², as the best of some static
    fields has it, so that no digits are lost to it. The six modes with ω² = 0 are taken out and the elastic ones freed
    of rigid-body motion before they are solved for again within their span.

    Parameters
    ----------
    body : FreeBody
    static : (f, n) array
        Elastic fields that resemble low modes.
    count : int

    Returns
    -------
    omega : (m,) array
        Rising [rad/s]; m < ``count`` where there are no more.
    modes : (f, m) array
        Mass-orthonormal.

    Raises
    ------
    FEImportError
        EIGENSOLVER: not six rigid-body modes found, or another failure of the solver.
    """
    inertia = np.einsum("fn,fn->n", static, body.mass @ static)
    strain = np.einsum("fn,fn->n", static, body.stiffness @ static)
    moved = inertia > 0
    if count == 0 or not moved.any():
        return np.zeros(0), np.zeros((body.mass.shape[0], 0))
    shift = float((strain[moved] / inertia[moved]).min())
    shifted = (body.stiffness + shift * body.mass).tocsc()
    omega, modes = lowest_modes(shifted, body.mass, count + 6, "free link", positions=body.places)
    above = omega**2 / shift - 1  # ω² of the free link, per the shift
    if (above < _RIGID).sum() != 6:
        raise FEImportError(
            Cause.EIGENSOLVER,
            "modes of the free link: not six rigid-body modes",
            value=int((above < _RIGID).sum()),
            limit=6,
            remedy="ask for more or for fewer modes",
        )
    modes = body.elastic(modes[:, 6:])
    found, turn = dense_modes(modes.T @ (body.stiffness @ modes), modes.T @ (body.mass @ modes), None, "free link")
    return found, modes @ turn
