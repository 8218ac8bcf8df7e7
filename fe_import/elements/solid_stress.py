"""Stress at the nodes of a solid as a linear map of the nodal displacements.

Strains are taken at the points where those of the element are most accurate (J. Barlow, Int. J. Numer. Methods Eng.
10, 1976: 2 x 2 x 2 Gauss points of hexahedra, 4 points of the tet10, 3 x 2 of the wedge15, the centre of linear
elements), extrapolated to its nodes by the polynomial through these points (of the pyramid13 the linear one nearest to
8), and averaged over the elements that meet at a node. Where two materials meet, the average is over both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_import.elements.elasticity import average_lame_parameters, stress_of_gradient
from fe_import.elements.reference_cells import HEXAHEDRON, TETRAHEDRON, WEDGE
from fe_import.elements.solid import SolidMaterial, element_moduli
from fe_import.elements.solid_assembly import chunks, motion_of_modes, slopes
from fe_import.elements.solid_elements import SolidElement
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.model import Array, IntArray

_CHUNK_VALUES = 4_000_000  # stress values held at a time
_POWERS = (np.zeros((1, 3), dtype=int), np.vstack([np.zeros((1, 3), dtype=int), np.eye(3, dtype=int)]))


@dataclass(frozen=True)
class SolidStress:
    """The elements of a solid, for their stress; a `fe_import.model.StressSource`. Its sites are the mesh nodes.

    Attributes
    ----------
    mesh : SolidMesh
    moduli : (k, 6, 6) array
        Of all materials [Pa], see `fe_import.elements.elasticity`.
    material : (elements,) int array
        Which of them each element has.
    sets : dict
        Nodes of the mesh's node sets and of its element sets.
    """

    mesh: SolidMesh
    moduli: Array
    material: IntArray
    sets: Mapping[str, IntArray]
    quantity: str = "stress"

    @property
    def lame(self) -> Array:
        """(elements, 2) λ and μ [Pa] of each element, averaged over all directions where they are not isotropic."""
        return np.asarray(average_lame_parameters(self.moduli)[self.material])

    def moduli_of(self, numbers: IntArray) -> Array:
        """(e, 6, 6) of elements."""
        return np.asarray(self.moduli[self.material[numbers]])

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
        mesh = self.mesh
        place = np.full(len(mesh.nodes), -1, dtype=np.int64)
        place[sites] = np.arange(len(sites))
        total, count = np.zeros((len(sites), 6, fields.shape[1])), np.zeros(len(sites))
        for block, _, numbers in mesh.parts():
            points, to_nodes = sampling(block.element)
            touching = np.flatnonzero((place[block.elements] >= 0).any(axis=1))
            step = max(1, _CHUNK_VALUES // (len(to_nodes) * 9 * max(1, fields.shape[1])))
            for start in range(0, len(touching), step):
                some = touching[start : start + step]
                nodes = block.elements[some]
                moved = fields[dof_map[nodes, :3]].reshape(len(some), nodes.shape[1], -1)
                stress = self._at(block.element, nodes, numbers[some], moved, points)
                nodal = np.einsum("nq,eqsm->ensm", to_nodes, stress)
                at = place[nodes]
                np.add.at(total, at[at >= 0], nodal[at >= 0])
                np.add.at(count, at[at >= 0], 1.0)
        return total / count[:, None, None]

    def energy_of_error(self, fields: Array, dof_map: IntArray) -> tuple[Array, Array]:
        """(m,) ∫ e : C⁻¹ : e / 2 of the difference e between this stress and the one averaged at the nodes, and the
        energy of this stress [J]."""
        averaged = self.evaluate(fields, dof_map, self.site_nodes)
        totals, compliances = np.zeros((2, fields.shape[1])), np.linalg.inv(self.moduli)
        for element, nodes, numbers in chunks(self.mesh):
            points, weights = element.quadrature(element.stiffness_order)
            moved = fields[dof_map[nodes, :3]].reshape(len(nodes), nodes.shape[1], -1)
            stress = self._at(element, nodes, numbers, moved, points)
            smooth = np.einsum("kq,eksm->eqsm", element.shape_values(points), averaged[nodes])
            volume = slopes(element, self.mesh.nodes[nodes], points)[1] * weights
            for total, part in zip(totals, (smooth - stress, stress), strict=True):
                strain = compliances[self.material[numbers]][:, None] @ part
                total += np.einsum("eqsm,eqsm,eq->m", part, strain, volume) / 2
        return totals[0], totals[1]

    def _at(self, element: SolidElement, nodes: IntArray, numbers: IntArray, moved: Array, points: Array) -> Array:
        """(e, q, 6, m) stress at points of elements whose nodes move by ``moved`` (e, k, 3 m)."""
        corners, moduli = self.mesh.nodes[nodes], self.moduli_of(numbers)
        gradients, _ = slopes(element, corners, points)
        count, size = nodes.shape
        modes = motion_of_modes(element, corners, moduli)
        inner = (modes @ moved.reshape(count, 3 * size, -1)).reshape(count, -1, moved.shape[2])
        moved = np.concatenate([moved, inner], axis=1)
        strained = gradients.reshape(count, -1, moved.shape[1]) @ moved
        return stress_of_gradient(strained.reshape(*gradients.shape[:3], 3, -1), moduli)

    def converted(self, length: float, stress: float) -> SolidStress:
        """The same elements in other units; see `fe_import.model.StressSource`."""
        return replace(self, mesh=replace(self.mesh, nodes=self.mesh.nodes * length), moduli=self.moduli * stress)


def solid_stress(mesh: SolidMesh, materials: Sequence[SolidMaterial]) -> SolidStress:
    """Stress of a mesh of materials."""
    sets = {name: mesh.nodes_of(elements) for name, elements in mesh.element_sets.items()}
    return SolidStress(mesh, *element_moduli(mesh, materials), {**sets, **mesh.node_sets})


def sampling(element: SolidElement) -> tuple[Array, Array]:
    """Points (3, q) at which strains are taken, and the (k, q) matrix from values there to values at the nodes."""
    cell, quadratic = element.cell, bool(element.midpoints)
    powers = _POWERS[1 if quadratic else 0]
    points = cell.quadrature(3 if quadratic else 1)[0]
    if cell is HEXAHEDRON:
        points, powers = cell.quadrature(3)[0], np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    elif cell is WEDGE:
        triangle = np.full((2, 3), 1 / 6) + np.eye(2, 3) / 2 if quadratic else np.full((2, 1), 1 / 3)
        heights = np.polynomial.legendre.leggauss(2)[0] / 2 + 0.5
        points = np.vstack([np.repeat(triangle, 2, axis=1), np.tile(heights, triangle.shape[1])])
        plane = [[0, 0], [1, 0], [0, 1]] if quadratic else [[0, 0]]
        powers = np.array([[*p, k] for p in plane for k in (0, 1)])
    elif cell is TETRAHEDRON and quadratic:
        far, near = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
        points = np.full((3, 4), near)
        points[:, 1:] += (far - near) * np.eye(3)

    def monomials(at: Array) -> Array:
        return np.asarray(np.prod(at[:, None, :] ** powers, axis=2))

    return points, monomials(element.reference_nodes) @ np.linalg.pinv(monomials(points.T))

