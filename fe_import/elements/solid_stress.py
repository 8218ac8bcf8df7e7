"""Stress at the nodes of a solid as a linear map of the nodal displacements.

Strains are taken at the points where those of the element are most accurate (J. Barlow, Int. J. Numer. Methods Eng.
10, 1976: 2 x 2 x 2 Gauss points of hexahedra, 4 points of the tet10, the centre of the tet4), extrapolated to its
nodes by the polynomial through these points, and averaged over the elements that meet at a node. Where two materials
meet, the average is over both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fe_import.elements.solid_elements import SolidElement
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.model import Array, IntArray

_CHUNK_VALUES = 4_000_000  # stress values held at a time


@dataclass(frozen=True)
class SolidStress:
    """The elements of a solid, for their stress; a `fe_import.model.StressSource`. Its sites are the mesh nodes.

    Attributes
    ----------
    mesh : SolidMesh
    lame : (elements, 2) array
        Lamé's λ and μ [Pa] of each element.
    sets : dict
        Nodes of the mesh's node sets and of its element sets.
    """

    mesh: SolidMesh
    lame: Array
    sets: Mapping[str, IntArray]
    quantity: str = "stress"

    @property
    def site_nodes(self) -> IntArray:
        """(n,) the nodes."""
        return np.arange(len(self.mesh.nodes), dtype=np.int64)

    def site_elements(self, sites: IntArray) -> IntArray:
        """(p,) -1: a nodal stress belongs to no element."""
        return np.full(len(sites), -1, dtype=np.int64)

    def site_axes(self, sites: IntArray) -> Array:
        """(p, 3, 3) axes of the mesh frame."""
        return np.tile(np.eye(3), (len(sites), 1, 1))

    def evaluate(self, fields: Array, dof_map: IntArray, sites: IntArray) -> Array:
        """(p, 6, m) stress xx, yy, zz, xy, yz, zx [Pa] of displacement fields (d, m), mesh axes."""
        mesh, element = self.mesh, self.mesh.element
        points, to_nodes = sampling(element)
        gradients = element.shape_gradients(points)
        place = np.full(len(mesh.nodes), -1, dtype=np.int64)
        place[sites] = np.arange(len(sites))
        touching = np.flatnonzero((place[mesh.elements] >= 0).any(axis=1))
        total, count = np.zeros((len(sites), 6, fields.shape[1])), np.zeros(len(sites))
        step = max(1, _CHUNK_VALUES // (len(to_nodes) * 9 * max(1, fields.shape[1])))
        for start in range(0, len(touching), step):
            some = touching[start : start + step]
            nodes = mesh.elements[some]
            jacobian = np.einsum("eka,kbq->eqab", mesh.nodes[nodes], gradients)
            slopes = np.einsum("kbq,eqba->eqak", gradients, np.linalg.inv(jacobian))
            moved = fields[dof_map[nodes, :3]].reshape(len(some), nodes.shape[1], -1)
            strained = (slopes.reshape(len(some), -1, nodes.shape[1]) @ moved).reshape(*slopes.shape[:3], 3, -1)
            nodal = np.einsum("nq,eqsm->ensm", to_nodes, _stress(strained, self.lame[some]))
            at = place[nodes]
            np.add.at(total, at[at >= 0], nodal[at >= 0])
            np.add.at(count, at[at >= 0], 1.0)
        return total / count[:, None, None]

    def converted(self, length: float, stress: float) -> SolidStress:
        """The same elements in other units; see `fe_import.model.StressSource`."""
        return replace(self, mesh=replace(self.mesh, nodes=self.mesh.nodes * length), lame=self.lame * stress)


def solid_stress(mesh: SolidMesh, lame: Array) -> SolidStress:
    """Stress of a mesh with Lamé's parameters (elements, 2) of each element."""
    sets = {name: np.unique(mesh.elements[elements]) for name, elements in mesh.element_sets.items()}
    return SolidStress(mesh, lame, {**sets, **mesh.node_sets})


def sampling(element: SolidElement) -> tuple[Array, Array]:
    """Points (3, q) at which strains are taken, and the (k, q) matrix from values there to values at the nodes."""
    if element.corners == 8:
        points = element.quadrature(3)[0]
        powers = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    elif element.midpoints:
        far, near = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
        points = np.full((3, 4), near)
        points[:, 1:] += (far - near) * np.eye(3)
        powers = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    else:
        points, powers = np.full((3, 1), 0.25), np.zeros((1, 3), dtype=int)

    def monomials(at: Array) -> Array:
        return np.asarray(np.prod(at[:, None, :] ** powers, axis=2))

    return points, monomials(element.reference_nodes) @ np.linalg.inv(monomials(points.T))


def _stress(gradient: Array, lame: Array) -> Array:
    """(e, q, 6, m) stress of displacement gradients (e, q, derivative, component, m)."""
    lam, mu = (part[:, None, None] for part in lame.T)
    trace = lam * np.einsum("eqaam->eqm", gradient)
    parts = [trace + 2 * mu * gradient[:, :, a, a] for a in range(3)]
    parts += [mu * (gradient[:, :, a, b] + gradient[:, :, b, a]) for a, b in ((0, 1), (1, 2), (2, 0))]
    return np.stack(parts, axis=2)
