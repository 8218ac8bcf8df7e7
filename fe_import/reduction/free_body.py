"""A free link: its static response by inertia relief, and its modes, though its stiffness is singular.

Inertia relief: loads f are balanced by the inertia of the rigid-body acceleration that they cause, f - M R Rᵀf with
mass-orthonormal rigid-body modes R. Balanced loads need no reaction, so any statically determinate support gives the
same deformation; the six dofs of the first interface are one. What is left of rigid-body motion is removed, Rᵀ M u = 0.
With P = 1 - R RᵀM the response is P K_c⁻¹ Pᵀ f (Craig & Chang, AIAA J. 14, 1976; Rubin, AIAA J. 13, 1975).

The elastic modes are those of the flexibility, P K_c⁻¹ Pᵀ M φ = φ / ω². Over the dofs beside the support, φ = P z, they
are K_c z = ω² PᵀMP z: rigid-body motion has no part in it, and K_c is as well conditioned as a clamped link allows,
however slender it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction.base import expanded, gathered, interface_places
from fe_import.reduction.rigid_modes import rigid_modes
from fe_import.solver.sparse import Factorization, factorize, lowest_modes, modes_below


@dataclass(frozen=True)
class RelievedMass:
    """PᵀMP over some dofs, M - (MR)(MR)ᵀ there.

    Attributes
    ----------
    mass : (r, r) sparse CSC
    momentum : (r, 6) array
        MR: momenta of the rigid-body modes.
    """

    mass: sp.csc_array
    momentum: Array

    def __matmul__(self, fields: Array) -> Array:
        return np.asarray(self.mass @ fields - self.momentum @ (self.momentum.T @ fields))

    @property
    def shape(self) -> tuple[int, int]:
        """(r, r)."""
        return len(self.momentum), len(self.momentum)

    def diagonal(self) -> Array:
        """(r,) of the mass: none is massless but by having no mass."""
        return np.asarray(self.mass.diagonal())

    def count_nonzero(self) -> int:
        """Entries of the mass."""
        return int(self.mass.count_nonzero())

    def toarray(self) -> Array:
        """(r, r) dense."""
        return np.asarray(self.mass.toarray() - self.momentum @ self.momentum.T)


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

    def held(self, loads: Array, reference: int) -> Array:
        """(f, k) static answer to loads (f, k) with an interface held, by the factors of the support at the first one:
        what that interface bears holds the loads in balance, so that either support does.
        """
        places = self.interfaces[6 * reference : 6 * reference + 6]
        right = loads.copy()
        right[places] -= np.linalg.solve(self.rigid[places].T, self.rigid.T @ loads)
        found = np.zeros_like(loads)
        if len(self._rest):
            found[self._rest] = self._solve(np.ascontiguousarray(right[self._rest]))
        return np.asarray(found - self.rigid @ np.linalg.solve(self.rigid[places], found[places]))

    def modes(self, count: int) -> tuple[Array, Array]:
        """Lowest elastic modes.

        Parameters
        ----------
        count : int

        Returns
        -------
        omega : (m,) array
            Rising [rad/s]; m < ``count`` where there are no more.
        modes : (f, m) array
            Mass-orthonormal, free of rigid-body motion.

        Raises
        ------
        FEImportError
            NOT_DEFINITE: some part can move without strain; EIGENSOLVER: the solver failed, or a mode is missing.
        """
        rest = self._rest
        momentum = (self.mass @ self.rigid)[rest]
        relieved = RelievedMass(self.mass[rest][:, rest].tocsc(), momentum)

        def below(shift: float) -> int | None:
            count = modes_below(self.stiffness, self.mass, shift, positions=self.places)
            return None if count is None else count - 6

        omega, found = lowest_modes(
            self._supported, relieved, count, "free link", solve=self._solve if len(rest) else None, below=below
        )
        modes = np.zeros((self.mass.shape[0], found.shape[1]))
        modes[rest] = found
        return omega, self.elastic(modes)

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


def inertia_relief(model: FEModel, loads: Array) -> Array:
    """Elastic displacement of the free link under constant loads, in the frame that the rigid-body modes follow.

    Parameters
    ----------
    model : FEModel
    loads : (d, k) array
        On all nodal components; what is out of balance accelerates the link as a rigid body.

    Returns
    -------
    (d, k) array
        Pᵀ K⁺ P of the loads, P = 1 - M R Rᵀ; no mode of the link is left out.
    """
    return expanded(model, free_body(model, model.source).static(gathered(model, loads)))
