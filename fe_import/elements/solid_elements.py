"""The registry of solid element types: node order, faces, shape functions, quadrature.

Nodes are in meshio's order, which is VTK's: corners, then mid-edge, mid-face and centre nodes. To add a
type: one entry in ``SOLID_ELEMENTS``; the tests over the registry (patch test, mass, rigid-body modes) then
include it. Mesh files hold the types of ``MESH_ELEMENTS``; the others are ways to compute these.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fe_import.elements import nodal_basis
from fe_import.elements.reference_cells import HEXAHEDRON, PYRAMID, TETRAHEDRON, WEDGE, Cell, Tuples
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class SolidElement:
    """One solid element type.

    Attributes
    ----------
    name, meshio_name : str
    cell : Cell
    midpoints : tuple of tuples
        For each further node, the corners between which it sits.
    shape : str or tuple
        Shape functions, of the displacements and of the geometry: name of scikit-fem's element, or the powers that
        span a space of `fe_import.elements.nodal_basis`.
    stiffness_order, mass_order : int
        Degree of polynomials (in each reference coordinate for hexahedra) that the quadrature integrates
        exactly. It makes the stiffness exact for constant strains and the mass exact throughout, with
        curved sides too.
    raised : str
        Type of the next order with the same corners, empty where there is none.
    incompatible : bool
        Whether three modes 1 - t², t from -1 to 1 along each reference coordinate, add to the strains within the
        element, which take the parasitic shear from bending (R. L. Taylor, P. J. Beresford & E. L. Wilson, Int. J.
        Numer. Methods Eng. 10 (1976) 1211-1219: with the Jacobian of the centre constant strains stay exact).
    """

    name: str
    meshio_name: str
    cell: Cell
    midpoints: Tuples
    shape: str | nodal_basis.Powers
    stiffness_order: int
    mass_order: int
    raised: str = ""
    incompatible: bool = False

    @property
    def corners(self) -> int:
        """Number of corners."""
        return len(self.cell.corners)

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.corners + len(self.midpoints)

    @cached_property
    def reference_nodes(self) -> Array:
        """(k, 3) nodes of the reference cell."""
        corners = np.array(self.cell.corners, dtype=float)
        return np.vstack([corners, *(corners[list(between)].mean(axis=0) for between in self.midpoints)])

    @cached_property
    def skfem_element(self) -> Any:
        """scikit-fem's element."""
        import skfem  # heavy, and a mesh is read without it

        return getattr(skfem, str(self.shape))()

    @cached_property
    def skfem_order(self) -> IntArray:
        """(k,) our node at each of scikit-fem's local nodes, matched by place in the reference cell."""
        distance = np.abs(self.skfem_element.doflocs[:, None, :] - self.reference_nodes[None, :, :]).max(axis=2)
        return np.asarray(distance.argmin(axis=1), dtype=np.int64)

    @cached_property
    def faces(self) -> tuple[IntArray, ...]:
        """Nodes of each face: corners, mid-edge nodes in the same sense, then the centre, if any."""
        at = {frozenset(between): self.corners + i for i, between in enumerate(self.midpoints)}
        rows = []
        for face in self.cell.faces:
            edges = [frozenset(edge) for edge in zip(face, (*face[1:], face[0]), strict=True)]
            nodes = [*face, *(at[part] for part in (*edges, frozenset(face)) if part in at)]
            rows.append(np.array(nodes, dtype=np.int64))
        return tuple(rows)

    @cached_property
    def mirrored_order(self) -> IntArray:
        """(k,) nodes of an element that another program numbers inside out (MED), in our order."""
        at = {frozenset(between): self.corners + i for i, between in enumerate(self.midpoints)}
        middle = [at[frozenset(self.cell.mirrored[c] for c in between)] for between in self.midpoints]
        return np.array([*self.cell.mirrored, *middle], dtype=np.int64)

    @cached_property
    def _coefficients(self) -> Array:
        assert not isinstance(self.shape, str)
        return nodal_basis.nodal_coefficients(self.shape, self.reference_nodes)

    def shape_values(self, points: Array) -> Array:
        """(k, q) shape functions at points (3, q)."""
        if not isinstance(self.shape, str):
            return nodal_basis.values(self.shape, self._coefficients, points)
        values = np.empty((self.size, points.shape[1]))
        for local, node in enumerate(self.skfem_order):
            values[node] = self.skfem_element.lbasis(points, local)[0]
        return values

    def shape_gradients(self, points: Array) -> Array:
        """Derivatives of the shape functions with respect to the reference coordinates.

        Parameters
        ----------
        points : (3, q) array

        Returns
        -------
        (k, 3, q) array
        """
        if not isinstance(self.shape, str):
            return nodal_basis.gradients(self.shape, self._coefficients, points)
        gradients = np.empty((self.size, *points.shape))
        for local, node in enumerate(self.skfem_order):
            gradients[node] = self.skfem_element.lbasis(points, local)[1]
        return gradients

    def incompatible_gradients(self, points: Array) -> Array:
        """(3, 3, q) derivatives of the incompatible modes of a hexahedron by the reference coordinates, 0 ... 1."""
        return np.asarray(4 * np.eye(3)[:, :, None] * (1 - 2 * points))

    def quadrature(self, order: int) -> tuple[Array, Array]:
        """Points (3, q) and positive weights (q,) of a rule on the reference cell; see `Cell.quadrature`."""
        return self.cell.quadrature(order)


_CENTRES = (*HEXAHEDRON.faces, tuple(range(8)))
SOLID_ELEMENTS: dict[str, SolidElement] = {
    element.name: element
    for element in (
        SolidElement("tet4", "tetra", TETRAHEDRON, (), "ElementTetP1", 1, 2, "tet10"),
        SolidElement("tet10", "tetra10", TETRAHEDRON, TETRAHEDRON.edges, "ElementTetP2", 3, 7),
        SolidElement("pyramid5", "pyramid", PYRAMID, (), nodal_basis.PYRAMID_5, 3, 5, "pyramid13"),
        SolidElement("pyramid13", "pyramid13", PYRAMID, PYRAMID.edges, nodal_basis.PYRAMID_13, 7, 11),
        SolidElement("wedge6", "wedge", WEDGE, (), "ElementWedge1", 3, 5, "wedge15"),
        SolidElement("wedge15", "wedge15", WEDGE, WEDGE.edges, nodal_basis.WEDGE_15, 5, 9),
        SolidElement("hex8", "hexahedron", HEXAHEDRON, (), "ElementHex1", 3, 5, "hex20"),
        SolidElement("hex8i", "hexahedron", HEXAHEDRON, (), "ElementHex1", 3, 5, "hex20", incompatible=True),
        SolidElement("hex20", "hexahedron20", HEXAHEDRON, HEXAHEDRON.edges, "ElementHexS2", 5, 9),
        SolidElement("hex27", "hexahedron27", HEXAHEDRON, HEXAHEDRON.edges + _CENTRES, "ElementHex2", 5, 9),
    )
}

MESH_ELEMENTS = {name: element for name, element in SOLID_ELEMENTS.items() if not element.incompatible}
