"""The registry of solid element types: node order, faces, shape functions, quadrature.

Nodes are in meshio's order, which is VTK's: corners, then mid-edge, mid-face and centre nodes. To add a
type: one entry in ``SOLID_ELEMENTS``; the tests over the registry (patch test, mass, rigid-body modes) then
include it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.special
import skfem

from fe_import.model import Array, IntArray

Tuples = tuple[tuple[int, ...], ...]

_TET_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_TET_EDGES: Tuples = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_TET_FACES: Tuples = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))

_HEX_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_HEX_EDGES: Tuples = (
    *((0, 1), (1, 2), (2, 3), (3, 0)),
    *((4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)
_HEX_FACES: Tuples = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
_HEX_CENTRE: Tuples = ((0, 1, 2, 3, 4, 5, 6, 7),)


@dataclass(frozen=True)
class SolidElement:
    """One solid element type.

    Attributes
    ----------
    name, meshio_name : str
    corner_coordinates : tuple
        Corners of the reference cell (unit tetrahedron, unit cube).
    midpoints : tuple of tuples
        For each further node, the corners between which it sits.
    corner_faces : tuple of tuples
        Corners of each face, anticlockwise seen from outside.
    shape : skfem.Element
        Shape functions, of the displacements and of the geometry.
    topology : type
        Class of scikit-fem's mesh.
    stiffness_order, mass_order : int
        Degree of polynomials (in each reference coordinate for hexahedra) that the quadrature integrates
        exactly. It makes the stiffness exact for constant strains and the mass exact throughout, with
        curved sides too.
    """

    name: str
    meshio_name: str
    corner_coordinates: Tuples
    midpoints: Tuples
    corner_faces: Tuples
    shape: Any
    topology: Any
    stiffness_order: int
    mass_order: int

    @property
    def corners(self) -> int:
        """Number of corners."""
        return len(self.corner_coordinates)

    @cached_property
    def reference_nodes(self) -> Array:
        """(k, 3) nodes of the reference cell."""
        corners = np.array(self.corner_coordinates, dtype=float)
        return np.vstack([corners, *(corners[list(between)].mean(axis=0) for between in self.midpoints)])

    @cached_property
    def skfem_order(self) -> IntArray:
        """(k,) our node at each of scikit-fem's local nodes, matched by place in the reference cell."""
        distance = np.abs(self.shape.doflocs[:, None, :] - self.reference_nodes[None, :, :]).max(axis=2)
        return np.asarray(distance.argmin(axis=1), dtype=np.int64)

    @cached_property
    def faces(self) -> IntArray:
        """(faces, nodes of a face) corners, mid-edge nodes in the same sense, then the centre, if any."""
        at = {frozenset(between): self.corners + i for i, between in enumerate(self.midpoints)}
        rows = []
        for face in self.corner_faces:
            edges = [frozenset(edge) for edge in zip(face, (*face[1:], face[0]), strict=True)]
            rows.append([*face, *(at[part] for part in (*edges, frozenset(face)) if part in at)])
        return np.array(rows, dtype=np.int64)

    @cached_property
    def mirrored_order(self) -> IntArray:
        """(k,) nodes of an element that another program numbers inside out (MED), in our order."""
        corners = [0, 2, 1, 3] if self.corners == 4 else [0, 3, 2, 1, 4, 7, 6, 5]
        at = {frozenset(between): self.corners + i for i, between in enumerate(self.midpoints)}
        middle = [at[frozenset(corners[c] for c in between)] for between in self.midpoints]
        return np.array([*corners, *middle], dtype=np.int64)

    def shape_values(self, points: Array) -> Array:
        """(k, q) shape functions at points (3, q)."""
        values = np.empty((len(self.reference_nodes), points.shape[1]))
        for local, node in enumerate(self.skfem_order):
            values[node] = self.shape.lbasis(points, local)[0]
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
        gradients = np.empty((len(self.reference_nodes), *points.shape))
        for local, node in enumerate(self.skfem_order):
            gradients[node] = self.shape.lbasis(points, local)[1]
        return gradients

    def quadrature(self, order: int) -> tuple[Array, Array]:
        """Points (3, q) and positive weights (q,) of a rule on the reference cell, exact to ``order``.

        Gauss-Legendre products on the cube; on the tetrahedron the collapsed product with Gauss-Jacobi
        points (A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971), because scikit-fem 12's
        tabulated rules have negative weights at orders 3 and 4 and miss their stated order from 5 on.
        """
        n = order // 2 + 1
        rules = [scipy.special.roots_jacobi(n, power if self.corners == 4 else 0, 0) for power in (2, 1, 0)]
        # roots_jacobi integrates (1 - t)^power over [-1, 1]; here over [0, 1]
        points = [(t + 1) / 2 for t, _ in rules]
        weights = [w / w.sum() for _, w in rules]
        x, y, z = (g.ravel() for g in np.meshgrid(*points, indexing="ij"))
        w = np.einsum("i,j,k->ijk", *weights).ravel()
        if self.corners == 4:
            return np.stack([x, (1 - x) * y, (1 - x) * (1 - y) * z]), w / 6
        return np.stack([x, y, z]), w


SOLID_ELEMENTS: dict[str, SolidElement] = {
    element.name: element
    for element in (
        SolidElement(
            "tet4", "tetra", _TET_CORNERS, (), _TET_FACES, skfem.ElementTetP1(), skfem.MeshTet1, 1, 2
        ),
        SolidElement(
            "tet10",
            "tetra10",
            _TET_CORNERS,
            _TET_EDGES,
            _TET_FACES,
            skfem.ElementTetP2(),
            skfem.MeshTet1,
            3,
            7,
        ),
        SolidElement(
            "hex8", "hexahedron", _HEX_CORNERS, (), _HEX_FACES, skfem.ElementHex1(), skfem.MeshHex1, 3, 5
        ),
        SolidElement(
            "hex20",
            "hexahedron20",
            _HEX_CORNERS,
            _HEX_EDGES,
            _HEX_FACES,
            skfem.ElementHexS2(),
            skfem.MeshHex1,
            5,
            9,
        ),
        SolidElement(
            "hex27",
            "hexahedron27",
            _HEX_CORNERS,
            _HEX_EDGES + _HEX_FACES + _HEX_CENTRE,
            _HEX_FACES,
            skfem.ElementHex2(),
            skfem.MeshHex1,
            5,
            9,
        ),
    )
}
