"""Faces and lines of the elements of input decks, for pictures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fe_import.abaqus.elements import solid_type
from fe_import.elements.solid_mesh import FACE_TRIANGLES, ElementBlock, SolidMesh, boundary_faces, split_faces
from fe_import.model import IntArray


def picture(elements: Mapping[str, IntArray]) -> tuple[IntArray, IntArray]:
    """Lines (m, 2) of beams and trusses, triangles (t, 3) of shells and of the surface of solids.

    Parameters
    ----------
    elements : dict of (m, k) int arrays
        Type -> indices of the nodes of its elements.
    """
    lines, solids, shells = [np.zeros((0, 2), dtype=np.int64)], [], []
    for kind, nodes in elements.items():
        if (solid := solid_type(kind)) is not None:
            solids.append(ElementBlock(solid.name, nodes))
        elif kind.startswith(("B3", "T3D")):
            lines += [nodes[:, k : k + 2] for k in range(nodes.shape[1] - 1)]
        elif kind.startswith(("S", "M3D", "R3D")) and nodes.shape[1] in FACE_TRIANGLES:
            shells.append(nodes)
    faces = boundary_faces(SolidMesh(np.zeros((0, 3)), tuple(solids))) if solids else []
    return np.concatenate(lines), split_faces([*faces, *shells])
