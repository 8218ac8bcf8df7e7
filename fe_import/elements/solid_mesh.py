"""A mesh of one solid element type, and its surface: data only."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fe_import.elements.solid_elements import SOLID_ELEMENTS, SolidElement
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class SolidMesh:
    """Nodes, elements and named sets of a solid link.

    Attributes
    ----------
    nodes : (n, 3) array
        Positions in the mesh frame, in the file's unit of length; every node belongs to an element.
    elements : (m, k) int array
        Nodes of each element in meshio's (VTK's) order.
    element_type : str
        Key of ``SOLID_ELEMENTS``.
    element_sets : dict
        Name -> elements, rising.
    node_sets : dict
        Name -> nodes, rising.
    source : str
        File that the mesh came from.
    lost_sets : dict
        Name -> why a set of the file is not among these.
    left_out : dict of int
        What stands in the file and is not part of the link, and how often.
    """

    nodes: Array
    elements: IntArray
    element_type: str
    element_sets: dict[str, IntArray] = field(default_factory=dict)
    node_sets: dict[str, IntArray] = field(default_factory=dict)
    source: str = ""
    lost_sets: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, int] = field(default_factory=dict)

    @property
    def element(self) -> SolidElement:
        """The element type's entry in the registry."""
        return SOLID_ELEMENTS[self.element_type]


def element_faces(mesh: SolidMesh) -> tuple[IntArray, IntArray]:
    """All faces of all elements, and which of them are one and the same.

    Returns
    -------
    faces : (m * faces of an element, nodes of a face) int array
        Element by element, anticlockwise seen from outside.
    label : (m * faces of an element,) int array
        Equal for faces of equal corners.
    """
    faces = mesh.elements[:, mesh.element.faces].reshape(-1, mesh.element.faces.shape[1])
    corners = np.sort(faces[:, : len(mesh.element.corner_faces[0])], axis=1)
    label = np.unique(corners, axis=0, return_inverse=True)[1]
    return faces, np.asarray(label.ravel(), dtype=np.int64)


def boundary_faces(mesh: SolidMesh) -> IntArray:
    """(f, nodes of a face) faces of one element only, anticlockwise seen from outside."""
    faces, label = element_faces(mesh)
    return np.asarray(faces[np.bincount(label)[label] == 1])


# a face of n nodes -> triangles over its nodes (corners, then mid-edge nodes, then centre), same sense
FACE_TRIANGLES = {
    3: ((0, 1, 2),),
    4: ((0, 1, 2), (0, 2, 3)),
    6: ((0, 3, 5), (1, 4, 3), (2, 5, 4), (3, 4, 5)),
    8: ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 6), (4, 6, 7)),
    9: ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)),
}


def surface_triangles(mesh: SolidMesh) -> IntArray:
    """Faces of one element only, split into triangles over all their nodes, so that curvature shows.

    Returns
    -------
    (t, 3) int array
        Anticlockwise seen from outside.
    """
    boundary = boundary_faces(mesh)
    corners = np.array(FACE_TRIANGLES[boundary.shape[1]])
    return np.asarray(boundary[:, corners].reshape(-1, 3), dtype=np.int64)
